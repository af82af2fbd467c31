#include "surfaces/mesh_curvature.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "mesh_parameters.inc"
#include "surfaces/mesh_vertices.hpp"

namespace smurf {

TypedBuffer<std::uint32_t> make_vertices(Executor& executor, const Mesh& mesh, float unit) {
  const std::size_t count = mesh.vertex_count();
  const MeshVertices tables = vertices_of(mesh, unit);
  const auto share = [&](const Values<std::uint32_t>& words, std::string_view purpose) {
    return executor.share(words.data(), words.size() * sizeof(std::uint32_t), purpose);
  };
  const auto places = share(tables.places, "places of the vertices of a mesh");
  const auto rings = share(tables.rings, "neighbours of the vertices of a mesh");
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
