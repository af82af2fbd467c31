// The map x(u, τ) of a stream surface in double: streamlines of the reference from points of the seed curve, and
// differences of such lines. No mesh, and no variational equation.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "reference/flow/flow.hpp"
#include "surfaces/stream/definition.hpp"

namespace smurf {

// A range of u in which the seed curve is smooth and inside of the domain.
struct StreamStretch {
  double lower = 0, upper = 0;
  double size() const { return upper - lower; }
};

// A streamline at given times. Beyond its end the field goes on as far as its last piece does, then straight on.
struct SampledLine {
  std::vector<glm::dvec3> x, v;
  double from = 0, until = 0;  // the times between which it is in the domain
};

class ReferenceStreamMap {
 public:
  explicit ReferenceStreamMap(const StreamSurface& surface);

  // Throws Error (input): no seed is in the domain, the field is zero at all of them, or all lie along the flow.
  const std::vector<StreamStretch>& stretches() const { return stretches_; }
  const glm::dvec2& time() const { return time_; }
  bool is_smooth() const { return smooth_; }

  // At times that ascend. u is in the stretch.
  SampledLine line(const StreamStretch& stretch, double u, const std::vector<double>& times) const;

  struct Spot {
    glm::dvec3 x{0.0}, v{0.0};
    bool reached = false;  // else the line ends before, and goes straight on from there
    double end = 0;        // the time at which it does
  };
  // u in the range of the seed curve.
  Spot at(double u, double time) const;
  // ∂x/∂u by differences that stay in the stretch, to about 1e-8.
  glm::dvec3 along(const StreamStretch& stretch, double u, double time) const;

  // With derivatives by u and τ, to as many digits as differences give; NaN where the surface does not reach, and of
  // second order where the field is not smooth. u is moved off corners of the seed curve, into the stretch.
  struct Jet {
    glm::dvec3 x, u, v, uu, uv, vv;
  };
  Jet jet(const StreamStretch& stretch, double u, double time) const;

 private:
  glm::dvec3 velocity(const glm::dvec3& x, ReferencePlace& last) const;
  void trace(const glm::dvec3& seed, const std::vector<double>& times, double direction, std::vector<glm::dvec3>& x,
             std::vector<glm::dvec3>& v, double& end) const;
  bool is_inside(double u) const;
  void find_stretches();
  void require_surface() const;

  std::shared_ptr<const ReferenceFlow> flow_;
  std::shared_ptr<const VectorFieldDefinition> field_;  // what the flow refers to
  SeedLine seed_;
  glm::dvec2 time_;
  bool smooth_;
  std::vector<StreamStretch> stretches_;
};

}  // namespace smurf
