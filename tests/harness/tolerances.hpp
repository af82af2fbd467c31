// The one table of tolerances: quantity x kind of surface x precision, each with its reason.
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <string_view>

namespace smurf::test {

enum class Quantity {
  t,                // grids: in voxels along the ray; meshes, sweep: relative; others: units of rounding of t
  border,           // grids: voxels; others: of the domain's size. Roots this close to an end of the ray or to the
                    // border of the domain may be found or not
  same_root,        // voxels: a hit farther from a root is another one's
  location,         // units of rounding of the ray's origin and of its way to the hit
  coordinates,      // of u and v in a triangle
  place,            // on a surface s(u, v), of its extent, where a ray meets it at a right angle
  frame,            // of lengths and products of unit vectors that are at right angles
  conditioning,     // units of rounding of the field's magnitude, divided by its slope, added to t and to curvature
  normal,           // radians
  normal_rounding,  // units of rounding of the field's magnitude over its gradient per voxel, added to the normal
  curvature,        // relative to the larger principal curvature
  curvature_floor,  // grids: per voxel, curvatures below it are compared as if they were that large; implicit: none is
                    // compared where both are below
  direction,        // radians, where the principal curvatures differ by their larger one
  value,            // units of rounding of the field's magnitude; sweep: relative
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

// For quantities that all kinds share.
inline constexpr std::string_view any_kind = "any";

inline constexpr std::array tolerance_table{
    Tolerance{
        Quantity::location, any_kind, Precision::float32, 8,
        "origin + t·direction in floats: a rounding each of the product, of the sum and of t, for three components"},
    Tolerance{Quantity::frame, any_kind, Precision::float32, 1e-5,
              "a normal and two directions, each made of a few dozen float operations and divided by its length"},
    Tolerance{Quantity::t, "isosurface", Precision::float32, 1e-4,
              "the promise of the library; a float of up to 1000 voxels resolves 6e-5"},
    Tolerance{Quantity::t, "isosurface, closed form", Precision::float32, 2e-4,
              "the samples are rounded to float as well: rounding / slope comes on top"},
    Tolerance{Quantity::border, "isosurface", Precision::float32, 1e-4, "as t, of which it is the place of an end"},
    Tolerance{Quantity::same_root, "isosurface", Precision::float32, 1.0 / 16,
              "pairs of roots closer than a sixteenth of a cell are hostile (truth/rays.hpp); a hit that far off is of "
              "another root"},
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
    Tolerance{Quantity::t, "implicit", Precision::float32, 2,
              "t is a float, and the sum of two: where the ray enters the domain, and how far the hit is from there. "
              "Each rounds to half a unit of its last place, 2^-24 of the farthest t"},
    Tolerance{Quantity::border, "implicit", Precision::float32, 2e-6,
              "devices clip in floats, from where the ray begins, which is one and a half sizes of the domain away"},
    Tolerance{Quantity::flagged_rays, "implicit", Precision::float32, 1e-3,
              "hits that are flagged by floats are decided in double (host/api/resolve_hits.hpp), which leaves double "
              "roots, and singular points nearer than about 1e-6. Random rays meet neither, not even on surfaces that "
              "are singular along whole curves; so it is all flagged rays that count, wherever they are"},
    Tolerance{Quantity::normal, "implicit", Precision::float32, 1e-5,
              "first derivatives of a few dozen float operations"},
    Tolerance{Quantity::curvature, "implicit", Precision::float32, 1e-4,
              "the promise of the library; second derivatives of a few dozen float operations"},
    Tolerance{Quantity::curvature, "implicit", Precision::float64, 1e-6,
              "the reference; locations are floats, a rounding off the surface"},
    Tolerance{Quantity::curvature_floor, "implicit", Precision::float32, 1e-3,
              "of surfaces in domains of a few units: a radius of a thousand is flat"},
    Tolerance{Quantity::normal, "implicit, every operation", Precision::float32, 2e-5,
              "a few dozen operations, of sizes up to 20"},
    Tolerance{Quantity::curvature, "implicit, every operation", Precision::float32, 2e-4,
              "as the normal; relative to curvatures of 1 where they are smaller"},
    Tolerance{Quantity::t, "mesh", Precision::float32, 1.2e-7,
              "both sides round the exact t to a float: one unit in the last place"},
    Tolerance{Quantity::coordinates, "mesh", Precision::float32, 1e-5,
              "weights by sums of two floats: off by their rounding to floats, and more in triangles that the ray "
              "nearly lies in"},
    Tolerance{Quantity::t, "parametric", Precision::float32, 2,
              "t is a float, and the sum of two, as for implicit surfaces; beside the stated uncertainty"},
    Tolerance{Quantity::place, "parametric", Precision::float32, 1e-6,
              "the promise of the library: of t across the surface, and of the place on it"},
    Tolerance{
        Quantity::place, "parametric, nearest", Precision::float32, 2e-6,
        "distances, of which the least is flat: four roundings of coordinates of the size of the extent and more"},
    Tolerance{Quantity::flagged_rays, "parametric", Precision::float32, 1e-4, "the promise of the library"},
    Tolerance{Quantity::normal, "parametric", Precision::float32, 1e-5,
              "first derivatives of a few dozen float operations"},
    Tolerance{Quantity::curvature, "parametric", Precision::float32, 1e-4, "the promise of the library"},
    Tolerance{Quantity::curvature_floor, "parametric", Precision::float32, 1e-2,
              "of the inverse of the extent: a radius of a hundred extents is flat"},
    Tolerance{Quantity::conditioning, "parametric", Precision::float32, 16,
              "of second derivatives by the squares of the first: a few dozen float operations"},
    Tolerance{Quantity::t, "stream", Precision::float32, 2, "as for surfaces s(u, v)"},
    Tolerance{Quantity::place, "stream", Precision::float32, 1e-5,
              "the promise of the library, which is the tolerance that meshes are made to"},
    Tolerance{Quantity::place, "stream", Precision::float64, 2e-7, "the reference; places are stored in floats"},
    Tolerance{Quantity::flagged_rays, "stream", Precision::float32, 1e-3,
              "tangent and unresolved: rays that pass a fold as near as the mesh is to the surface"},
    Tolerance{
        Quantity::normal, "stream", Precision::float32, 5e-4,
        "cells that are right to 1e-5 of the extent, with sides of a tenth: slopes are to four times their ratio"},
    Tolerance{Quantity::curvature, "stream", Precision::float32, 1e-3, "the promise of the library"},
    Tolerance{Quantity::curvature_floor, "stream", Precision::float32, 1,
              "of the inverse of the extent: 1e-5 of it over the square of a tenth is 1e-3 of its inverse"},
    Tolerance{Quantity::conditioning, "stream", Precision::float32, 64,
              "of second derivatives: the variational equations are integrated in floats, over some dozen steps"},
    Tolerance{
        Quantity::t, "black box", Precision::float32, 4,
        "t and the coordinates are rounded where the ray enters, where it is sampled and where the hit is, and once "
        "more as t is stored"},
    Tolerance{Quantity::border, "black box", Precision::float32, 1e-5,
              "the ends of the ray in the domain are clipped in floats, from where the ray begins"},
    Tolerance{Quantity::value, "black box", Precision::float32, 16,
              "of the sum of the magnitudes of a function's terms: its own operations, and those on the coordinates"},
    Tolerance{Quantity::normal, "black box", Precision::float64, 1e-6,
              "differences in double are exact to float; places and results are floats"},
    Tolerance{Quantity::curvature, "black box", Precision::float64, 4e-6, "as the normal, of second derivatives"},
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
    Tolerance{Quantity::t, "kernel sweep", Precision::float32, 1e-4,
              "the sweep asks whether every variant of a kernel runs and answers as the reference does, on "
              "implementations of any accuracy; how well is asked by cases"},
    Tolerance{Quantity::value, "kernel sweep", Precision::float32, 1e-4, "as t"},
    Tolerance{Quantity::normal, "kernel sweep", Precision::float32, 1e-3, "as t, of first derivatives"},
    Tolerance{Quantity::curvature, "kernel sweep", Precision::float32, 1e-2, "as t, of second derivatives"},
    Tolerance{Quantity::curvature, "kernel sweep, coarse mesh", Precision::float32, 0.1,
              "against the torus itself: on a mesh of 16 x 10 the reference's estimate is off by more"},
};

constexpr Tolerance tolerance(Quantity quantity, std::string_view kind, Precision precision = Precision::float32) {
  for (const Tolerance& row : tolerance_table)
    if (row.quantity == quantity && row.kind == kind && row.precision == precision) return row;
  throw std::out_of_range("no tolerance in the table for this quantity, kind and precision");
}

}  // namespace smurf::test
