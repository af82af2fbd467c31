#include "expression/files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "expression/parser.hpp"
#include "numerics/text_file.hpp"
#include "smurf/error.hpp"

namespace smurf::expression {
namespace {

using std::filesystem::path;

[[noreturn]] void fail(const path& file, const std::string& message) {
  throw Error(ErrorCode::input, fmt::format("\"{}\": {}", file.string(), message));
}
[[noreturn]] void fail(const path& file, std::size_t line, const std::string& message) {
  throw Error(ErrorCode::input, fmt::format("\"{}\", line {}: {}", file.string(), line, message));
}

void check_size(const path& file, std::uintmax_t size) {
  if (size > longest_file) fail(file, fmt::format("{} bytes; at most {} are read", size, longest_file));
}

// Before anything is read; what is no regular file has no size, and is checked once read.
std::string read_checked(const path& file) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(file, ignored)) {
    const auto size = std::filesystem::file_size(file, ignored);
    if (!ignored) check_size(file, size);
  }
  return read_file(file);
}

constexpr std::string_view blank = " \t\f\r";

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(blank);
  return first == text.npos ? std::string_view() : text.substr(first, text.find_last_not_of(blank) - first + 1);
}

double finite_number(const path& file, std::size_t line, std::string_view what, std::string_view text) {
  double value = 0;
  if (parse_number(text, value) != NumberParse::ok || std::isnan(value))
    fail(file, line, fmt::format("{} is \"{}\", which is no number", what, excerpt(text, 0, 40)));
  if (!std::isfinite(value)) fail(file, line, fmt::format("{} is {}, out of range", what, excerpt(text, 0, 40)));
  return value;
}

// Hands out the lines of a text, without their ends (\n, \r\n or \r).
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {
    if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
  }

  bool next(std::string_view& line) {
    if (rest_.empty()) return false;
    const auto end = rest_.find_first_of("\r\n");
    line = rest_.substr(0, end);
    rest_.remove_prefix(
        std::min(end == rest_.npos ? end : end + (rest_.substr(end).starts_with("\r\n") ? 2 : 1), rest_.size()));
    number_++;
    return true;
  }
  std::size_t number() const { return number_; }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
};

// ---- Java properties

struct Property {
  std::string key, value;
  std::size_t line = 0;
};

bool ends_open(std::string_view line) {  // an odd number of backslashes: the next line continues it
  const auto last = line.find_last_not_of('\\');
  return (line.size() - (last == line.npos ? 0 : last + 1)) % 2 == 1;
}

// What the escapes of a key or value stand for; those of characters that no expression can hold become '?'.
std::string unescaped(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); i++) {
    if (text[i] != '\\' || i + 1 == text.size()) {
      out += text[i];
      continue;
    }
    const char c = text[++i];
    if (c == 'u') {
      unsigned code = 0;
      const std::string_view digits = text.substr(i + 1, 4);
      const auto parse = std::from_chars(digits.data(), digits.data() + digits.size(), code, 16);
      out += parse.ec == std::errc() && digits.size() == 4 && code < 127 && code >= 32 ? char(code) : '?';
      i += std::size_t(parse.ptr - digits.data());
    } else {
      out += c == 't' || c == 'n' || c == 'r' || c == 'f' ? ' ' : c;
    }
  }
  return out;
}

// A line that is complete: the key ends at the first =, : or blank that no backslash precedes.
Property property_in(std::string_view text, std::size_t line) {
  std::size_t end = 0;
  while (end < text.size() && text[end] != '=' && text[end] != ':' && blank.find(text[end]) == blank.npos)
    end += text[end] == '\\' ? 2 : 1;
  end = std::min(end, text.size());
  std::string_view value = text.substr(end);
  value.remove_prefix(std::min(value.find_first_not_of(blank), value.size()));
  if (!value.empty() && (value[0] == '=' || value[0] == ':')) value.remove_prefix(1);
  return {unescaped(text.substr(0, end)), unescaped(trimmed(value)), line};
}

// The next property whose key begins with `prefix`: the others are not even unescaped.
bool next_property(Lines& lines, std::string_view prefix, Property& property) {
  for (std::string_view line; lines.next(line);) {
    const std::size_t number = lines.number();
    line.remove_prefix(std::min(line.find_first_not_of(blank), line.size()));
    if (line.empty() || line[0] == '#' || line[0] == '!') continue;
    const bool wanted = line.starts_with(prefix);
    std::string whole(wanted ? line : std::string_view());
    for (bool open = ends_open(line); open;) {
      if (wanted) whole.pop_back();
      if (!lines.next(line)) break;
      line.remove_prefix(std::min(line.find_first_not_of(blank), line.size()));
      open = ends_open(line);
      if (wanted) whole += line;
    }
    if (!wanted) continue;
    property = property_in(whole, number);
    return true;
  }
  return false;
}

