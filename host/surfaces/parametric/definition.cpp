#include "surfaces/parametric/definition.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include "expression/evaluate.hpp"
#include "expression/parser.hpp"
#include "patches/bezier_source.hpp"
#include "patches/expression_source.hpp"
#include "patches/leaves.hpp"
#include "patches/ray_roots.hpp"
#include "smurf/error.hpp"
#include "surfaces/parametric/examine.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr std::array<const char*, 2> names = {"u", "v"};
constexpr double closing = 1e-6;  // of the extent, between ends that are taken for the same

bool is_finite(const dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

double extent_of(const Bounds& bounds) {
  const dvec3 size = bounds.upper - bounds.lower;
  return std::max({size.x, size.y, size.z});
}

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::input, message); }

using Position = std::function<dvec3(double u, double v)>;

// ---- Before there are pieces

void require_ranges(const ParametricExpressions& given) {
  for (int i = 0; i < 2; i++) {
    const double lower = given.lower[i], upper = given.upper[i];
    const char* name = names[std::size_t(i)];
    if (!std::isfinite(lower) || !std::isfinite(upper) || !(lower < upper))
      fail(fmt::format("{}: the range must be two finite numbers, the lesser first, not [{}, {}]", name, lower, upper));
    // Parameters of hits are floats.
    if (!std::isfinite(float(lower)) || !std::isfinite(float(upper)) || !(float(lower) < float(upper)))
      fail(fmt::format("{}: in floats nothing is left of the range [{}, {}]", name, lower, upper));
  }
}

Position position_of(const ParametricExpressions& given) {
  static const std::vector<std::string> variables{"u", "v"};
  expression::Graph graph;
  std::vector<expression::NodeId> roots;
  for (std::size_t k = 0; k < 3; k++) {
    try {
      roots.push_back(expression::parse(graph, given.position[k], variables, given.parameters));
    } catch (const Error& error) {
      throw Error(error.code(), fmt::format("position[{}]: {}", k, error.what()));
    }
  }
  return [evaluator = expression::Evaluator(graph, roots)](double u, double v) {
    const std::array<double, 2> at{u, v};
    dvec3 p;
    std::vector<double> scratch;
    evaluator(std::span(at), std::span(&p.x, 3), scratch);
    return p;
  };
}

void require_defined(const ParametricExpressions& given, const Position& position) {
  constexpr int count = 64;
  std::array<bool, 3> defined{};
  bool together = false;
  for (int j = 0; j < count; j++) {
    for (int i = 0; i < count; i++) {
      const dvec2 at = given.lower + dvec2(i + 0.51, j + 0.47) / double(count) * (given.upper - given.lower);
      const dvec3 p = position(at.x, at.y);
      for (std::size_t k = 0; k < 3; k++) defined[k] = defined[k] || std::isfinite(p[int(k)]);
      together = together || is_finite(p);
    }
  }
  for (std::size_t k = 0; k < 3; k++) {
    if (!defined[k])
      fail(fmt::format("position[{}]: \"{}\" is undefined in all of the range", k,
                       expression::excerpt(given.position[k])));
  }
  if (!together) fail("position: there is no place in the range where all three are defined");
}

// ---- What the pieces make up

std::string collapsed_to(Extension extension) {
  return extension == Extension::point ? "collapses to a point; a surface needs two independent directions"
                                       : "collapses to a curve; a surface needs two independent directions";
}

// At least one of the pieces [begin, end) has an area.
void require_area(const PieceSource& source, std::size_t begin, std::size_t end, double extent,
                  const std::string& what) {
  Extension greatest = Extension::nowhere;
  for (std::size_t i = begin; i < end && greatest != Extension::surface; i++)
    greatest = std::max(greatest, extension_of(source, i, extent));
  if (greatest == Extension::point || greatest == Extension::curve)
    fail(fmt::format("{} {}", what, collapsed_to(greatest)));
}

// ---- Facts

