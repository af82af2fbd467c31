// Descriptions (JSON): reading members, and the messages when one is wrong.
#include "io/description.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <system_error>

#include "expression/evaluate.hpp"
#include "expression/parser.hpp"

namespace smurf::description {

using nlohmann::json;

const json& member(const json& object, std::string_view path, std::string_view name) {
  const auto found = object.find(std::string(name));
  if (found == object.end()) throw Error(ErrorCode::input, fmt::format("member \"{}\" is missing", join(path, name)));
  return *found;
}

const json& object_member(const json& object, std::string_view path, std::string_view name) {
  const json& value = member(object, path, name);
  if (!value.is_object()) {
    throw Error(ErrorCode::input,
                fmt::format("member \"{}\" must be an object, not {}", join(path, name), shown(value)));
  }
  return value;
}

std::string text_member(const json& object, std::string_view path, std::string_view name) {
  const json& value = member(object, path, name);
  if (!value.is_string() || value.get_ref<const std::string&>().empty()) {
    throw Error(ErrorCode::input, fmt::format("member \"{}\" must be a string that is not empty, not {}",
                                              join(path, name), shown(value)));
  }
  return value.get<std::string>();
}

double number_member(const json& object, std::string_view path, std::string_view name) {
  const json& value = member(object, path, name);
  if (!value.is_number()) {
    throw Error(ErrorCode::input,
                fmt::format("member \"{}\" must be a finite number, not {}", join(path, name), shown(value)));
  }
  return value.get<double>();
}

void only_members(const json& object, std::string_view path, std::initializer_list<std::string_view> known) {
  for (const auto& item : object.items()) {
    if (std::find(known.begin(), known.end(), item.key()) == known.end()) {
      throw Error(ErrorCode::input,
                  fmt::format("unknown member \"{}\"; known here: {}", join(path, item.key()), fmt::join(known, ", ")));
    }
  }
}

std::string join(std::string_view path, std::string_view name) {
  return path.empty() ? std::string(name) : fmt::format("{}.{}", path, name);
}

std::string shown(const json& value) {
  // Bytes that are no UTF-8 cannot come from a parsed file; replaced all the same rather than thrown upon.
  std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  constexpr std::size_t longest = 40;
  if (text.size() > longest) text = text.substr(0, longest) + "...";
  return text;
}

namespace {

[[noreturn]] void throw_input(const std::string& message) { throw Error(ErrorCode::input, message); }

}  // namespace

double constant(const json& value, const std::string& path, const Parameters& parameters) {
  if (value.is_number()) return value.get<double>();
  if (!value.is_string() || value.get_ref<const std::string&>().empty())
    throw_input(fmt::format("member \"{}\" must be a number, or an expression of constants such as \"2*pi\", not {}",
                            path, shown(value)));
  const std::string text = value.get<std::string>();
  double result = 0;
  try {
    expression::Graph graph;
    const expression::NodeId root = expression::parse(graph, text, {}, parameters);
    std::vector<double> scratch;
    expression::Evaluator(graph, std::span(&root, 1))({}, std::span(&result, 1), scratch);
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("member \"{}\": {}", path, error.what()));
  }
  if (!std::isfinite(result))
    throw_input(fmt::format("member \"{}\": \"{}\" is {}; it must be a finite number", path, expression::excerpt(text),
                            std::isnan(result) ? "undefined" : "infinite"));
  return result;
}

glm::dvec2 range(const json& object, std::string_view path, std::string_view name, const Parameters& parameters) {
  const std::string place = join(path, name);
  const json& value = member(object, path, name);
  if (!value.is_array() || value.size() != 2)
    throw_input(fmt::format("member \"{}\" must be a range such as [0, \"2*pi\"], not {}", place, shown(value)));
  const glm::dvec2 range(constant(value[0], place + "[0]", parameters), constant(value[1], place + "[1]", parameters));
  if (range.x == range.y)
    throw_input(fmt::format("member \"{}\": the range [{}, {}] is empty", place, range.x, range.y));
  if (range.x > range.y)
    throw_input(fmt::format("member \"{}\": the range [{}, {}] is reversed; the lesser number comes first", place,
                            range.x, range.y));
  return range;
}

