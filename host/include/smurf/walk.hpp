// Walking on a surface (Interrogator::neighbors, Interrogator::walk, HitList::neighbors).
//
// From a point p with the unit normal n, in a direction d and over a distance r: the surface is cut by the plane through
// p that n and d span, d projected to the tangent plane first. What is reached is the first point of this section curve
// at the chord r from p (|q - p| = r, in the data's units), followed continuously from p on the side of d; never a point
// of another sheet. The direction goes along by the rotation that turns the normal at p into that at q. So a path of
// many steps on a sphere is a great circle; on other surfaces it approaches a geodesic as steps get shorter.
//
//   auto next  = hits.neighbors(directions, 0.5f);
//   auto paths = query.walk(points, directions, 0.5f, 100);
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <string_view>

#include "smurf/coordinates.hpp"
#include "smurf/values.hpp"

namespace smurf {

// How a step ended. The first three go on: `start`: step 0 of a path; `reached`; `crease`: reached past an edge or crease
// where the normal turns at once (by more than 30° along the curve). A path ends with the others. `boundary`: the
// surface or its domain ends; the last point is given. `unreachable`: the section curve comes back to the start and is
// never that far; the point is the start of the step. `undefined`: the surface has no normal at the start, or nothing is
// known of it further on (the last point is given). `unresolved`: the curve was followed as far as there was patience
// for, or lost. Not walked at all: `off_surface`: the point is farther from the surface than WalkOptions::tolerance;
// `no_direction`: the direction is along the normal or zero; `invalid`: a number is not finite, or a distance is not
// positive.
enum class WalkStatus : std::uint32_t {
  start = 0,
  reached = 1,
  crease = 2,
  boundary = 3,
  unreachable = 4,
  undefined = 5,
  unresolved = 6,
  off_surface = 7,
  no_direction = 8,
  invalid = 9,
};
std::string_view name_of(WalkStatus status);
// Whether a path goes on from there.
constexpr bool goes_on(WalkStatus status) { return status <= WalkStatus::crease; }

enum class BadPoints { flag, error };  // flag: a status says what is wrong; error: the call throws Error (input)

struct WalkOptions {
  BadPoints bad_points = BadPoints::flag;
  // Points within this distance of the surface are first moved onto it; others are bad. A negative one stands for a
  // thousandth of the diagonal of the surface's bounds; 0 allows for rounding alone. Points given by hits or by surface
  // coordinates are on the surface.
  float tolerance = -1;
  std::size_t tile = 0;  // points on the device at a time; 0 lets the device decide. Results do not depend on it.
  std::function<void(std::size_t done, std::size_t total)> progress = {};  // called after each tile or step
};

// One row per point that was asked about. Rows that did not get anywhere have the start, as far as it is known, and the
// chord 0.
struct Neighbors {
  Column<glm::vec3> locations;
  Column<glm::vec3> normals;               // unit; NaN where there is none
  Column<glm::vec3> directions;            // unit and tangent there: the direction, carried along
  Column<SurfaceCoordinates> coordinates;  // none for kinds without surface coordinates
  Column<float> chords;                    // |location - start|
  Column<WalkStatus> status;

  std::size_t size() const { return status.size(); }
};

// Paths as compressed rows: the rows of path i are offsets[i] .. offsets[i+1]-1, in order of steps. Every path has the
// row of step 0, where it starts; the last row's status says why a path ends before its last step.
struct Paths {
  Values<std::uint64_t> offsets;
  Values<std::uint32_t> steps;
  Values<WalkStatus> status;
  Values<glm::vec3> locations;
  Values<SurfaceCoordinates> coordinates;  // none for kinds without surface coordinates

  std::size_t size() const { return offsets.empty() ? 0 : offsets.size() - 1; }
};

}  // namespace smurf
