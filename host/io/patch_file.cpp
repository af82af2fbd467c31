#include "io/patch_file.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "io/word_reader.hpp"
#include "numerics/text_file.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr std::size_t most_points = std::size_t(1) << 28;  // of a patch; more no memory could hold

glm::dvec4 read_point(WordReader& reader, int dimension) {
  glm::dvec4 point(0, 0, 0, 1);
  for (int i = 0; i < dimension; i++)
    point[i] = reader.number<double>(reader.word(), "a coordinate of a control point");
  return point;
}

Patch read_bezier(WordReader& reader, int degree_u, int degree_v, int dimension) {
  std::vector<glm::dvec4> points;
  for (int i = 0; i < (degree_u + 1) * (degree_v + 1); i++) points.push_back(read_point(reader, dimension));
  return bezier_patch(degree_u, degree_v, std::move(points));
}

void require_degree(const WordReader& reader, int degree) {
  if (degree < 1 || degree > most_patch_degree)
    reader.fail(fmt::format("the degree of a patch is {}; it must be 1 to {}", degree, most_patch_degree));
}

// The number of patches; then of each its degrees and its points.
std::vector<Patch> read_bpt(const path& file, const std::string& text) {
  WordReader reader(file, text, '#');
  const auto count = reader.number<std::int64_t>(reader.word(), "the number of patches");
  if (count < 1 || std::size_t(count) > text.size())
    reader.fail(fmt::format("the number of patches is {}; the file has {} bytes", count, text.size()));
  std::vector<Patch> patches;
  for (std::int64_t i = 0; i < count; i++) {
    const int u = reader.number<int>(reader.word(), "the degree of a patch"),
              v = reader.number<int>(reader.word(), "the degree of a patch");
    require_degree(reader, u);
    require_degree(reader, v);
    patches.push_back(read_bezier(reader, u, v, 3));
  }
  if (!reader.word().empty()) reader.fail(fmt::format("the file goes on behind its {} patches", count));
  return patches;
}

// [C][ST]BBP, bicubic patches, or [C][ST]BEZuvd: of degrees u and v, with points of d numbers (4: homogeneous). Behind
// the points of a patch stand 4 × 2 texture coordinates (ST) and 4 × 4 colours (C), which are passed over.
std::vector<Patch> read_bez(const path& file, const std::string& text) {
  WordReader reader(file, text, '#');
  std::string_view keyword = reader.word();
  const std::string whole(keyword);
  int passed = 0, u = 3, v = 3, dimension = 3;
  const auto take = [&](std::string_view word) {
    const bool there = keyword.starts_with(word);
    if (there) keyword.remove_prefix(word.size());
    return there;
  };
  if (take("C")) passed += 16;
  if (take("ST")) passed += 8;
  const auto digit = [&](std::size_t at) { return keyword[at] - '0'; };
  if (keyword != "BBP") {
    if (!take("BEZ") || keyword.size() != 3 || keyword.find_first_not_of("0123456789") != keyword.npos)
      reader.fail(fmt::format("a .bez file begins with BBP or BEZ and three digits, as in BEZ334, not \"{}\"",
                              WordReader::shown(whole)));
    u = digit(0), v = digit(1), dimension = digit(2);
    if (dimension != 3 && dimension != 4)
      reader.fail(fmt::format("the points of a .bez file have 3 or 4 numbers, not {}", dimension));
  }
  require_degree(reader, u);
  require_degree(reader, v);
  std::vector<Patch> patches;
  while (true) {
    // Whether there is another patch, the next word tells; it is read again as its first number.
    WordReader ahead = reader;
    if (ahead.word().empty()) break;
    patches.push_back(read_bezier(reader, u, v, dimension));
    for (int i = 0; i < passed; i++) reader.number<double>(reader.word(), "a colour or texture coordinate");
  }
  if (patches.empty()) reader.fail("there is no patch in the file");
  return patches;
}

[[noreturn]] void fail(const std::string& what, const std::string& message) {
  throw Error(ErrorCode::input, fmt::format("{}: {}", what, message));
}

const json& member(const json& object, const char* name, const std::string& what) {
  const auto found = object.find(name);
  if (found == object.end()) fail(what, fmt::format("member \"{}\" is missing", name));
  return *found;
}

double number_of(const json& value, const char* name, const std::string& what) {
  if (!value.is_number()) fail(what, fmt::format("member \"{}\" holds what is no number", name));
  return value.get<double>();
}