// ---- Tapes

struct TapeOperation {
  std::string_view name;
  int arguments;
  NodeId (*build)(Graph&, NodeId, NodeId);
};

template <Op op>
NodeId one(Graph& graph, NodeId a, NodeId) {
  return graph.unary(op, a);
}
template <Op op>
NodeId two(Graph& graph, NodeId a, NodeId b) {
  return graph.binary(op, a, b);
}

// Whether a is zero decides.
NodeId where_zero(Graph& g, NodeId a, NodeId then, NodeId otherwise) {
  return g.choose(g.unary(Op::abs, a), g.constant(0), then, otherwise);
}
NodeId rounded(Graph& g, NodeId a, NodeId) {  // halves away from zero
  const NodeId size = g.unary(Op::floor, g.add(g.unary(Op::abs, a), g.constant(0.5)));
  return g.multiply(g.unary(Op::sign, a), size);
}
NodeId ceiling(Graph& g, NodeId a, NodeId) { return g.negate(g.unary(Op::floor, g.negate(a))); }
NodeId square(Graph& g, NodeId a, NodeId) { return g.power(a, 2); }
NodeId no(Graph& g, NodeId a, NodeId) { return where_zero(g, a, g.constant(1), g.constant(0)); }
NodeId both(Graph& g, NodeId a, NodeId b) { return where_zero(g, a, a, b); }
NodeId either(Graph& g, NodeId a, NodeId b) { return where_zero(g, a, b, a); }
NodeId compared(Graph& g, NodeId a, NodeId b) { return g.unary(Op::sign, g.subtract(a, b)); }
NodeId remainder(Graph& g, NodeId a, NodeId b) { return g.binary(Op::mod, a, g.unary(Op::abs, b)); }

constexpr std::array tape_operations = {TapeOperation{"abs", 1, one<Op::abs>},
                                        TapeOperation{"neg", 1, one<Op::negate>},
                                        TapeOperation{"sqrt", 1, one<Op::sqrt>},
                                        TapeOperation{"square", 1, square},
                                        TapeOperation{"floor", 1, one<Op::floor>},
                                        TapeOperation{"ceil", 1, ceiling},
                                        TapeOperation{"round", 1, rounded},
                                        TapeOperation{"sin", 1, one<Op::sin>},
                                        TapeOperation{"cos", 1, one<Op::cos>},
                                        TapeOperation{"tan", 1, one<Op::tan>},
                                        TapeOperation{"asin", 1, one<Op::asin>},
                                        TapeOperation{"acos", 1, one<Op::acos>},
                                        TapeOperation{"atan", 1, one<Op::atan>},
                                        TapeOperation{"exp", 1, one<Op::exp>},
                                        TapeOperation{"ln", 1, one<Op::log>},
                                        TapeOperation{"not", 1, no},
                                        TapeOperation{"add", 2, two<Op::add>},
                                        TapeOperation{"sub", 2, two<Op::subtract>},
                                        TapeOperation{"mul", 2, two<Op::multiply>},
                                        TapeOperation{"div", 2, two<Op::divide>},
                                        TapeOperation{"min", 2, two<Op::min>},
                                        TapeOperation{"max", 2, two<Op::max>},
                                        TapeOperation{"atan2", 2, two<Op::atan2>},
                                        TapeOperation{"compare", 2, compared},
                                        TapeOperation{"mod", 2, remainder},
                                        TapeOperation{"and", 2, both},
                                        TapeOperation{"or", 2, either}};

class Tape {
 public:
  Tape(const path& file, Graph& graph) : file_(file), graph_(graph) {}

  NodeId read_line(std::size_t line, std::string_view text) {
    line_ = line;
    split(text);
    if (words_.size() < 2) fail_here(fmt::format("found \"{}\", expected a name and an operation", excerpt(text)));
    const auto known = defined_.find(words_[0]);
    if (known != defined_.end())
      fail_here(fmt::format("\"{}\" is defined a second time; the first was in line {}", excerpt(words_[0], 0, 40),
                            known->second.line));
    const NodeId node = operation();
    defined_.emplace(words_[0], Definition{node, line});
    return node;
  }

 private:
  struct Definition {
    NodeId node;
    std::size_t line;
  };

  // No operation has more than four words: what follows a fifth is not looked at.
  void split(std::string_view text) {
    words_.clear();
    while (words_.size() < 5) {
      text.remove_prefix(std::min(text.find_first_not_of(blank), text.size()));
      if (text.empty()) return;
      const std::size_t end = std::min(text.find_first_of(blank), text.size());
      words_.push_back(text.substr(0, end));
      text.remove_prefix(end);
    }
  }

