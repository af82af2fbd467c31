// Triangles of an isosurface, for the peers that trace meshes: marching cubes with vertices on grid edges, shared
// between cells. It approximates the surface that smurf queries exactly; that is the comparison.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "smurf/volume.hpp"

namespace smurf::bench {

struct TriangleMesh {
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> triangles;
};

// Samples with i fastest. Triangles are counter-clockwise seen from the side of smaller values.
TriangleMesh isosurface_mesh(std::span<const float> samples, glm::ivec3 size, const GridPlacement& placement,
                             double isovalue);

// The samples of a volume as float.
std::vector<float> samples_as_float(const Volume& volume);

// A bumpy sphere of about `triangles` triangles, where no measured mesh is at hand.
TriangleMesh bumpy_sphere(std::size_t triangles);

// Reads an OFF file; polygons are cut into fans. Throws smurf::Error (input).
TriangleMesh load_off(const std::filesystem::path& file);

}  // namespace smurf::bench
