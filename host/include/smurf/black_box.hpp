// Surfaces of functions that no expression can say: a user's own device source, known by its values alone.
//
//   smurf::BlackBox balls;
//   balls.source = R"(
//     FN real black_box(real x, real y, real z) {      // the distance from five balls in a row
//       real least = splat(9.0f);
//       for (int i = 0; i < 5; i++) {
//         real3 p = make3(x - (0.6f * i - 1.2f), y, z);
//         least = min_real(least, sqrt_real(dot3(p, p)) - 0.25f);
//       }
//       return least;
//     })";
//   balls.value = [](const glm::dvec3& p) { ... };    // the same in double, for the reference
//   auto surface = smurf::implicit(balls, {.lower = glm::dvec3(-2), .upper = glm::dvec3(2)}, {.lipschitz = 1});
//
// In loops that lanes leave one by one the others go on, and what has left is kept by selects: host/data/julia.inc is
// an example.
//
// The source is one text for OpenCL C and GLSL, in which a number is a lane of several: `real`, `integer` and `mask`
// (what comparisons give);
// + - * /, comparisons, && || ! and m ? a : b work lane by lane. Not by lanes, and as usual: int, float and loops and
// conditions over them.
//   splat(1.0f) splat_integer(1)             a constant on all lanes, where an operation with a lane does not make it
//                                            one by itself
//   to_real(i) to_integer(r)                 conversions; integers are cut off
//   abs_real sqrt_real min_real max_real clamped(x, low, high) multiply_add(a, b, c)
//   real3 with make3 add3 subtract3 scale3 dot3 cross3 abs3 select3(m, a, b)
//   checked_sin _cos _tan _asin _acos _atan2(y, x) _log _sqrt _pow _power_integer(x, n) _divide _mod _min _max
//                                            as in expressions: not a number where undefined
//   function_exp _atan _floor _sign _sinh _cosh _tanh
//   any_lane(m)                              whether m holds on any lane: the only way from a mask to `if` and `while`
// Functions begin with FN, structures are written STRUCT(Name) { ... };. Names of your own should begin with something
// that is yours. No #include; reserved words of both languages are no names. Where a value is not finite the function
// is undefined, and there is no surface.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <string>

#include "smurf/surface.hpp"

namespace smurf {

struct BlackBox {
  std::string source;  // defines FN real black_box(real x, real y, real z)
  std::function<double(const glm::dvec3&)>
      value;  // the same on the host, called by threads at once; may be missing: the reference then
              // answers with an error (usage) that says so
  std::string name = "black_box";  // for messages and `smurf info`
};

struct BlackBoxOptions {
  double level = 0;
  // Length between samples along a ray, in units of space; 0: 1/512 of the domain's diagonal. At least 1/65536 of it.
  double step = 0;
  // A bound on |∇f| over the domain, 1 for distance functions; 0: none is known. With it, steps are as long as f proves
  // that there is no root, max(step, |f - level| / lipschitz), up to the rounding of f.
  double lipschitz = 0;
  // Of the central differences that derivatives are made from: 2 (those of the 1999 paper), 4 or 6.
  int difference_order = 4;
  // Their step, in units of space. 0: where truncation and rounding balance, for first derivatives d·ε^(1/(order+1)),
  // for second ones d·ε^(1/(order+2)), with d = 1/8 of the domain's diagonal and ε = 2^-24 on devices, 2^-53 in the
  // reference.
  double difference_step = 0;
};

// The surface f = level of a function that is known by its values. Normals point to greater values: n = ∇f/|∇f|.
//
// Hits have HitStatus::bracketed: nothing is proved between samples. Two roots closer to each other than a step may be
// missed, unless |f| has its least sample beside them and a search from there finds a value of the other sign; with a
// bound on |∇f| that is right, only where the samples to both sides of the two have |f - level| sum up to at most
// lipschitz·step. A change of sign over a pole or a jump is no hit; a jump that is less than an eighth of the change of
// f between the samples around it is taken for a root.
//
// Curvature is a second difference of floats, whose rounding is divided by the square of the step: README tells the
// errors. Stencils reach up to order/2 steps out of the domain, and where f is undefined there so are derivatives.
//
// Throws Error (input) when the source is missing, longer than a megabyte or has an #include, and when a number is out
// of its range. Source that does not compile is an Error (input) of the Interrogator, with the compiler's message and
// the line of the source.
Surface implicit(const BlackBox& function, const Domain& domain, const BlackBoxOptions& options = {});

}  // namespace smurf
