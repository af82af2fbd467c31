// Scalar fields with exact answers: values, derivatives, and where a line meets a level set.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "smurf/volume.hpp"
#include "truth/jet.hpp"

namespace smurf::test {

class AnalyticField {
 public:
  virtual ~AnalyticField() = default;
  virtual Jet at(const glm::dvec3& p) const = 0;
  // Where f(o + t·d) - level changes sign for t in [lower, upper], ascending. By default: sampled at `default_steps`
  // steps and refined by bisection, which serves for fields that vary slowly over a step.
  virtual std::vector<double> roots(double level, const glm::dvec3& o, const glm::dvec3& d, double lower,
                                    double upper) const;
  static constexpr int default_steps = 20000;
};
using FieldPointer = std::shared_ptr<const AnalyticField>;

// Distance functions, positive inside, so that isosurface normals point outward.
FieldPointer sphere_field(const glm::dvec3& center, double radius);                           // radius - |p - c|
FieldPointer cylinder_field(const glm::dvec3& point, const glm::dvec3& axis, double radius);  // radius - distance
FieldPointer torus_field(const glm::dvec3& center, double ring_radius, double tube_radius);   // about z

// Marschner and Lobb, Visualization 1994, eq. 3, with f_M = 6 and alpha = 1/4.
FieldPointer marschner_lobb_field();

// sin(k·p): parallel layers; a ray crosses as many as one likes.
FieldPointer layers_field(const glm::dvec3& k);

// Σ c[i + 4j + 16k] x^i y^j z^k, in coordinates x = to_unit·(p, 1). `coefficients` with i, j, k up to 3.
FieldPointer polynomial_field(const std::array<double, 64>& coefficients, const glm::dmat3& to_unit,
                              const glm::dvec3& shift);

// The polynomial field with random coefficients in [-1, 1], of degree at most `degree` in each variable, whose unit
// coordinates run over [-1, 1]³ on a grid.
FieldPointer random_polynomial_field(int degree, glm::ivec3 size, const GridPlacement& placement, unsigned seed);

// The field's samples on a grid, as type: stored value = scale·f + offset, rounded for integer types.
struct Sampling {
  glm::ivec3 size{32};
  GridPlacement placement = {};
  SampleType type = SampleType::float32;
  double scale = 1, offset = 0;
};
Volume sample(const AnalyticField& field, const Sampling& sampling);

// A placement with the grid's centre at `center`.
GridPlacement centered(GridPlacement placement, glm::ivec3 size, const glm::dvec3& center = glm::dvec3(0.0));
// A random rotation, shear and anisotropic spacing about `step`; left-handed for odd seeds.
GridPlacement sheared_placement(double step, unsigned seed);

}  // namespace smurf::test
