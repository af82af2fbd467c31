// Rays and points from CSV files (RAYS.csv and POINTS.csv of the program).
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <vector>

#include "smurf/rays.hpp"

namespace smurf {

// Columns ox, oy, oz, dx, dy, dz and optionally tmin (0), tmax (infinity). Rays that cannot be cast (a zero
// direction, tmin > tmax) are read as they stand. Throws Error (input) as read_csv does.
RayBatch read_rays(const std::filesystem::path& file);

struct PointTable {
  std::vector<glm::vec3> points;
  std::vector<glm::vec3> directions;  // one per point, or none when the file has no dx, dy, dz
  bool has_directions = false;
};

// Columns x, y, z and optionally dx, dy, dz (all or none).
PointTable read_points(const std::filesystem::path& file);

}  // namespace smurf
