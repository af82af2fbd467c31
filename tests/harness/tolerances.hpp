// The one table of tolerances: quantity x kind of surface x precision, each with its reason.
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <string_view>

namespace smurf::test {

enum class Quantity {
  t,                // in voxels along the ray
  conditioning,     // units of rounding of the field's magnitude, divided by its slope, added to t and to curvature
  normal,           // radians
  normal_rounding,  // units of rounding of the field's magnitude over its gradient per voxel, added to the normal
  curvature,        // relative to the larger principal curvature
  curvature_floor,  // per voxel: curvatures below it are compared as if they were that large
  direction,        // radians, where the principal curvatures differ by their larger one
  value,            // units of rounding of the field's magnitude
  tiny_gradient,    // of the field's range per voxel: no curvature is compared where the gradient is smaller
  flagged_rays,     // share of random rays with a hit that is not isolated
};
enum class Precision { float32, float64 };

struct Tolerance {
  Quantity quantity;
  std::string_view kind;
  Precision precision;
  double value;
  std::string_view reason;
};

inline constexpr std::array tolerance_table{
    Tolerance{Quantity::t, "isosurface", Precision::float32, 1e-4,
              "the promise of the library; a float of up to 1000 voxels resolves 6e-5"},
    Tolerance{Quantity::conditioning, "isosurface", Precision::float32, 32,
              "a value is a sum of up to 64 rounded products: where f grows slowly along the ray, 32 units of rounding "
              "of its magnitude move the root by 32·2^-24·max|f| / |df/ds|"},
    Tolerance{Quantity::normal, "isosurface", Precision::float32, 1e-4,
              "the position is rounded to 2^-24 of its distance from the origin, which turns the normal by curvature "
              "x distance, below 1e-4 for grids of up to 100 voxels"},
    Tolerance{Quantity::normal_rounding, "isosurface", Precision::float32, 32, "as conditioning, of the gradient"},
    Tolerance{Quantity::curvature, "isosurface", Precision::float32, 1e-3, "the promise of the library"},
    Tolerance{Quantity::curvature_floor, "isosurface", Precision::float32, 1e-2,
              "a radius of 100 voxels: flatter places are flat to the resolution of the data"},
    Tolerance{Quantity::direction, "isosurface", Precision::float32, 4e-3,
              "the promised 1e-3 of curvature turns the directions by 1e-3·k / (k1 - k2); four times that for both "
              "principal curvatures erring apart"},
    Tolerance{Quantity::value, "isosurface", Precision::float32, 32, "as conditioning"},
    Tolerance{
        Quantity::tiny_gradient, "isosurface", Precision::float32, 1e-3,
        "the gradient is tiny where 32 units of rounding in second differences of the samples, divided by it, exceed "
        "the promised 1e-3 of curvature"},
    Tolerance{Quantity::flagged_rays, "isosurface", Precision::float32, 1e-4, "the promise of the library"},
    Tolerance{Quantity::normal, "black box, order 2", Precision::float32, 1e-4,
              "first differences with the step that balances: 2^(-24p/(p+1)) = 1.5e-5 of the function over an eighth "
              "of the diagonal, from rounding and about as much again from truncation"},
    Tolerance{Quantity::normal, "black box, order 4", Precision::float32, 2e-5,
              "as order 2, 1.7e-6; the stencil on a grid of 2^-22 of the coordinates adds as much"},
    Tolerance{Quantity::normal, "black box, order 6", Precision::float32, 2e-5, "as order 4"},
    Tolerance{Quantity::curvature, "black box, order 2", Precision::float32, 2e-3,
              "of the tube: second differences with the step that balances, 2^(-24p/(p+2)) = 2.4e-4 of the function "
              "over the square of an eighth of the diagonal, from rounding (4 units) and from truncation"},
    Tolerance{Quantity::curvature, "black box, order 4", Precision::float32, 2e-4,
              "as order 2, 1.5e-5 from rounding (16/3 units), and truncation"},
    Tolerance{Quantity::curvature, "black box, order 6", Precision::float32, 3e-4,
              "as order 4, 3.8e-6 from rounding; the stencil is as wide as half of the tube, truncation counts"},
};

constexpr Tolerance tolerance(Quantity quantity, std::string_view kind, Precision precision = Precision::float32) {
  for (const Tolerance& row : tolerance_table)
    if (row.quantity == quantity && row.kind == kind && row.precision == precision) return row;
  throw std::out_of_range("no tolerance in the table for this quantity, kind and precision");
}

}  // namespace smurf::test
