// Surfaces given by expressions on a device: the expression and its derivatives become device source, in four
// arithmetics (kernels/arithmetic): intervals with and without their slope along a ray, floats with a bound on their
// rounding, with their slope along a ray, and as such. The domain is cut into cells; of those that can hold a root the
// device keeps a Taylor model.
//
// Device memory: 64 bytes for each active cell (128 where the function is made of minima or maxima in the end), and 1.3
// bytes for each cell (active_cells.hpp).
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "expression/evaluate.hpp"
#include "expression/source.hpp"
#include "kernels/implicit/layout.inc"
#include "smurf/error.hpp"
#include "surfaces/grid/active_cells.hpp"
#include "surfaces/implicit/cells.hpp"
#include "surfaces/kinds.hpp"

namespace smurf {
namespace {

using expression::function_source;
using expression::Graph;
using expression::NodeId;
using expression::Op;

// What is asked of the expression along rays (roots/taylor.inc) and at points (implicit/surface.inc).
std::string expression_source(const ImplicitFunction& function) {
  const Graph& graph = function.graph;
  const std::vector<NodeId> value{function.value};
  std::vector<NodeId> jet{function.value};
  jet.insert(jet.end(), function.gradient.begin(), function.gradient.end());
  jet.insert(jet.end(), function.hessian.begin(), function.hessian.end());
  std::string text =
      "#include \"arithmetic/interval_dual_number.inc\"\n#include \"arithmetic/interval_dual_defined.inc\"\n";
  text += function_source(graph, value,
                          "FN Span expression_span(Tape tape, IntervalDual v0, IntervalDual v1, IntervalDual v2)",
                          "  mask undefined = mask_none();\n",
                          "  Span span;\n  span.field = {0};\n  span.undefined = undefined;\n  return span;\n");
  text += "#include \"arithmetic/bounded_number.inc\"\nSTRUCT(Bounded3) { Bounded x, y, z; };\n";
  text += function_source(graph, function.gradient,
                          "FN Bounded3 expression_gradient(Tape tape, Bounded v0, Bounded v1, Bounded v2)", "",
                          "  Bounded3 g;\n  g.x = {0};\n  g.y = {1};\n  g.z = {2};\n  return g;\n");
  text += function_source(graph, value, "FN Bounded expression_point(Tape tape, Bounded v0, Bounded v1, Bounded v2)",
                          "", "  return {0};\n");
  text += "#include \"arithmetic/dual.inc\"\n";
  text += function_source(graph, value, "FN Dual expression_along(Tape tape, Dual v0, Dual v1, Dual v2)", "",
                          "  return {0};\n");
  text +=
      "#include \"common/frame.inc\"\n#include \"arithmetic/real_number.inc\"\n"
      "STRUCT(Jet) { real value; real3 gradient; Symmetric3 hessian; };\n";
  text += function_source(graph, jet, "FN Jet expression_jet(Tape tape, real v0, real v1, real v2)", "",
                          "  Jet jet;\n  jet.value = {0};\n  jet.gradient = make3({1}, {2}, {3});\n"
                          "  jet.hessian.xx = {4};\n  jet.hessian.yy = {5};\n  jet.hessian.zz = {6};\n"
                          "  jet.hessian.xy = {7};\n  jet.hessian.xz = {8};\n  jet.hessian.yz = {9};\n  return jet;\n");
  return text;
}

// The creases of a function: where minima, maxima, choices and absolute values turn from one argument to the other.
// Each is where a difference vanishes, which can be bounded over a cell much more closely than by comparing bounds of
// both arguments.
class Creases {
 public:
  Creases(Graph& graph, NodeId value) : zero_(graph.constant(0)) {
    const std::vector<NodeId> roots{value};
    for (const NodeId id : expression::reachable(graph, roots)) {
      const expression::Node node = graph[id];
      if (node.op == Op::abs) add(node.arguments[0], none, node.arguments[0]);
      if (node.op == Op::min || node.op == Op::max || node.op == Op::choose) {
        const auto [a, b] = std::pair(node.arguments[0], node.arguments[1]);
        add(a, b, graph.subtract(a, b));
      }
    }
    if (differences_.size() > most) {
      differences_.clear();
      places_.clear();
    }
    find_sides(graph, value);
    for (std::size_t i = 0, count = differences_.size(); i < count; i++) {
      for (int axis = 0; axis < 3; axis++) slopes_.push_back(expression::derivative(graph, differences_[i], axis));
    }
  }

