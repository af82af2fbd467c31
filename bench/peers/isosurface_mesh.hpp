// Triangles of an isosurface, for the peers that trace meshes: marching cubes with vertices on grid edges, shared
// between cells. It approximates the surface that smurf queries exactly; that is the comparison.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "smurf/mesh.hpp"
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

// Those of a mesh.
TriangleMesh triangles_of(const Mesh& mesh);

}  // namespace smurf::bench
