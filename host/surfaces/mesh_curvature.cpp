#include "surfaces/mesh_curvature.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "mesh_parameters.inc"
#include "surfaces/mesh_vertices.hpp"

namespace smurf {

TypedBuffer<std::uint32_t> make_vertices(Executor& executor, const Mesh& mesh, float unit) {
  const std::size_t count = mesh.vertex_count();
  const auto share = [&](const Values<std::uint32_t>& words, std::string_view purpose) {
    return executor.share(words.data(), words.size() * sizeof(std::uint32_t), purpose);
  };
  const Values<std::uint32_t> corners = corners_by_vertex(mesh);
  const auto corner_table = share(corners, "triangles about the vertices of a mesh");
  const std::size_t slices = (count + MESH_SLICE - 1) / MESH_SLICE;
  const TypedBuffer<std::uint32_t> fans(executor, MESH_FAN_WORDS * count, "fans of the vertices of a mesh"),
      links(executor, MESH_FAN_MOST * MESH_SLICE * slices, "fans of the vertices of a mesh"),
      fan_places(executor, 3 * mesh.face_count(), "fans of the vertices of a mesh"),
      sizes(executor, count, "fans of the vertices of a mesh");
  launch(executor, Program{KernelId::mesh_fans, {}, {}},
         arguments::mesh_fans{.corners = corner_table.get(),
                              .fans = fans.get(),
                              .links = links.get(),
                              .fan_places = fan_places.get(),
                              .sizes = sizes.get(),
                              .count = int(count)},
         count);
  Values<std::uint32_t> fan_sizes(count);
  sizes.read(fan_sizes);
  const MeshRings tables = plan_rings(mesh, corners, fan_sizes, unit);
  const auto places = share(tables.places, "places of the vertices of a mesh");
  const auto plan = share(tables.plan, "neighbours of the vertices of a mesh");
  const TypedBuffer<std::uint32_t> rings(executor, tables.ring_words, "neighbours of the vertices of a mesh");
  launch(executor, Program{KernelId::mesh_rings, {}, {}},
         arguments::mesh_rings{.fans = fans.get(),
                               .links = links.get(),
                               .fan_places = fan_places.get(),
                               .sizes = sizes.get(),
                               .plan = plan.get(),
                               .rings = rings.get(),
                               .count = int(count)},
         count);
  TypedBuffer<std::uint32_t> vertices(executor, MESH_VERTEX_WORDS * count, "vertices of a mesh");
  const TypedBuffer<float> fits(executor, 4 * count, "fits at the vertices of a mesh");
  const glm::vec3 size = unit * mesh.upper() - unit * mesh.lower();
  const float extent = std::max({size.x, size.y, size.z});
  const auto scale = std::bit_cast<std::int32_t>(std::ldexp(1.0f, std::clamp(-std::ilogb(extent), -126, 126)));
  launch(executor, Program{KernelId::mesh_normals, {}, {}},
         arguments::mesh_normals{.places = places.get(),
                                 .rings = rings.get(),
                                 .vertices = vertices.get(),
                                 .fits = fits.get(),
                                 .count = int(count),
                                 .scale = scale},
         count);
  launch(executor, Program{KernelId::mesh_tensors, {}, {}},
         arguments::mesh_tensors{.places = places.get(),
                                 .rings = rings.get(),
                                 .fits = fits.get(),
                                 .vertices = vertices.get(),
                                 .count = int(count),
                                 .scale = scale},
         count);
  executor.finish();
  return vertices;
}

}  // namespace smurf
