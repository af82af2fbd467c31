// Curvature of a level set from the gradient and Hessian of its function.
//
// With the unit normal n = orientation·∇f/|∇f| the shape operator is the derivative of n on the tangent
// plane, orientation·P H P/|∇f| with P = I - n nᵀ; its eigenvalues are the principal curvatures, positive
// where the surface bends away from n (a sphere with outward normals: 1/r).
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace smurf {

// A point's normal and principal frame; NaN where `status` says undefined.
struct SurfaceFrame {
  glm::dvec3 normal;
  double k1, k2;         // k1 >= k2
  glm::dvec3 d1, d2;     // unit, tangent, orthogonal
  std::uint32_t status;  // PointStatus bits: umbilic, undefined, crease
};

SurfaceFrame undefined_frame();

// `orientation` is -1 for isosurfaces (out of the denser side), +1 for implicit surfaces.
// `flat` is an absolute difference of curvatures that counts as none, beside a relative one of 1e-6.
SurfaceFrame level_set_frame(const glm::dvec3& gradient, const glm::dmat3& hessian, int orientation, double flat = 0);

// k1 cos²θ + k2 sin²θ for the direction projected to the tangent plane; NaN for a direction without tangent part.
double normal_curvature(const SurfaceFrame& frame, const glm::dvec3& direction);

}  // namespace smurf