std::array<int, 2> pair_of(const json& object, const char* name, const std::string& what) {
  const json& value = member(object, name, what);
  std::array<int, 2> pair{};
  if (!value.is_array() || value.size() != 2 || !value[0].is_number_integer() || !value[1].is_number_integer())
    fail(what, fmt::format("member \"{}\" must hold two whole numbers", name));
  for (std::size_t i = 0; i < 2; i++) {
    const auto wide = value[i].get<std::int64_t>();
    if (wide < 0 || wide > std::int64_t(most_points)) fail(what, fmt::format("member \"{}\" is out of range", name));
    pair[i] = int(wide);
  }
  return pair;
}

Patch read_json_patch(const json& object, const std::string& what) {
  if (!object.is_object()) fail(what, "a patch is a JSON object");
  Patch patch;
  patch.degree = pair_of(object, "degree", what);
  patch.size = pair_of(object, "size", what);
  const json& knots = member(object, "knots", what);
  if (!knots.is_array() || knots.size() != 2 || !knots[0].is_array() || !knots[1].is_array())
    fail(what, "member \"knots\" must hold the knots in u and those in v");
  for (std::size_t direction = 0; direction < 2; direction++) {
    for (const json& knot : knots[direction]) patch.knots[direction].push_back(number_of(knot, "knots", what));
  }
  const auto flag = object.find("homogeneous");
  if (flag != object.end() && !flag->is_boolean()) fail(what, "member \"homogeneous\" must be true or false");
  const bool homogeneous = flag != object.end() && flag->get<bool>();
  const std::size_t dimension = homogeneous ? 4 : 3;
  const json& points = member(object, "points", what);
  if (!points.is_array()) fail(what, "member \"points\" must be a list of points");
  for (const json& point : points) {
    if (!point.is_array() || point.size() != dimension)
      fail(what, fmt::format("control point {} must have {} numbers", patch.points.size(), dimension));
    glm::dvec4 p(0, 0, 0, 1);
    for (std::size_t i = 0; i < dimension; i++) p[int(i)] = number_of(point[i], "points", what);
    patch.points.push_back(p);
  }
  const auto weights = object.find("weights");
  if (weights != object.end() && !weights->is_null()) {
    if (homogeneous) fail(what, "homogeneous points have their weights; there must be no member \"weights\"");
    if (!weights->is_array() || weights->size() != patch.points.size())
      fail(what, fmt::format("there must be as many weights as control points, {}", patch.points.size()));
    for (std::size_t i = 0; i < patch.points.size(); i++) {
      const double w = number_of((*weights)[i], "weights", what);
      patch.points[i] = glm::dvec4(w * glm::dvec3(patch.points[i]), w);
    }
  }
  return patch;
}

std::vector<Patch> read_json(const path& file, const std::string& text) {
  const std::string name = fmt::format("\"{}\"", file.string());
  json root;
  try {
    root = json::parse(text);
  } catch (const json::exception& error) {
    fail(name, fmt::format("not valid JSON at byte {}", dynamic_cast<const json::parse_error*>(&error)
                                                            ? dynamic_cast<const json::parse_error&>(error).byte
                                                            : 0));
  }
  if (!root.is_object()) fail(name, "patches are a JSON object with the member \"patches\"");
  const json& list = member(root, "patches", name);
  if (!list.is_array() || list.empty()) fail(name, "member \"patches\" must be a list of one patch or more");
  std::vector<Patch> patches;
  for (const json& object : list)
    patches.push_back(read_json_patch(object, fmt::format("{}, patch {}", name, patches.size())));
  return patches;
}

}  // namespace

std::vector<Patch> load_patches(const path& file) {
  const std::string ending = file.extension().string();
  if (ending != ".bpt" && ending != ".bez" && ending != ".json")
    throw Error(ErrorCode::input, fmt::format("\"{}\": files of patches end in .bpt, .bez or .json", file.string()));
  const std::string text = read_file(file);
  std::vector<Patch> patches = ending == ".bpt"   ? read_bpt(file, text)
                               : ending == ".bez" ? read_bez(file, text)
                                                  : read_json(file, text);
  for (std::size_t i = 0; i < patches.size(); i++)
    require_valid(patches[i], fmt::format("\"{}\", patch {}", file.string(), i));
  return patches;
}

}  // namespace smurf
