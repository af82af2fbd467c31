// Comparison of reconstructions: a surface that an expression gives is sampled at several resolutions, each
// reconstruction makes a surface of the samples again, and that is held against the exact one. (The use that
// Loeffelmann and others, 1999, Figs. 7 and 8, make of their interface.)
//
//   auto comparison = smurf::compare(device, smurf::implicit("x^2+y^2+z^2-1", {glm::dvec3(-2), glm::dvec3(2)}));
//   for (const auto& row : comparison.rows) std::printf("%d %g %g\n", row.resolution, row.mean.rms, row.mean.order);
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "smurf/device.hpp"
#include "smurf/stream.hpp"
#include "smurf/surface.hpp"

namespace smurf {

struct CompareOptions {
  std::vector<int> resolutions{16, 32, 64, 128};  // nodes along each axis of the domain, ascending, at least 2
  std::vector<Reconstruction> reconstructions{Reconstruction::trilinear, Reconstruction::catmull_rom,
                                              Reconstruction::tricubic};
  std::size_t rays = 2000;  // chords of the domain
  std::uint64_t seed = 1;
  // The border of a grid is another source of errors than the one that is measured: a mirrored continuation bends a
  // B-spline, and the bend fades only by 2 - sqrt(3) a node. So the grids have this many nodes more beyond each face of
  // the domain; 13 nodes leave 4e-8 of it.
  int apron = 12;
  // What is nearer than this to the border of the domain is left out, at every resolution: its counterpart may lie
  // beyond. In world units; by default the longest edge of a cell of the coarsest grid, or an eighth of the domain's
  // shortest edge if that is less.
  std::optional<double> margin = {};
  std::function<void(std::size_t done, std::size_t total)> progress = {};
};

struct ErrorMeasure {
  double rms = 0;       // root of the mean square
  double greatest = 0;  // absolute
  // log(coarser rms / this rms) / log(coarser step / this step), from the resolution before; NaN for the first.
  double order = std::numeric_limits<double>::quiet_NaN();
};

// One reconstruction at one resolution.
struct ComparisonRow {
  Reconstruction reconstruction = Reconstruction::trilinear;
  int resolution = 0;
  double step = 0;  // the longest edge of a cell

  // At the points of the exact surface: where the line along the exact normal meets the reconstructed surface.
  std::size_t lost = 0;       // points without a reconstructed surface within `reach`; in none of the errors
  std::size_t undefined = 0;  // points where it has no normal or no curvature: in the errors of location only
  ErrorMeasure location;      // distance between the surfaces, in world units
  ErrorMeasure normal;        // angle, in radians
  ErrorMeasure mean;          // of mean curvature, absolute, per unit of length
  ErrorMeasure gauss;         // of Gauss curvature, absolute, per unit of length squared

  // Along the chords: exact roots without a counterpart, and counterparts without an exact root. What one of both sides
  // flags as tangent or unresolved is undecided: it may stand for no root, one, or several.
  std::size_t missed = 0, invented = 0, undecided = 0;
  std::size_t not_finite = 0;  // samples, where the expression is undefined or too great
  ErrorMeasure along_chord;    // distance of the roots, in world units; grazing chords, which magnify it, included
};

struct Comparison {
  int apron = 0;
  double margin = 0;  // world units, as used
  double reach =
      // How far, in world units, an exact root's counterpart may be off: the longest edge of a cell of the coarsest
      // grid
      0;
  std::size_t rays = 0;
  std::size_t roots = 0;          // exact roots of the chords, without those in the margin
  std::size_t near_boundary = 0;  // exact roots in the margin, left out
  std::size_t points = 0;         // where errors are measured: the roots, but for
  std::size_t singular = 0;       // those that are flagged, or where the exact surface has no normal or curvature
  double mean_rms = 0;            // of the exact curvatures at the points, as a scale for their errors
  double gauss_rms = 0;
  std::vector<ComparisonRow> rows;  // by reconstruction, then by resolution
  std::size_t device_rays = 0;      // cast on the device, and the seconds that took
  double device_seconds = 0;
};

// Chords are isotropic lines through the domain's box, so that their roots are spread evenly over the surface, every
// piece of it by its area. The exact answers are those of the double-precision reference for the expression; samples
// are floats, and the device answers for them. Throws Error (usage) on options that cannot be meant, Error (input) when
// the surface is not given by an expression, or when no chord meets it.
Comparison compare(const Device& device, const Surface& surface, const CompareOptions& options = {});

// Comparison of the ways to normals and curvature on a stream surface: those of StreamDerivatives that only know the
// mesh against the variational equations, integrated from the seed to each point. (The use that Loeffelmann and others,
// 1999, make of their cases 3 and 4.)
//
//   auto comparison = smurf::compare_stream(device, surface);
//   for (const auto& row : comparison.rows) std::printf("%s %g\n", name_of(row.derivatives).data(), row.normal.rms);
struct StreamCompareOptions {
  std::size_t rays = 2000;      // chords of the surface's bounds
  std::size_t places = 10'000;  // random (u, τ) at which the mesh is held against the true surface
  std::uint64_t seed = 1;       // of both
  std::function<void(std::size_t done, std::size_t total)> progress = {};
};

struct StreamComparisonRow {
  StreamDerivatives derivatives = StreamDerivatives::interpolated;
  std::size_t undefined = 0;  // hits without a normal, in none of the errors
  std::size_t flat = 0;       // hits with a normal but no curvature, in the errors of normals only
  ErrorMeasure normal;        // angle, in radians
  ErrorMeasure mean;          // of mean curvature, absolute, per unit of length
  ErrorMeasure gauss;         // of Gauss curvature, absolute, per unit of length squared
};

struct StreamComparison {
  std::size_t rays = 0;
  std::size_t hits = 0;                   // where errors are measured: all hits of the chords
  std::size_t sampled = 0;                // those of them that are not proved
  double mean_rms = 0, gauss_rms = 0;     // of the integrated curvatures, as a scale for errors
  std::vector<StreamComparisonRow> rows;  // interpolated, mesh, neighbours
  std::size_t places = 0;                 // at which the surface is, of those that were drawn
  ErrorMeasure deviation;                 // of the mesh from the true surface at the same (u, τ), in units of space
  double tolerance = 0;                   // that was asked for
};

// Of a back-stream surface the mesh is compared that the explicit method makes of it. Throws Error (usage) on surfaces
// of another kind and on options that cannot be meant, Error (input) when no chord meets the surface.
StreamComparison compare_stream(const Device& device, const Surface& surface, const StreamCompareOptions& options = {});

}  // namespace smurf
