// Traverses a ray through the cells of a grid and hands each span of it to a visitor as a polynomial.
#pragma once

#include "reference/grid/field.hpp"
#include "reference/polynomial.hpp"
#include "reference/surface.hpp"

namespace smurf {

// The ray inside one cell: t = middle + half·s with s in [-1, 1].
struct RaySpan {
  double middle, half;
  Chebyshev f;      // less the isovalue
  double scale;     // largest |tap - isovalue| of the cell
  double rounding;  // f is not known better than this
  double begin() const { return middle - half; }
  double end() const { return middle + half; }
};

class RayVisitor {
 public:
  virtual ~RayVisitor() = default;
  // Spans where |f - isovalue| is surely above this many times the scale, and above rounding, go to `clear`.
  virtual double clear_above() const = 0;
  virtual void clear(int sign, double t) = 0;  // f - isovalue has this sign in a span that begins at t
  virtual void span(const RaySpan& span) = 0;
  virtual void gap(double t) = 0;  // here the domain or an undefined cell begins or ends
  virtual bool finished() const = 0;
};

// Spans come in order of t and without gaps between them but for those that are told.
void traverse_ray(const GridField& field, double isovalue, const ReferenceRay& ray, RayVisitor& visitor);

}  // namespace smurf
