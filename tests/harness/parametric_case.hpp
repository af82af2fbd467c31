// Cases of surfaces s(u, v), as descriptors of the general form (case.hpp): hits against exact roots with their u and
// v, or against the reference's; and what is measured there against derivatives that come from no text of the
// library.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "harness/case.hpp"
#include "harness/hit_list_oracle.hpp"
#include "truth/parametric.hpp"
#include "truth/parametric_rays.hpp"
#include "truth/patches.hpp"

namespace smurf::test {

// |cos| of the angle of a direction and the normal; 1 where there is none.
double slope_of(const PatchPoint& p, const glm::dvec3& direction);

// How far a hit may be from a root: t within its stated uncertainty and the rounding of floats, and t and the place on
// the surface within what the library promises, which grows where a ray runs along the surface.
class ParametricRules {
 public:
  explicit ParametricRules(double extent);
  // `slope` is |cos| of the angle of ray and normal at the root, `apart` how far apart the places are on the surface.
  Match match(const Ray& ray, const Hit& hit, double t, double slope, double apart) const;
  double rounding(double t) const { return roundings_ * 0x1p-24 * std::abs(t); }

 private:
  double extent_, roundings_, place_;
};

// Hits against the exact roots of a scene that has an equation.
class ExactParametricOracle : public Oracle {
 public:
  ExactParametricOracle(const ParametricScene& scene, const RayBatch& rays);

  std::unique_ptr<const RayOracle> on(std::size_t index, const Ray& ray) const override;
  const char* unit() const override { return "of the extent"; }

  const ParametricScene scene;
  const double extent;
  // Where the scene has the point of a hit; as the hit says, where it is empty. For patches of the same surface.
  std::function<glm::dvec2(const SurfaceCoordinates&)> place_of;

 private:
  friend class ExactParametricRay;
  std::vector<ParametricRoots> roots_;
};

// Hits against another list's. `distance` tells how far apart two places are on the surface, `slope` |cos| of the angle
// of a direction and the normal at a place.
struct PlaceRules {
  double extent = 1;
  std::function<double(const SurfaceCoordinates& hit, const SurfaceCoordinates& truth)> distance;
  std::function<double(const SurfaceCoordinates& place, const glm::dvec3& direction)> slope;
  // How far it is to where the surface ends.
  std::function<double(const SurfaceCoordinates& place)> to_end;
};
PlaceRules rules_of(const ParametricScene& scene);
// Of patches: at sides, where one place has several names, places are compared in space.
PlaceRules rules_of(const std::vector<Patch>& patches);
std::shared_ptr<const Oracle> oracle_by_list(const HitList& truth, const PlaceRules& rules);
// By the reference's hits.
std::shared_ptr<const Oracle> oracle_by_reference(const Surface& surface, const RayBatch& rays,
                                                  const PlaceRules& rules);

// What is measured at the hits of a list, by derivatives at their own u and v. `at` gives nothing where nothing is
// compared.
using PointAt = std::function<std::optional<PatchPoint>(const SurfaceCoordinates&)>;
PointOracle parametric_points(std::span<const SurfaceCoordinates> places, double extent, PointAt at,
                              std::string_view kind = "parametric");

// A case without its rays and oracle. Patches are written out to be cast on again.
Case case_of(const ParametricScene& scene);
Case case_of(const std::string& name, const std::vector<Patch>& patches);

// Programs of an expression are its own, and every device compiles them for seconds: what is asked of expressions
// beside `everywhere` runs on one device of each executor, on all with SMURF_TEST_DENSE.
std::vector<TestDevice> devices_for_expressions(bool everywhere = false);

// Whether a hit of the ray is tangent or unresolved.
bool is_flagged(const HitList& hits, std::size_t ray);
std::size_t flagged_rays(const HitList& hits);
// Rays of a list without flagged hits, which are odd in number.
std::size_t odd_rays(const HitList& hits);

}  // namespace smurf::test
