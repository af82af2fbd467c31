// Lines of curvature: curves on a surface that follow a principal direction (do Carmo 1976, section 3.2).
//
//   auto query = smurf::Interrogator(device, surface);
//   auto lines = smurf::curvature_lines(query, surface.bounds(), seeds, {.principal = 1, .length = 3});
//
// Principal directions have no sign: they are a line field, and the direction of each step is the one that goes on as
// the last one did. Steps are those of Runge and Kutta's fourth-order method; every stage is put back on the surface
// along the normal, and all lines advance together.
//
// An umbilic point has no principal directions. Where one stops a line, the field is looked at on a small circle about
// it. Its index is half the winding of the doubled angle (Berry and Hannay 1977): 1/2 of a lemon, with one separatrix,
// or a monstar, with three; -1/2 of a star, with three. The line goes on along the separatrix that turns least from the
// way in; where there is none but the one that it came by, as in a lemon, it ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "smurf/interrogator.hpp"

namespace smurf {

// Of a row. `umbilic`: an umbilic point that the line passes, or ends at when it is the last row; lines end, too, where
// a whole region is umbilic (spheres, planes). Of last rows: `boundary`: the surface ends, to a 256th of a step;
// `undefined`: the curvature is, or the seed is not on the surface; `length`: the line is as long as was asked for;
// `steps`: it has taken most_steps.
enum class CurvatureLineStatus : std::uint8_t { regular, umbilic, boundary, undefined, length, steps };
std::string_view name_of(CurvatureLineStatus status);

struct CurvatureLineOptions {
  int principal = 1;  // 1: along the direction of k1 (the greater curvature), 2: of k2
  double length = 0;  // of a line, along the surface; with `both` of each half. Positive
  // Both ways from the seed; else to the side on which the direction's greatest component is positive.
  bool both = false;
  double step = 0;                   // the longest, in units of space; 0: a 400th of the diagonal of the bounds
  double reach = 0;                  // how far seeds may be from the surface; 0: a hundredth of the diagonal
  std::size_t most_steps = 100'000;  // of a line
  std::function<void(std::size_t done, std::size_t total)> progress = {};  // lines that have ended
};

struct CurvatureLines {
  std::vector<std::size_t> offsets{0};  // line i has rows offsets[i] .. offsets[i + 1] - 1
  std::vector<glm::vec3> positions;
  std::vector<float> arcs;  // length from the seed on; negative before it
  std::vector<float> k1, k2;
  std::vector<CurvatureLineStatus> status;
  std::size_t size() const { return offsets.size() - 1; }
};

// A line for each seed, in order; a seed that is not on the surface has one row. `bounds` are those of the surface, in
// whose diagonal lengths are measured. Throws Error (usage) on options that cannot be meant.
CurvatureLines curvature_lines(const Interrogator& query, const Bounds& bounds, std::span<const glm::vec3> seeds,
                               const CurvatureLineOptions& options);

}  // namespace smurf