glm::dvec3 three_numbers(const json& value, const std::string& path) {
  glm::dvec3 corner;
  bool fits = value.is_array() && value.size() == 3;
  for (std::size_t i = 0; fits && i < 3; i++) {
    fits = value[i].is_number();
    if (fits) corner[int(i)] = value[i].get<double>();
  }
  if (!fits)
    throw Error(ErrorCode::input, fmt::format("member \"{}\" must hold three numbers, not {}", path, shown(value)));
  return corner;
}

std::array<std::string, 3> three_expressions(const json& object, std::string_view path, std::string_view name,
                                             std::string_view variables) {
  const std::string full = join(path, name);
  const json& value = member(object, path, name);
  if (!value.is_array() || value.size() != 3)
    throw_input(fmt::format("member \"{}\" must be three expressions in {}, of x, y and z, not {}", full, variables,
                            shown(value)));
  std::array<std::string, 3> texts;
  for (std::size_t k = 0; k < 3; k++) {
    if (value[k].is_number()) {
      texts[k] = fmt::format("{}", value[k].get<double>());
    } else if (value[k].is_string() && !value[k].get_ref<const std::string&>().empty()) {
      texts[k] = value[k].get<std::string>();
    } else {
      throw_input(
          fmt::format("member \"{}[{}]\" must be an expression in {}, not {}", full, k, variables, shown(value[k])));
    }
  }
  return texts;
}

std::optional<Domain> domain(const json& object, std::string_view path) {
  Domain found;
  const bool box = object.contains("domain"), ball = object.contains("radius");
  if (!box && !ball) return std::nullopt;
  if (ball) {
    found.radius = number_member(object, path, "radius");
    if (!(found.radius > 0))
      throw Error(ErrorCode::input,
                  fmt::format("member \"{}\" must be positive, not {}", join(path, "radius"), found.radius));
    found.lower = glm::dvec3(-found.radius);
    found.upper = glm::dvec3(found.radius);
  }
  if (box) {
    const std::string name = join(path, "domain");
    const json& value = object["domain"];
    if (!value.is_array() || value.size() != 2)
      throw Error(ErrorCode::input,
                  fmt::format("member \"{}\" must be two corners, [[x, y, z], [x, y, z]], not {}", name, shown(value)));
    found.lower = three_numbers(value[0], name + "[0]");
    found.upper = three_numbers(value[1], name + "[1]");
  }
  return found;
}

Domain required_domain(const json& object, std::string_view path) {
  if (const auto found = domain(object, path)) return *found;
  throw Error(ErrorCode::input,
              fmt::format("member \"{}\" is missing: an expression needs the box [[x, y, z], [x, y, z]] to look in",
                          join(path, "domain")));
}

Parameters parameters(const json& object, std::string_view path) {
  Parameters found;
  if (!object.contains("parameters")) return found;
  const json& values = object_member(object, path, "parameters");
  for (const auto& item : values.items())
    found[item.key()] = constant(item.value(), join(join(path, "parameters"), item.key()));
  return found;
}

namespace {

// nlohmann's messages start with "[json.exception.parse_error.101] "; the rest is for people.
std::string plain(const json::exception& error) {
  std::string text = error.what();
  if (const auto end = text.find("] "); text.starts_with("[json.") && end != std::string::npos) text.erase(0, end + 2);
  return text;
}

}  // namespace

json parse(const std::filesystem::path& file, std::string_view what) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored))
    throw Error(ErrorCode::input, fmt::format("is a folder, not {}", what));
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    throw Error(ErrorCode::input,
                fmt::format("cannot open this file, which should be {}: no such file, or not readable", what));
  try {
    return json::parse(stream, nullptr, true, /*ignore_comments=*/true);
  } catch (const json::exception& error) {
    throw Error(ErrorCode::input, "not valid JSON: " + plain(error));
  }
}

std::string ending_of(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return ending;
}

void fail_in(const std::filesystem::path& file, const Error& error) {
  // What reads data has the name of the file in front.
  const std::string message = error.what(), name = file.string();
  if (message.starts_with(name) || message.starts_with("\"" + name + "\"")) throw Error(error);
  throw Error(error.code(), fmt::format("{}: {}", name, message));
}

}  // namespace smurf::description
