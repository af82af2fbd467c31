// Surfaces s(u, v): given by expressions, or as Bézier, B-spline and NURBS patches.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "patches/piece_source.hpp"
#include "patches/topology.hpp"
#include "smurf/patch.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

// s(u, v) as it was given, for u in [lower.x, upper.x] and v in [lower.y, upper.y].
struct ParametricExpressions {
  std::array<std::string, 3> position{};  // x, y, z in u and v
  glm::dvec2 lower{0.0}, upper{1.0};
  Parameters parameters{};
  std::array<bool, 2> closed{};  // said to be closed in u, in v
};

class ParametricSurface : public SurfaceDefinition {
 public:
  // Throw Error (input) as parametric() and nurbs() of smurf/surface.hpp do.
  explicit ParametricSurface(ParametricExpressions expressions);
  explicit ParametricSurface(std::vector<Patch> patches);

  std::string_view kind() const override { return patches.empty() ? "parametric" : "nurbs"; }
  Bounds bounds() const override { return bounds_; }
  std::uint32_t properties() const override;
  std::vector<std::string_view> coordinate_names() const override {
    return patches.empty() ? std::vector<std::string_view>{"", "u", "v"}
                           : std::vector<std::string_view>{"patch", "u", "v"};
  }
  std::size_t parts() const override { return patches.empty() ? 1 : patches.size(); }
  std::vector<Fact> facts() const override;
  RootResolver root_resolver() const override;

  std::string_view ray_limits() const override { return ", and its origin not 5e11 times as far out as the surface"; }

  // One of the two is given; with expressions there are no patches.
  const ParametricExpressions expressions;
  const std::vector<Patch> patches;

  const PieceSource& pieces() const { return *pieces_; }
  const PatchTopology& topology() const { return topology_; }

 private:
  std::shared_ptr<const PieceSource> pieces_;
  PatchTopology topology_;
  Bounds bounds_;  // of the surface, closely
  // Made when a hit is first asked about.
  struct Roots;
  std::shared_ptr<Roots> roots_;
};

}  // namespace smurf