  NodeId operation() {
    const std::string_view word = words_[1];
    for (const auto& [name, index] : {std::pair("var-x", 0), std::pair("var-y", 1), std::pair("var-z", 2)})
      if (word == name) {
        check_arguments(0, "names");
        return graph_.variable(index);
      }
    if (word == "const") {
      check_arguments(1, "number");
      return graph_.constant(finite_number(file_, line_, "the constant", words_[2]));
    }
    const auto found = std::find_if(tape_operations.begin(), tape_operations.end(),
                                    [&](const TapeOperation& operation) { return operation.name == word; });
    if (found == tape_operations.end())
      fail_here(fmt::format("\"{}\" is no operation; known are const, var-x, var-y, var-z, {}", excerpt(word, 0, 40),
                            operation_names()));
    check_arguments(std::size_t(found->arguments), found->arguments == 1 ? "name" : "names");
    return found->build(graph_, node_of(words_[2]), node_of(words_[std::size_t(found->arguments) + 1]));
  }

  void check_arguments(std::size_t expected, std::string_view of_what) const {
    const std::size_t found = words_.size() - 2;
    if (found != expected)
      fail_here(fmt::format("\"{}\" takes {} {}, found {}", words_[1], expected, of_what,
                            found > 2 ? "more than 2" : fmt::format("{}", found)));
  }

  NodeId node_of(std::string_view name) const {
    const auto found = defined_.find(name);
    if (found == defined_.end())
      fail_here(fmt::format("\"{}\" is not defined in any line above", excerpt(name, 0, 40)));
    return found->second.node;
  }

  static std::string operation_names() {
    std::string names;
    for (const TapeOperation& operation : tape_operations)
      names += (names.empty() ? "" : ", ") + std::string(operation.name);
    return names;
  }

  [[noreturn]] void fail_here(const std::string& message) const { fail(file_, line_, message); }

  const path& file_;
  Graph& graph_;
  std::size_t line_ = 0;
  std::vector<std::string_view> words_;
  std::unordered_map<std::string_view, Definition> defined_;
};

}  // namespace

ImplicitFile parse_jsurf(std::string_view text, const path& name) {
  constexpr std::string_view parameter = "surface_parameter_";
  check_size(name, text.size());
  Property equation;
  std::map<std::string, double> parameters;
  std::unordered_map<std::string, std::size_t> seen;  // key to line
  Lines lines(text);
  for (Property property; next_property(lines, "surface_", property);) {
    const bool is_parameter = property.key.starts_with(parameter);
    if (!is_parameter && property.key != "surface_equation") continue;
    const auto [earlier, is_new] = seen.emplace(property.key, property.line);
    if (!is_new)
      fail(name, property.line,
           fmt::format("\"{}\" is given a second time; the first was in line {}", excerpt(property.key),
                       earlier->second));
    if (is_parameter)
      parameters.emplace(
          property.key.substr(parameter.size()),
          finite_number(name, property.line, fmt::format("\"{}\"", excerpt(property.key)), property.value));
    else equation = std::move(property);
  }
  if (equation.line == 0) fail(name, "no line \"surface_equation=...\"; is it a .jsurf file?");

  static const std::array<std::string, 3> variables = {"x", "y", "z"};
  ImplicitFile result;
  result.title = name.stem().string();
  try {
    result.root = parse(result.graph, equation.value, variables, parameters);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::input) throw;
    fail(name, equation.line, error.what());
  }
  result.operations = reachable(result.graph, std::span(&result.root, 1)).size();
  return result;
}

ImplicitFile parse_vm(std::string_view text, const path& name) {
  check_size(name, text.size());
  ImplicitFile result;
  result.title = name.stem().string();
  bool titled = false;
  Tape tape(name, result.graph);
  Lines lines(text);
  for (std::string_view line; lines.next(line);) {
    const std::string_view content = trimmed(line);
    if (content.empty()) continue;
    if (content[0] == '#') {
      const std::string_view comment = trimmed(content.substr(1));
      if (!titled && !comment.empty()) result.title = excerpt(comment, 0, 200);
      titled = titled || !comment.empty();
      continue;
    }
    result.root = tape.read_line(lines.number(), content);
    result.operations++;
  }
  if (result.operations == 0) fail(name, "no operations; is it a .vm file?");
  return result;
}

ImplicitFile load_jsurf(const path& file) { return parse_jsurf(read_checked(file), file); }

ImplicitFile load_vm(const path& file) { return parse_vm(read_checked(file), file); }

}  // namespace smurf::expression
