// Rays and points from CSV files (RAYS.csv and POINTS.csv of the program).
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <string_view>
#include <vector>

#include "smurf/interrogator.hpp"
#include "smurf/rays.hpp"

namespace smurf {

// Columns ox, oy, oz, dx, dy, dz and optionally tmin (0), tmax (infinity). Rays that cannot be cast (a zero
// direction, tmin > tmax) are read as they stand. Throws Error (input) as read_csv does.
RayBatch read_rays(const std::filesystem::path& file);

struct PointTable {
  std::vector<glm::vec3> points;
  std::vector<SurfaceCoordinates> places;  // in place of points
  std::vector<glm::vec3> directions;       // one per point, or none when the file has no dx, dy, dz
  bool has_directions = false;
};

// Columns x, y, z and optionally dx, dy, dz (all or none); or, for kinds with surface coordinates, of which `names`
// says what part, u and v are called, these columns.
PointTable read_points(const std::filesystem::path& file, const std::vector<std::string_view>& names = {});

}  // namespace smurf
