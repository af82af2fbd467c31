// OFF (Geomview's, in text and of three dimensions) and OBJ (Wavefront's polygons).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>

#include "io/mesh_file.hpp"
#include "io/word_reader.hpp"

namespace smurf {
namespace {

using std::filesystem::path;
using Index = std::int64_t;

glm::vec3 read_vertex(WordReader& reader) {
  static constexpr std::array names = {"the x of a vertex", "the y of a vertex", "the z of a vertex"};
  glm::vec3 vertex;
  for (int axis = 0; axis < 3; axis++)
    vertex[axis] = reader.number<float>(reader.word_in_line(), names[std::size_t(axis)]);
  return vertex;
}

// Refuses what no memory could hold before anything is reserved: every vertex and face takes a line.
std::size_t read_count(WordReader& reader, const std::string& text, const char* what) {
  const auto count = reader.number<Index>(reader.word(), what);
  if (count < 0 || std::size_t(count) > text.size())
    reader.fail(fmt::format("{} is {}; the file has {} bytes", what, count, text.size()));
  return std::size_t(count);
}

// The line of the next record.
std::string_view first_word(WordReader& reader, std::size_t done, std::size_t of, const char* what) {
  reader.next_line();
  const std::string_view word = reader.word();
  if (word.empty()) reader.fail(fmt::format("the file ends after {} of {} {}", done, of, what));
  return word;
}

}  // namespace

// One vertex and one face a line; what stands behind them on the line (colours, normals) is not read.
Polygons read_off(const path& file, const std::string& text) {
  WordReader reader(file, text, '#');
  const std::string_view keyword = reader.word();
  static const std::set<std::string_view> known = {"OFF",   "COFF",   "NOFF",   "CNOFF",
                                                   "STOFF", "STCOFF", "STNOFF", "STCNOFF"};
  if (!known.contains(keyword))
    reader.fail(fmt::format("an OFF file of three dimensions begins with OFF (or COFF, NOFF, ...), not \"{}\"",
                            WordReader::shown(keyword)));
  const std::size_t vertices = read_count(reader, text, "the number of vertices"),
                    faces = read_count(reader, text, "the number of faces");
  read_count(reader, text, "the number of edges");

  Polygons polygons;
  polygons.vertices.reserve(vertices);
  polygons.sizes.reserve(faces);
  for (std::size_t i = 0; i < vertices; i++) {
    glm::vec3 vertex;
    vertex.x = reader.number<float>(first_word(reader, i, vertices, "vertices"), "the x of a vertex");
    vertex.y = reader.number<float>(reader.word_in_line(), "the y of a vertex");
    vertex.z = reader.number<float>(reader.word_in_line(), "the z of a vertex");
    polygons.vertices.push_back(vertex);
  }
  for (std::size_t i = 0; i < faces; i++) {
    const auto size = reader.number<Index>(first_word(reader, i, faces, "faces"), "the number of corners of a face");
    if (size < 0 || size > Index(text.size())) reader.fail(fmt::format("a face of {} corners", size));
    polygons.sizes.push_back(std::uint32_t(size));
    for (Index k = 0; k < size; k++) {
      const auto index = reader.number<Index>(reader.word_in_line(), "a corner of a face");
      if (index < 0 || index >= Index(vertices))
        reader.fail(
            fmt::format("a face names vertex {}, but there are {} (0 to {})", index, vertices, Index(vertices) - 1));
      polygons.corners.push_back(std::uint32_t(index));
    }
  }
  reader.next_line();
  const std::string_view more = reader.word();
  if (!more.empty()) reader.fail(fmt::format("\"{}\" follows after all {} faces", WordReader::shown(more), faces));
  return polygons;
}

namespace {

// Statements that say nothing of where a polygon is, and elements that are no polygons.
const std::set<std::string_view> silent_statements = {
    "vt",  "vn",     "vp",     "g",      "s",      "o",          "mg",        "bevel", "c_interp", "d_interp",
    "lod", "maplib", "usemap", "usemtl", "mtllib", "shadow_obj", "trace_obj", "ctech", "stech",    "cstype",
    "deg", "bmat",   "step",   "parm",   "trim",   "hole",       "scrv",      "sp",    "end",      "con"};
const std::set<std::string_view> other_elements = {"p", "l", "curv", "curv2", "surf"};

// "7", "7/1", "7//3" or "-1/-1/-1": from 1 upwards, or back from the last vertex so far.
std::uint32_t obj_corner(const WordReader& reader, std::string_view word, std::size_t vertices) {
  const auto index = reader.number<Index>(word.substr(0, word.find('/')), "a corner of a face");
  const Index from_zero = index < 0 ? Index(vertices) + index : index - 1;
  if (from_zero < 0)
    reader.fail(fmt::format("a face names vertex {}, but before this line there are {} (from 1, or from -1 backwards)",
                            index, vertices));
  if (from_zero > 0xfffffffe) reader.fail(fmt::format("a face names vertex {}", index));
  return std::uint32_t(from_zero);
}

}  // namespace

Polygons read_obj(const path& file, const std::string& text) {
  // Lines that end with a backslash go on: the backslash and the end of the line are blanks, of which '\v' counts as a
  // line.
  std::string joined;
  if (text.find('\\') != text.npos) {
    joined = text;
    for (std::size_t at = joined.find('\\'); at != joined.npos; at = joined.find('\\', at + 1)) {
      const std::size_t end = joined.find_first_not_of('\r', at + 1);
      if (end == joined.npos || joined[end] != '\n') continue;
      std::fill(joined.begin() + std::ptrdiff_t(at), joined.begin() + std::ptrdiff_t(end), ' ');
      joined[end] = '\v';
    }
  }
  WordReader reader(file, joined.empty() ? text : joined, '#');
  Polygons polygons;
  std::uint32_t greatest = 0;  // corner, and where it stands; faces may name vertices that follow
  std::optional<WordReader> at_greatest;
  do {
    const std::string_view statement = reader.word_in_line();
    if (statement.empty()) continue;
    if (statement == "v") {
      polygons.vertices.push_back(read_vertex(reader));
    } else if (statement == "f" || statement == "fo") {
      const std::size_t begin = polygons.corners.size();
      for (std::string_view word = reader.word_in_line(); !word.empty(); word = reader.word_in_line()) {
        const std::uint32_t corner = obj_corner(reader, word, polygons.vertices.size());
        polygons.corners.push_back(corner);
        if (corner <= greatest || corner < polygons.vertices.size()) continue;
        greatest = corner;
        at_greatest.emplace(reader);
      }
      polygons.sizes.push_back(std::uint32_t(polygons.corners.size() - begin));
    } else if (other_elements.contains(statement)) {
      polygons.ignored_elements++;
    } else if (!silent_statements.contains(statement)) {
      reader.fail(fmt::format("\"{}\" is no statement of OBJ files", WordReader::shown(statement)));
    }
  } while (reader.next_line());
  if (at_greatest && greatest >= polygons.vertices.size() && !polygons.vertices.empty())
    at_greatest->fail(fmt::format("a face names vertex {}, but there are {} (from 1)", std::uint64_t(greatest) + 1,
                                  polygons.vertices.size()));
  return polygons;
}

}  // namespace smurf