std::string count_text(std::size_t count, std::string_view one, std::string_view many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

// By how much the ends of a direction differ at most; turned: where one end is run through the other way.
struct Ends {
  double gap = 0;
  bool turned = false;
};

Ends ends_of(const ParametricExpressions& given, const Position& position, int direction) {
  constexpr int count = 256;
  double straight = 0, turned = 0;
  for (int i = 0; i <= count; i++) {
    const auto at_end = [&](bool upper, double along) {
      dvec2 at = given.lower + along * (given.upper - given.lower);
      at[direction] = upper ? given.upper[direction] : given.lower[direction];
      return position(at.x, at.y);
    };
    const double along = double(i) / count;
    const dvec3 first = at_end(false, along), second = at_end(true, along), opposite = at_end(true, 1 - along);
    // Where both are undefined they do not differ.
    if (is_finite(first) || is_finite(second)) straight = std::max(straight, glm::distance(first, second));
    if (is_finite(first) || is_finite(opposite)) turned = std::max(turned, glm::distance(first, opposite));
    if (std::isnan(glm::distance(first, second)) && (is_finite(first) || is_finite(second))) straight = INFINITY;
    if (std::isnan(glm::distance(first, opposite)) && (is_finite(first) || is_finite(opposite))) turned = INFINITY;
  }
  return straight <= turned ? Ends{straight, false} : Ends{turned, true};
}

std::string closed_text(const ParametricExpressions& given, int direction, double extent) {
  const Ends ends = ends_of(given, position_of(given), direction);
  const bool said = given.closed[std::size_t(direction)];
  if (!said && !(ends.gap <= closing * extent)) return "no";
  std::string text = ends.turned ? "yes, turned over" : "yes";
  if (said) text += ", as it is said to be";
  return fmt::format("{}; its ends differ by {:.3g} at most", text, ends.gap);
}

std::string poles_text(const PatchTopology& topology) {
  constexpr std::size_t most_shown = 4;
  if (topology.poles.empty()) return "none";
  std::string text = fmt::format("{}", topology.poles.size());
  for (std::size_t i = 0; i < std::min(topology.poles.size(), most_shown); i++) {
    // Rounding is not worth telling.
    dvec3 p = topology.poles[i].position;
    for (int k = 0; k < 3; k++) {
      if (std::abs(p[k]) < 1e-12 * (std::abs(p.x) + std::abs(p.y) + std::abs(p.z))) p[k] = 0;
    }
    text += fmt::format("{} ({:g}, {:g}, {:g})", i == 0 ? ": at" : ",", p.x, p.y, p.z);
  }
  if (topology.poles.size() > most_shown) text += ", ...";
  return text;
}

std::string edges_text(const PatchTopology& topology) {
  std::string text = fmt::format("{} shared, ", topology.edges);
  text += topology.open_sides == 0 ? std::string("no open side")
                                   : count_text(topology.open_sides, "open side", "open sides");
  if (topology.edges > 0) text += fmt::format(", greatest gap {:.3g}", topology.greatest_gap);
  return text;
}

bool is_rational(const Patch& patch) {
  return std::ranges::any_of(patch.points, [&](const glm::dvec4& p) { return p.w != patch.points[0].w; });
}

std::string degrees_text(const std::vector<Patch>& patches) {
  constexpr std::size_t most_shown = 4;
  std::set<std::array<int, 2>> all;
  for (const Patch& patch : patches) all.insert(patch.degree);
  std::vector<std::string> shown;
  for (const auto& degree : all) {
    shown.push_back(shown.size() < most_shown ? fmt::format("{} x {}", degree[0], degree[1]) : "...");
    if (shown.size() > most_shown) break;
  }
  return fmt::format("{}", fmt::join(shown, ", "));
}

std::string rational_text(const std::vector<Patch>& patches) {
  const auto count = std::size_t(std::ranges::count_if(patches, is_rational));
  if (count == 0) return "no";
  return count == patches.size() ? "yes" : fmt::format("{} of {} patches", count, patches.size());
}

}  // namespace

struct ParametricSurface::Roots {
  std::once_flag made{};
  std::optional<RayRoots> rays{};
};