  std::size_t count() const { return differences_.size(); }
  // Each difference and its derivatives by x, y, z.
  std::vector<NodeId> roots() const {
    std::vector<NodeId> all;
    for (std::size_t i = 0; i < count(); i++) {
      all.push_back(differences_[i]);
      all.insert(all.end(), slopes_.begin() + std::ptrdiff_t(3 * i), slopes_.begin() + std::ptrdiff_t(3 * i + 3));
    }
    return all;
  }
  // What the function is of its two sides at each crease: the greater (1), the lesser (-1), or neither (0).
  const std::vector<int>& sides() const { return sides_; }
  // The sign of the difference that an operation turns on, as text; empty if it turns on none.
  std::string decision(const expression::Node& node) const {
    const auto [place, sign] = turning(node);
    return sign == 0 ? std::string() : fmt::format("{}by.at[{}]", sign < 0 ? "-" : "", place);
  }

 private:
  // The difference that an operation turns on, and 1, -1 for its negative, or 0 if it turns on none.
  std::pair<std::size_t, int> turning(const expression::Node& node) const {
    const auto find = [&](NodeId a, NodeId b, int sign) {
      const auto found = places_.find({a, b});
      return found == places_.end() ? std::pair(std::size_t(0), 0) : std::pair(found->second, sign);
    };
    const NodeId a = node.arguments[0], b = node.arguments[1];
    switch (node.op) {
      case Op::abs:
      case Op::sign:
        return find(a, none, 1);
      case Op::min:
      case Op::max:
      case Op::choose: {
        if (a == zero_ && places_.contains({b, none})) return find(b, none, -1);  // the slope of |b|
        const auto forward = find(a, b, 1);
        return forward.second == 0 ? find(b, a, -1) : forward;
      }
      default:
        return {0, 0};
    }
  }

  // Where a function does not fall when a maximum in it rises, it is the maximum of what it is with either argument in
  // its place; so for minima, and for |a|, the maximum of a and -a. Several maxima that turn on one difference turn
  // together.
  void find_sides(const Graph& graph, NodeId value) {
    const auto rises_with = [&](const expression::Node& node, int argument) {
      switch (node.op) {
        case Op::min:
        case Op::max:
          return true;
        case Op::add:
          return graph.is_constant(node.arguments[std::size_t(1 - argument)]);
        case Op::subtract:
          return argument == 0 && graph.is_constant(node.arguments[1]);
        default:
          return false;
      }
    };
    const std::vector<NodeId> roots{value};
    const std::vector<NodeId> nodes = expression::reachable(graph, roots);
    std::set<NodeId> otherwise;  // of what the function is no rising function
    constexpr int unseen = 2;
    sides_.assign(differences_.size(), unseen);
    for (auto id = nodes.rbegin(); id != nodes.rend(); ++id) {
      const expression::Node& node = graph[*id];
      const bool rising = !otherwise.contains(*id);
      for (int i = 0; i < expression::arity(node.op); i++) {
        if (!rising || !rises_with(node, i)) otherwise.insert(node.arguments[std::size_t(i)]);
      }
      const auto [place, sign] = turning(node);
      if (sign == 0) continue;
      int side = 0;
      if (rising && node.op == Op::min) side = -1;
      if (rising && (node.op == Op::max || node.op == Op::abs)) side = 1;
      sides_[place] = sides_[place] == unseen || sides_[place] == side ? side : 0;
    }
    for (int& side : sides_) side = side == unseen ? 0 : side;
    // Of two differences that are each other's negative it is not certain which one a derivative turns on.
    for (const auto& [pair, place] : places_) {
      if (places_.contains({pair.second, pair.first})) sides_[place] = 0;
    }
  }

  static constexpr NodeId none = std::numeric_limits<NodeId>::max();
  static constexpr std::size_t most = 16;

  void add(NodeId a, NodeId b, NodeId difference) {
    if (!places_.emplace(std::pair(a, b), differences_.size()).second) return;
    differences_.push_back(difference);
  }

