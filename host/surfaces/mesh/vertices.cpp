#include "surfaces/mesh/vertices.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "kernels/mesh/layout.inc"
#include "surfaces/mesh/rings.hpp"

namespace smurf {

MeshRingTables make_rings(Executor& executor, const Mesh& mesh, float unit) {
  const std::size_t count = mesh.vertex_count();
  const auto share = [&](const auto& values, std::string_view purpose) {
    return executor.share(values.data(), values.size() * sizeof(values[0]), purpose);
  };
  MeshRingTables tables;
  tables.made = corners_by_vertex(mesh, unit);
  tables.corners = share(tables.made.corners, "triangles about the vertices of a mesh");
  const std::string_view purpose = "fans of the vertices of a mesh";
  tables.fans = TypedBuffer<std::uint32_t>(executor, MESH_FAN_WORDS * count, purpose);
  tables.sizes = TypedBuffer<std::uint32_t>(executor, count, purpose);
  launch(
      executor, Program{KernelId::mesh_fans, {}, {}},
      arguments::mesh_fans{
          .corners = tables.corners.get(), .fans = tables.fans.get(), .sizes = tables.sizes.get(), .count = int(count)},
      count);
  const TypedBuffer<std::uint32_t> ring_sizes(executor, count, "sizes of the rings of a mesh");
  launch(executor, Program{KernelId::mesh_ring_sizes, {}, {}},
         arguments::mesh_ring_sizes{
             .fans = tables.fans.get(), .sizes = tables.sizes.get(), .rings = ring_sizes.get(), .count = int(count)},
         count);
  Values<std::uint32_t> sizes(count);
  ring_sizes.read(sizes);
  tables.planned = plan_rings(mesh, tables.made, sizes);
  tables.places = share(tables.made.places, "places of the vertices of a mesh");
  tables.plan = share(tables.planned.plan, "neighbours of the vertices of a mesh");
  tables.rings =
      TypedBuffer<std::uint32_t>(executor, tables.planned.ring_words, "neighbours of the vertices of a mesh");
  launch(executor, Program{KernelId::mesh_rings, {}, {}},
         arguments::mesh_rings{
             .fans = tables.fans.get(),
             .sizes = tables.sizes.get(),
             .plan = tables.plan.get(),
             .rings = tables.rings.get(),
             .count = int(count),
         },
         count);
  return tables;
}

TypedBuffer<std::uint32_t> make_vertices(Executor& executor, const Mesh& mesh, float unit,
                                         const std::function<void(DeviceBuffer* vertices)>& queue) {
  const std::size_t count = mesh.vertex_count();
  // Before anything is queued: afterwards the device may keep all cores busy, and would wait for what is queued next.
  TypedBuffer<std::uint32_t> vertices(executor, MESH_VERTEX_WORDS * count, "vertices of a mesh");
  const TypedBuffer<float> fits(executor, 4 * count, "fits at the vertices of a mesh");
  const MeshRingTables tables = make_rings(executor, mesh, unit);
  const glm::vec3 size = unit * mesh.upper() - unit * mesh.lower();
  const float extent = std::max({size.x, size.y, size.z});
  const auto scale = std::bit_cast<std::int32_t>(std::ldexp(1.0f, std::clamp(-std::ilogb(extent), -126, 126)));
  launch(executor, Program{KernelId::mesh_normals, {}, {}},
         arguments::mesh_normals{.places = tables.places.get(),
                                 .rings = tables.rings.get(),
                                 .vertices = vertices.get(),
                                 .fits = fits.get(),
                                 .count = int(count),
                                 .scale = scale},
         count);
  launch(executor, Program{KernelId::mesh_tensors, {}, {}},
         arguments::mesh_tensors{.places = tables.places.get(),
                                 .rings = tables.rings.get(),
                                 .fits = fits.get(),
                                 .vertices = vertices.get(),
                                 .count = int(count),
                                 .scale = scale},
         count);
  if (queue) queue(vertices.get());
  executor.finish();
  return vertices;
}

}  // namespace smurf