ParametricSurface::ParametricSurface(ParametricExpressions given)
    : SurfaceDefinition(SurfaceKind::parametric), expressions(std::move(given)), roots_(std::make_shared<Roots>()) {
  require_ranges(expressions);
  require_defined(expressions, position_of(expressions));
  pieces_ = std::make_shared<const ExpressionSource>(
      expressions.position, ParameterBox{expressions.lower, expressions.upper}, expressions.parameters);
  try {
    bounds_ = bounds_of(*pieces_);
    require_area(*pieces_, 0, pieces_->size(), extent_of(bounds_), "the surface");
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("position: {}", error.what()));
  }
  topology_ = join_pieces(*pieces_, extent_of(bounds_), expressions.closed);
}

ParametricSurface::ParametricSurface(std::vector<Patch> given)
    : SurfaceDefinition(SurfaceKind::parametric), patches(std::move(given)), roots_(std::make_shared<Roots>()) {
  if (patches.empty()) fail("a NURBS surface needs one patch at least");
  for (std::size_t i = 0; i < patches.size(); i++) {
    const std::string what = fmt::format("patch {}", i);
    require_valid(patches[i], what);
    for (const BezierPiece& piece : bezier_pieces(patches[i], std::uint32_t(i))) require_weights(piece, what);
  }
  const auto source = std::make_shared<const BezierSource>(patches);
  pieces_ = source;
  bounds_ = bounds_of(*source);
  const double extent = extent_of(bounds_);
  for (std::size_t begin = 0, end = 0; begin < source->size(); begin = end) {
    const std::uint32_t patch = source->pieces()[begin].patch;
    while (end < source->size() && source->pieces()[end].patch == patch) end++;
    require_area(*source, begin, end, extent, fmt::format("patch {}", patch));
  }
  topology_ = join_pieces(*pieces_, extent, {});
}

RootResolver ParametricSurface::root_resolver() const {
  return [this](const Ray& ray, double low, double high, std::vector<ResolvedRoot>& resolved) {
    std::call_once(roots_->made, [this] {
      const double extent = extent_of(bounds_);
      roots_->rays.emplace(*pieces_, topology_, make_leaves(*pieces_, topology_, extent), extent);
    });
    const auto* bezier = patches.empty() ? nullptr : dynamic_cast<const BezierSource*>(pieces_.get());
    std::vector<PatchRoot> found;
    roots_->rays->find(dvec3(ray.origin), dvec3(ray.direction), low, high, found);
    for (const PatchRoot& root : found) {
      SurfaceCoordinates at{0, float(root.u), float(root.v)};
      if (bezier) {
        const BezierPiece& piece = bezier->pieces()[root.piece];
        const dvec2 place = piece.lower + dvec2(root.u, root.v) * (piece.upper - piece.lower);
        at = {piece.patch, float(place.x), float(place.y)};
      }
      resolved.push_back({root.root, at, HitStatus::isolated});
    }
  };
}

std::uint32_t ParametricSurface::properties() const {
  return Property::parameters | Property::location | Property::normal | Property::gauss | Property::mean |
         Property::principal | Property::directions | Property::normal_curvature | Property::distance;
}

std::vector<Fact> ParametricSurface::facts() const {
  if (!patches.empty()) {
    return {{"patches", fmt::format("{}", patches.size())},
            {"Bezier pieces", fmt::format("{}", pieces_->size())},
            {"degrees", degrees_text(patches)},
            {"rational", rational_text(patches)},
            {"edges", edges_text(topology_)},
            {"poles", poles_text(topology_)}};
  }
  std::vector<Fact> facts;
  for (std::size_t k = 0; k < 3; k++)
    facts.push_back({std::string(1, "xyz"[k]), expression::excerpt(expressions.position[k], 0, 200)});
  for (int i = 0; i < 2; i++)
    facts.push_back({names[std::size_t(i)], fmt::format("{} to {}", expressions.lower[i], expressions.upper[i])});
  for (int i = 0; i < 2; i++)
    facts.push_back(
        {fmt::format("closed in {}", names[std::size_t(i)]), closed_text(expressions, i, extent_of(bounds_))});
  facts.push_back({"edges", edges_text(topology_)});
  facts.push_back({"poles", poles_text(topology_)});
  return facts;
}

}  // namespace smurf