  const NodeId zero_;
  std::vector<NodeId> differences_, slopes_;
  std::vector<int> sides_;
  std::map<std::pair<NodeId, NodeId>, std::size_t> places_;
};

// What is asked of it in cells (implicit/cells.inc).
std::string box_source(const Graph& graph, const ImplicitFunction& function, const Creases& creases) {
  const std::vector<NodeId> value{function.value};
  std::vector<NodeId> jet{function.value};
  jet.insert(jet.end(), function.gradient.begin(), function.gradient.end());
  jet.insert(jet.end(), function.hessian.begin(), function.hessian.end());
  std::string text = "#include \"arithmetic/interval_defined.inc\"\n";
  text += function_source(graph, value, "FN_SHARED Reach expression_reach(Interval v0, Interval v1, Interval v2)",
                          "  mask undefined = mask_none();\n",
                          "  Reach reach;\n  reach.field = {0};\n  reach.undefined = undefined;\n  return reach;\n");
  text += "#include \"arithmetic/interval_smooth.inc\"\n";
  text += "FN float crease_sides(int crease) {\n  float sides = 0.0f;\n";
  for (std::size_t i = 0; i < creases.count(); i++)
    text += fmt::format("  if (crease == {}) sides = {}.0f;\n", i, creases.sides()[i]);
  text += "  return sides;\n}\n";
  std::string assignments = "  Differences differences;\n  differences.smooth_here = smooth_here;\n";
  if (creases.count() == 0)
    assignments += "  UNROLL for (int i = 0; i < 4; i++) differences.at[i] = interval_whole(mask_none());\n";
  for (std::size_t i = 0; i < 4 * creases.count(); i++)
    assignments += fmt::format("  differences.at[{0}] = {{{0}}};\n", i);
  text += function_source(
      graph, creases.roots(), "FN_SHARED Differences expression_differences(Interval v0, Interval v1, Interval v2)",
      "  mask smooth_here = mask_all(), undefined = mask_none();\n", assignments + "  return differences;\n");
  text +=
      function_source(graph, jet, "FN_SHARED Box expression_box(Interval v0, Interval v1, Interval v2, Decisions by)",
                      "  mask smooth_here = mask_all(), undefined = mask_none();\n",
                      "  Box box;\n  box.value = {0};\n  box.x = {1};\n  box.y = {2};\n  box.z = {3};\n"
                      "  box.xx = {4};\n  box.yy = {5};\n  box.zz = {6};\n  box.xy = {7};\n  box.xz = {8};\n"
                      "  box.yz = {9};\n  box.smooth_here = smooth_here;\n  return box;\n",
                      [&](const expression::Node& node) { return creases.decision(node); });
  return text;
}

// Cells along the longest side of the domain, at most.
constexpr int most_cells = 192;

class ResidentImplicit final : public ResidentSurface {
 public:
  ResidentImplicit(const ImplicitSurface& surface, Executor& executor)
      : domain_(surface.domain), grid_(domain_, most_cells), function_(surface.function) {
    modules_["surface"] = kernel_source("implicit/surface.inc");
    modules_["walk"] = kernel_source("walk/section.inc");
    modules_["section"] = kernel_source("implicit/section.inc");
    modules_["expression"] = expression_source(*function_);
    Graph with_differences = function_->graph;
    const Creases creases(with_differences, function_->value);
    modules_["box"] = box_source(with_differences, *function_, creases);
    defines_["CREASES"] = fmt::format("{}", creases.count());
    defines_["SIDES"] = std::ranges::any_of(creases.sides(), [](int side) { return side != 0; }) ? "2" : "1";
    modules_["cells"] = kernel_source("implicit/cells.inc");
    modules_["models"] = modules_["cells"];
    // Whether derivatives have sides (arithmetic/bounded.inc).
    const auto has_sides = [&](NodeId id) {
      const Op op = function_->graph[id].op;
      return op == Op::choose || op == Op::sign;
    };
    defines_["CHOICES"] =
        std::ranges::any_of(expression::reachable(function_->graph, function_->gradient), has_sides) ? "1" : "0";
    defines_["PADDED"] = "0";
    ActiveCells::define_traversal(defines_, grid_.cells, true);
    uniforms_ = TypedBuffer<std::uint32_t>(executor, IMPLICIT_UNIFORM_WORDS, "surface uniforms");
    write_uniforms(surface);
    cells_ = std::make_unique<ImplicitCells>(executor, grid_, modules_, defines_, *uniforms_.get());
    cells_->make(cells_->find(), {}, nullptr);
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override { return cells_->buffers(nullptr); }
  std::size_t bytes() const override { return uniforms_.bytes() + cells_->bytes(); }

  bool update(const SurfaceDefinition& model) override {
    const auto* other = dynamic_cast<const ImplicitSurface*>(&model);
    if (!other || other->function != function_ || !(other->domain == domain_)) return false;
    write_uniforms(*other);
    cells_->make(cells_->find(), {}, nullptr);
    return true;
  }

 private:
  void write_uniforms(const ImplicitSurface& surface) { uniforms_.write(uniform_words(surface, grid_)); }

  const Domain domain_;
  const CellGrid grid_;
  std::shared_ptr<const ImplicitFunction> function_;
  std::map<std::string, std::string> modules_, defines_;
  TypedBuffer<std::uint32_t> uniforms_;
  std::unique_ptr<ImplicitCells> cells_;
};

}  // namespace

std::unique_ptr<ResidentSurface> reside_implicit(const SurfaceDefinition& definition, Executor& executor,
                                                 const PrepareOptions&) {
  const auto& surface = dynamic_cast<const ImplicitSurface&>(definition);
  if (is_interpreted(*surface.function)) return reside_as_tape(surface, executor);
  return std::make_unique<ResidentImplicit>(surface, executor);
}

}  // namespace smurf
