// A vector field as the reference knows it, in double precision, by other methods than the kernels'.
//
// A field consists of pieces, in each of which it is smooth: cells of a grid, or the domain of an expression. A piece
// has coordinates of its own, from 0 to 1, and its field continues beyond its border, so that a step of an integrator
// may end there. Lines are cut where they leave a piece; so the jumps of derivatives at faces cost no accuracy.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <memory>

#include "flows/definition.hpp"

namespace smurf {

struct ReferencePlace {
  FlowStatus status = FlowStatus::domain;  // inside, domain, blanked or undefined
  std::int32_t piece = -1;
  glm::dvec3 local{0.0};
};

class ReferenceFlow {
 public:
  virtual ~ReferenceFlow() = default;
  virtual Bounds bounds() const = 0;
  // Whether pieces are cells of a grid, which FlowSamples names.
  virtual bool has_cells() const = 0;
  // The piece that a point lies in. Points that are outside by no more than `slack`, in units of space, count as on
  // the border.
  virtual ReferencePlace find(const glm::dvec3& point, double slack) const = 0;
  // The coordinates of a point in a piece, which it may leave a little. `local` is the guess to begin with. False where
  // none are found.
  virtual bool locate(std::int32_t piece, const glm::dvec3& point, glm::dvec3& local) const = 0;
  // The field of a piece, continued; may be not finite. `point` and `local` are of one place.
  virtual glm::dvec3 value(std::int32_t piece, const glm::dvec3& point, const glm::dvec3& local) const = 0;
  // A length over which the field of a piece varies little: of the shortest edge, or of an eighth of the domain.
  virtual double size(std::int32_t piece) const = 0;

  // Of the ball about the origin that the domain is within.
  static constexpr double no_ball = std::numeric_limits<double>::infinity();
  virtual double radius() const { return no_ball; }

  struct Value {
    ReferencePlace place;
    glm::dvec3 vector;  // NaN where not inside
  };
  Value at(const glm::dvec3& point, double slack) const;

  // Columns ∂v/∂x_c, and ∂²v by xx, yy, zz, xy, xz, yz: differences of the values of a piece, extrapolated. NaN where
  // the values about it do not do.
  glm::dmat3 jacobian(const ReferencePlace& place, const glm::dvec3& point) const;
  std::array<glm::dvec3, 6> hessian(const ReferencePlace& place, const glm::dvec3& point) const;
};

double extent_of(const ReferenceFlow& flow);  // the longest side of its bounds
// How far points that were rounded to float may lie outside.
double slack_of(const ReferenceFlow& flow, const glm::dvec3& point);

}  // namespace smurf
