// Operator precedence with two explicit stacks: no depth of nesting can exhaust the program's own stack.
#include "expression/parser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <unordered_map>
#include <vector>

#include "smurf/error.hpp"

namespace smurf::expression {
namespace {

struct Function {
  std::string_view name;
  Op op;
  int arguments;
  bool or_more = false;
};

constexpr std::array functions = {
    Function{"sin", Op::sin, 1},       Function{"cos", Op::cos, 1},     Function{"tan", Op::tan, 1},
    Function{"asin", Op::asin, 1},     Function{"acos", Op::acos, 1},   Function{"atan", Op::atan, 1},
    Function{"atan2", Op::atan2, 2},   Function{"sinh", Op::sinh, 1},   Function{"cosh", Op::cosh, 1},
    Function{"tanh", Op::tanh, 1},     Function{"exp", Op::exp, 1},     Function{"log", Op::log, 1},
    Function{"sqrt", Op::sqrt, 1},     Function{"abs", Op::abs, 1},     Function{"min", Op::min, 2, true},
    Function{"max", Op::max, 2, true}, Function{"floor", Op::floor, 1}, Function{"mod", Op::mod, 2},
    Function{"pow", Op::pow, 2}};

const Function* find_function(std::string_view name) {
  const auto found =
      std::find_if(functions.begin(), functions.end(), [&](const Function& f) { return f.name == name; });
  return found == functions.end() ? nullptr : &*found;
}

std::optional<double> find_number(std::string_view name) {
  if (name == "pi") return std::numbers::pi;
  if (name == "e") return std::numbers::e;
  return std::nullopt;
}

// Without regard to the locale.
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool begins_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool continues_name(char c) { return begins_name(c) || is_digit(c); }
bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
bool continues_character(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

// The bytes of the UTF-8 character at the front; 0 when it is none.
std::size_t character_length(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  const std::size_t length = first < 0x80   ? 1
                             : first < 0xC2 ? 0
                             : first < 0xE0 ? 2
                             : first < 0xF0 ? 3
                             : first < 0xF5 ? 4
                                            : 0;
  if (length > text.size()) return 0;
  for (std::size_t i = 1; i < length; i++)
    if (!continues_character(text[i])) return 0;
  // Overlong forms, halves of surrogate pairs, and what is beyond Unicode.
  const auto second = length > 1 ? static_cast<unsigned char>(text[1]) : 0;
  if ((first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) || (first == 0xF0 && second < 0x90) ||
      (first == 0xF4 && second > 0x8F))
    return 0;
  return length;
}

std::string printable(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    const auto first = static_cast<unsigned char>(text[0]);
    // U+0080 to U+009F are control characters, too.
    const bool control =
        first < 32 || first == 127 || (length == 2 && first == 0xC2 && static_cast<unsigned char>(text[1]) < 0xA0);
    if (is_space(text[0])) out += ' ';
    else if (length == 0 || control) out += '?';
    else out += text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

class Parser {
 public:
  Parser(Graph& graph, std::string_view text, std::span<const std::string> variables,
         const std::map<std::string, double>& parameters)
      : graph_(graph), text_(text), variables_(variables), parameters_(parameters) {
    for (std::size_t i = 0; i < variables.size(); i++) names_.emplace(variables[i], graph.variable(int(i)));
    for (const auto& [name, value] : parameters) add_parameter(name, value);
  }

  NodeId parse() {
    while (true) {
      const Token token = next();
      if (!after_operand_ ? operand(token) : continuation(token)) return operands_.back();
    }
  }

 private:
  enum class Kind { number, name, symbol, end };
  struct Token {
    Kind kind;
    std::size_t begin;
    std::string_view text;
    double number = 0;
  };

  // What waits for its right operand or its closing parenthesis.
  struct Pending {
    enum { sign, operation, group } kind;
    Op op = Op::add;
    int precedence = 0;
    std::size_t begin = 0;
    const Function* function = nullptr;  // of a group
    int arguments = 1;                   // so far
  };

  static constexpr int sum_precedence = 1, product_precedence = 2, sign_precedence = 3, power_precedence = 4;

  void add_parameter(const std::string& name, double value) {
    const auto fail = [&](std::string_view reason) {
      throw Error(ErrorCode::input, fmt::format("parameter \"{}\" {}", excerpt(name), reason));
    };
    if (name.empty() || !begins_name(name[0]) || !std::all_of(name.begin(), name.end(), continues_name))
      fail("is no name: a letter, then letters, digits and _");
    if (find_number(name)) fail("hides the number of that name; choose another name");
    if (find_function(name)) fail("hides the function of that name; choose another name");
    if (names_.contains(name)) fail("hides the variable of that name; choose another name");
    if (!std::isfinite(value)) fail("is not finite");
    names_.emplace(name, graph_.constant(value));
  }

  // ---- Tokens

  Token next() {
    while (position_ < text_.size() && is_space(text_[position_])) position_++;
    const std::size_t begin = position_;
    if (begin == text_.size()) return {Kind::end, begin, {}};
    const char c = text_[begin];
    if (begins_name(c)) {
      while (position_ < text_.size() && continues_name(text_[position_])) position_++;
      return {Kind::name, begin, text_.substr(begin, position_ - begin)};
    }
    if (is_digit(c) || (c == '.' && begin + 1 < text_.size() && is_digit(text_[begin + 1]))) return number();
    position_ += std::max<std::size_t>(character_length(text_.substr(begin)), 1);
    return {Kind::symbol, begin, text_.substr(begin, position_ - begin)};
  }

  Token number() {
    const std::size_t begin = position_;
    const auto skip_digits = [&](std::size_t at) {
      while (at < text_.size() && is_digit(text_[at])) at++;
      return at;
    };
    position_ = skip_digits(position_);
    if (position_ < text_.size() && text_[position_] == '.') position_ = skip_digits(position_ + 1);
    // An e that no digits follow begins a name.
    if (position_ < text_.size() && (text_[position_] == 'e' || text_[position_] == 'E')) {
      std::size_t digits = position_ + 1;
      if (digits < text_.size() && (text_[digits] == '+' || text_[digits] == '-')) digits++;
      if (digits < text_.size() && is_digit(text_[digits])) position_ = skip_digits(digits);
    }
    Token token{Kind::number, begin, text_.substr(begin, position_ - begin)};
    const auto result = std::from_chars(text_.data() + begin, text_.data() + position_, token.number);
    if (result.ec != std::errc() || !std::isfinite(token.number))
      fail(begin, fmt::format("the number {} is out of range; magnitudes from {:.3g} to {:.3g} are in it",
                              excerpt(token.text, 0, 40), std::numeric_limits<double>::denorm_min(),
                              std::numeric_limits<double>::max()));
    return token;
  }

  // ---- The two states; true when the expression is complete

  bool operand(const Token& token) {
    if (token.kind == Kind::number) return push(graph_.constant(token.number));
    if (token.kind == Kind::name) return named(token);
    if (token.text == "+") return false;
    if (token.text == "-") {
      pending_.push_back({Pending::sign, Op::negate, sign_precedence, token.begin});
      return false;
    }
    if (token.text == "(") return open(token, nullptr);
    unexpected(token, "a number, a name or \"(\"");
  }

  bool named(const Token& token) {
    if (const Function* function = find_function(token.text)) {
      const Token opening = next();
      if (opening.text != "(") unexpected(opening, fmt::format("\"(\" after \"{}\"", function->name));
      return open(token, function);
    }
    if (const auto number = find_number(token.text)) return push(graph_.constant(*number));
    const auto found = names_.find(token.text);
    if (found == names_.end()) unexpected(token, known_names());
    return push(found->second);
  }

  bool continuation(const Token& token) {
    if (token.kind == Kind::end) {
      reduce(0);
      if (!pending_.empty()) unexpected(token, what_continues());
      return true;
    }
    if (token.text == ")" || token.text == ",") {
      reduce(0);
      if (pending_.empty() || (token.text == "," && !pending_.back().function)) unexpected(token, what_continues());
      if (token.text == ")") return close();
      pending_.back().arguments++;
      after_operand_ = false;
      return false;
    }
    if (token.kind == Kind::symbol && token.text.size() == 1) switch (token.text[0]) {
        case '+':
          return operation(token, Op::add, sum_precedence);
        case '-':
          return operation(token, Op::subtract, sum_precedence);
        case '*':
          return operation(token, Op::multiply, product_precedence);
        case '/':
          return operation(token, Op::divide, product_precedence);
        case '^':
          return operation(token, Op::pow, power_precedence);
        default:
          break;
      }
    reduce(0);
    unexpected(token, what_continues());
  }

  bool push(NodeId id) {
    operands_.push_back(id);
    after_operand_ = true;
    return false;
  }

  bool open(const Token& token, const Function* function) {
    if (++depth_ > deepest_nesting) fail(token.begin, fmt::format("nested more than {} levels deep", deepest_nesting));
    pending_.push_back({Pending::group, Op::add, 0, token.begin, function});
    return false;
  }

  bool close() {
    const Pending group = pending_.back();
    pending_.pop_back();
    depth_--;
    if (!group.function) return false;
    const Function& f = *group.function;
    if (group.arguments < f.arguments || (group.arguments > f.arguments && !f.or_more))
      fail(group.begin, fmt::format("\"{}\" takes {} argument{}{}, found {}", f.name, f.arguments,
                                    f.arguments == 1 ? "" : "s", f.or_more ? " or more" : "", group.arguments));
    const std::size_t first = operands_.size() - std::size_t(group.arguments);
    NodeId result = operands_[first];
    if (f.arguments == 1) result = graph_.unary(f.op, result);
    for (std::size_t i = first + 1; i < operands_.size(); i++) result = graph_.binary(f.op, result, operands_[i]);
    operands_.resize(first);
    return push(result);
  }

  bool operation(const Token& token, Op op, int precedence) {
    reduce(op == Op::pow ? precedence + 1 : precedence);
    pending_.push_back({Pending::operation, op, precedence, token.begin});
    after_operand_ = false;
    return false;
  }

  // Applies what waits and binds at least as tightly, back to the innermost open parenthesis.
  void reduce(int precedence) {
    while (!pending_.empty() && pending_.back().kind != Pending::group && pending_.back().precedence >= precedence) {
      const Pending top = pending_.back();
      pending_.pop_back();
      const NodeId right = operands_.back();
      if (top.kind == Pending::sign) {
        operands_.back() = graph_.negate(right);
      } else {
        operands_.pop_back();
        operands_.back() = graph_.binary(top.op, operands_.back(), right);
      }
    }
  }

  // ---- Messages

  std::string what_continues() const {
    if (pending_.empty()) return "an operator or the end";
    return pending_.back().function ? "an operator, \",\" or \")\"" : "an operator or \")\"";
  }

  std::string known_names() const {
    constexpr std::size_t most = 20;
    std::vector<std::string> known;
    for (const std::string& variable : variables_) known.push_back(excerpt(variable, 0, 20));
    for (const auto& [name, value] : parameters_) {
      if (known.size() >= most) break;
      known.push_back(excerpt(name, 0, 20));
    }
    if (parameters_.size() + variables_.size() > known.size()) known.push_back("...");
    known.insert(known.end(), {"pi", "e"});
    return fmt::format("one of {} or a function such as sin", fmt::join(known, ", "));
  }

  [[noreturn]] void unexpected(const Token& token, const std::string& expected) const {
    const std::string found = token.kind == Kind::end ? "the end" : fmt::format("\"{}\"", excerpt(token.text, 0, 40));
    fail(token.begin, fmt::format("found {}, expected {}", found, expected));
  }

  [[noreturn]] void fail(std::size_t at, const std::string& message) const {
    const auto before = text_.substr(0, at);
    const auto column = at + 1 - std::size_t(std::count_if(before.begin(), before.end(), continues_character));
    throw Error(ErrorCode::input, fmt::format("expression \"{}\", column {}: {}", excerpt(text_, at), column, message));
  }

  Graph& graph_;
  const std::string_view text_;
  const std::span<const std::string> variables_;
  const std::map<std::string, double>& parameters_;
  std::unordered_map<std::string_view, NodeId> names_;
  std::vector<NodeId> operands_;
  std::vector<Pending> pending_;
  std::size_t position_ = 0;
  int depth_ = 0;
  bool after_operand_ = false;
};

}  // namespace

std::string excerpt(std::string_view text, std::size_t position, std::size_t most) {
  if (text.size() <= most) return printable(text);
  std::size_t begin = position < most / 2 ? 0 : std::min(position - most / 2, text.size() - most);
  std::size_t end = begin + most;
  while (begin > 0 && begin < position && continues_character(text[begin])) begin++;
  while (end < text.size() && end > begin && continues_character(text[end])) end--;
  return (begin > 0 ? "..." : "") + printable(text.substr(begin, end - begin)) + (end < text.size() ? "..." : "");
}

NodeId parse(Graph& graph, std::string_view text, std::span<const std::string> variables,
             const std::map<std::string, double>& parameters) {
  if (text.size() > longest_text)
    throw Error(ErrorCode::input, fmt::format("expression \"{}\" is {} bytes long; at most {} are read", excerpt(text),
                                              text.size(), longest_text));
  return Parser(graph, text, variables, parameters).parse();
}

}  // namespace smurf::expression
