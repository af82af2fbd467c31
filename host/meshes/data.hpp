// What copies of a Mesh share.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "smurf/mesh.hpp"

namespace smurf {

struct MeshFacts {
  std::once_flag found;
  MeshTopology topology;
  std::vector<std::uint8_t> vertex_states;
};

struct Mesh::Data {
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;
  std::vector<std::uint32_t> source_faces;
  std::uint64_t source_face_count = 0;
  MeshRepairs repairs;
  glm::vec3 lower{0.0f}, upper{0.0f};
  std::unique_ptr<MeshFacts> facts = std::make_unique<MeshFacts>();
};

void find_topology(std::span<const glm::vec3> vertices, std::span<const glm::uvec3> faces, MeshTopology& topology,
                   std::vector<std::uint8_t>& vertex_states);

}  // namespace smurf
