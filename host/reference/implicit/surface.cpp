// Surfaces given by expressions, answered by the reference.
#include "surfaces/implicit/definition.hpp"
#include "surfaces/kinds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "expression/evaluate.hpp"
#include "reference/implicit/creases.hpp"
#include "reference/implicit/function_on_ray.hpp"
#include "reference/implicit/roots.hpp"
#include "reference/surface.hpp"
#include "reference/walk/level_set.hpp"

namespace smurf {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
// Curvatures that differ by less than this part of the domain's inverse diagonal are those of a plane.
constexpr double flat = 1e-9;
// Sides of a crease whose gradients differ by less than this part of the largest component look like a smooth bend.
constexpr double crease = 1e-3;

// Value, gradient and Hessian in one pass.
class JetEvaluator {
 public:
  explicit JetEvaluator(const ImplicitFunction& f) : evaluator_(f.graph, roots_of(f)) {
    bytes_ = expression::reachable(f.graph, roots_of(f)).size() * sizeof(expression::Node);
  }
  // Value, x, y, z, xx, yy, zz, xy, xz, yz
  std::array<double, 10> operator()(const glm::dvec3& point) const {
    thread_local std::vector<double> scratch;
    std::array<double, 10> results{};
    evaluator_(std::span(&point.x, 3), results, scratch);
    return results;
  }
  std::size_t bytes() const { return bytes_; }

 private:
  static std::array<expression::NodeId, 10> roots_of(const ImplicitFunction& f) {
    std::array<expression::NodeId, 10> roots{f.value};
    std::copy(f.gradient.begin(), f.gradient.end(), roots.begin() + 1);
    std::copy(f.hessian.begin(), f.hessian.end(), roots.begin() + 4);
    return roots;
  }

  expression::Evaluator evaluator_;
  std::size_t bytes_;
};

class ImplicitReference : public ReferenceSurface {
 public:
  ImplicitReference(FunctionRoots roots, std::shared_ptr<const JetEvaluator> jets,
                    std::shared_ptr<const SidesOfGradient> sides, ImplicitSurface::Side side)
      : roots_(std::move(roots)), jets_(std::move(jets)), sides_(std::move(sides)), side_(side) {}

  void roots(const ReferenceRay& ray, bool first_only, std::vector<ReferenceHit>& hits) const override {
    roots_.find(ray, first_only, hits);
  }

  ReferencePoint measure(const glm::dvec3& point, const SurfaceCoordinates*) const override {
    const Domain& domain = roots_.domain();
    if (!is_within(domain, point)) return {nan, undefined_frame()};
    const std::array<double, 10> jet = (*jets_)(point);
    if (!std::isfinite(jet[0])) return {nan, undefined_frame()};
    const glm::dvec3 gradient(jet[1], jet[2], jet[3]);
    const glm::dmat3 hessian(jet[4], jet[7], jet[8],  //
                             jet[7], jet[5], jet[9],  //
                             jet[8], jet[9], jet[6]);
    const double diagonal = glm::length(domain.upper - domain.lower);
    SurfaceFrame frame = level_set_frame(gradient, hessian, int(side_), diagonal > 0 ? flat / diagonal : 0);
    const double steepest = std::max({std::abs(gradient.x), std::abs(gradient.y), std::abs(gradient.z)});
    if (!(frame.status & PointStatus::undefined) && sides_->apart(point) > crease * steepest)
      frame.status |= PointStatus::crease;
    return {jet[0], frame};
  }

  ReferenceWalker begin_walk(const glm::dvec3& point, const SurfaceCoordinates*, const glm::dvec3& direction,
                             double tolerance) const override {
    return smurf::begin_walk(level_set(), *this, point, direction, tolerance);
  }

  ReferenceWalker neighbor(const ReferenceWalker& from, double distance) const override {
    return step_of_walk(level_set(), *this, from, distance);
  }

  std::size_t bytes() const override { return roots_.bytes() + jets_->bytes() + sides_->bytes(); }

  std::shared_ptr<const ReferenceSurface> updated(const SurfaceDefinition& model) const override {
    const auto* other = dynamic_cast<const ImplicitSurface*>(&model);
    if (!other || other->function != roots_.function()) return nullptr;
    return std::make_shared<ImplicitReference>(roots_.with(other->domain, other->level), jets_, sides_, other->side);
  }

 private:
  LevelSet level_set() const {
    const Domain& domain = roots_.domain();
    return {[this, &domain, level = roots_.level()](const glm::dvec3& p) -> std::optional<double> {
              if (!is_within(domain, p)) return std::nullopt;
              const double f = (*jets_)(p)[0];
              return std::isfinite(f) ? f - level : nan;
            },
            glm::length(domain.upper - domain.lower) / 200};
  }

  FunctionRoots roots_;  // keeps the function, so that another cannot take its address
  std::shared_ptr<const JetEvaluator> jets_;
  std::shared_ptr<const SidesOfGradient> sides_;
  ImplicitSurface::Side side_;
};

}  // namespace

std::shared_ptr<const ReferenceSurface> refer_implicit(const SurfaceDefinition& definition) {
  const auto& surface = dynamic_cast<const ImplicitSurface&>(definition);
  const ImplicitFunction& function = *surface.function;
  return std::make_shared<ImplicitReference>(
      FunctionRoots(surface.function, surface.domain, surface.level), std::make_shared<JetEvaluator>(function),
      std::make_shared<SidesOfGradient>(function.graph, function.gradient), surface.side);
}

}  // namespace smurf
