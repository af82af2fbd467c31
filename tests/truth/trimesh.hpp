// Rays and meshes of trimesh's tests (MIT), from the shared data, with what brute force finds in double: no ray passes
// within 1e-6 of an edge.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "smurf/rays.hpp"

namespace smurf::test {

struct TrimeshCase {
  std::string name;
  std::filesystem::path file;
  std::vector<glm::dvec3> origins, directions;
  std::vector<Ray> rays;  // the same, rounded to floats
  std::size_t rays_that_hit, crossings;
  double sum_of_nearest_t;
};

// None, loudly, where there is no shared data.
std::vector<TrimeshCase> trimesh_cases();

}  // namespace smurf::test
