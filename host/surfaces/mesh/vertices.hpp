// Normals and curvature at the vertices of a mesh, made on a device.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "device/executor.hpp"
#include "smurf/mesh.hpp"
#include "surfaces/mesh/rings.hpp"

namespace smurf {

// The rings of a mesh's vertices on a device, and what they are made of; kept until what has been queued is done.
struct MeshRingTables {
  MeshCorners made;
  MeshRings planned;
  std::unique_ptr<DeviceBuffer> corners, places, plan;  // on the above, where the device can use the host's memory
  TypedBuffer<std::uint32_t> fans, sizes, rings;
};

// Queues what makes them, in lengths of 1 / `unit` (mesh_unit).
MeshRingTables make_rings(Executor& executor, const Mesh& mesh, float unit);

// In lengths of 1 / `unit`. MESH_VERTEX_WORDS a vertex, as kernels/mesh/layout.inc tells. While they are made, about
// 270 bytes a vertex more are taken.
// `queue` may launch what reads them, so that the device need not wait for the host in between.
TypedBuffer<std::uint32_t> make_vertices(Executor& executor, const Mesh& mesh, float unit,
                                         const std::function<void(DeviceBuffer* vertices)>& queue = {});

}  // namespace smurf
