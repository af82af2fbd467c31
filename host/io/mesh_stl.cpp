// STL: triangles by the coordinates of their corners, as text or binary. Normals in the file are not read: the order of
// corners tells.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>

#include "io/mesh_file.hpp"
#include "io/word_reader.hpp"

namespace smurf {
namespace {

using std::filesystem::path;

constexpr std::size_t header_bytes = 84, triangle_bytes = 50;

// All numbers are little-endian.
std::uint32_t word_at(const std::string& bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;) word = word << 8 | static_cast<unsigned char>(bytes[at + i]);
  return word;
}

void add_corner(Polygons& polygons, const glm::vec3& corner) {
  polygons.corners.push_back(std::uint32_t(polygons.vertices.size()));
  polygons.vertices.push_back(corner);
}

Polygons read_binary(const std::string& bytes, std::size_t triangles) {
  Polygons polygons;
  polygons.vertices.reserve(3 * triangles);
  polygons.corners.reserve(3 * triangles);
  for (std::size_t i = 0; i < triangles; i++) {
    for (std::size_t k = 1; k <= 3; k++) {  // behind the normal
      glm::vec3 corner;
      for (std::size_t axis = 0; axis < 3; axis++) {
        const std::uint32_t word = word_at(bytes, header_bytes + triangle_bytes * i + 12 * k + 4 * axis);
        std::memcpy(&corner[int(axis)], &word, sizeof word);
      }
      add_corner(polygons, corner);
    }
  }
  return polygons;
}

bool is_word(std::string_view word, std::string_view expected) {
  return std::ranges::equal(word, expected, [](unsigned char a, char b) { return std::tolower(a) == b; });
}

void expect(WordReader& reader, std::string_view expected) {
  const std::string_view word = reader.word();
  if (!is_word(word, expected))
    reader.fail(word.empty() ? fmt::format("the file ends where \"{}\" should stand", expected)
                             : fmt::format("\"{}\" stands where \"{}\" should", WordReader::shown(word), expected));
}

Polygons read_text(const path& file, const std::string& text) {
  WordReader reader(file, text, '\n');
  Polygons polygons;
  for (std::string_view word = reader.word(); !word.empty(); word = reader.word()) {
    if (!is_word(word, "solid"))
      reader.fail(fmt::format("\"{}\" stands where \"solid\" should", WordReader::shown(word)));
    reader.next_line();  // the name
    for (word = reader.word(); is_word(word, "facet"); word = reader.word()) {
      expect(reader, "normal");
      for (int axis = 0; axis < 3; axis++) reader.number<float>(reader.word(), "a normal");
      expect(reader, "outer");
      expect(reader, "loop");
      for (int k = 0; k < 3; k++) {
        expect(reader, "vertex");
        glm::vec3 corner;
        for (int axis = 0; axis < 3; axis++) corner[axis] = reader.number<float>(reader.word(), "a coordinate");
        add_corner(polygons, corner);
      }
      expect(reader, "endloop");
      expect(reader, "endfacet");
    }
    if (!is_word(word, "endsolid"))
      reader.fail(word.empty()
                      ? "the file ends where \"facet\" or \"endsolid\" should stand"
                      : fmt::format("\"{}\" stands where \"facet\" or \"endsolid\" should", WordReader::shown(word)));
    reader.next_line();
  }
  return polygons;
}

}  // namespace

// Binary when the size is that which the number of triangles asks for: headers of binary files may begin with "solid",
// too.
Polygons read_stl(const path& file, const std::string& bytes) {
  const std::size_t triangles = bytes.size() >= header_bytes ? word_at(bytes, header_bytes - 4) : 0;
  const std::size_t expected = header_bytes + triangle_bytes * triangles;
  if (bytes.size() >= header_bytes && bytes.size() == expected) return read_binary(bytes, triangles);
  WordReader first(file, bytes, '\n');
  const bool has_zeros = bytes.find('\0') != bytes.npos;  // which no text has
  if (is_word(first.word(), "solid") && !has_zeros) return read_text(file, bytes);
  const std::string size = bytes.size() < header_bytes
                               ? fmt::format("{} bytes are too few for a binary one", bytes.size())
                               : fmt::format("as a binary one of {} triangles it would have {} bytes, not {}",
                                             triangles, expected, bytes.size());
  throw Error(ErrorCode::input,
              fmt::format("\"{}\": no STL file: as text it would begin with \"solid\" and have no zero bytes, and {}",
                          file.string(), size));
}

}  // namespace smurf
