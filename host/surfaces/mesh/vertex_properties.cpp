// Properties at the vertices of a mesh.
#include <fmt/format.h>

#include <array>
#include <limits>

#include "device/embedded_sources.hpp"
#include "device/executor.hpp"
#include "kernels/mesh/layout.inc"
#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "surfaces/mesh/definition.hpp"
#include "surfaces/mesh/rings.hpp"
#include "surfaces/mesh/vertices.hpp"
#include "surfaces/property_columns.hpp"
#include "surfaces/queries.hpp"
#include "surfaces/record_answers.hpp"

namespace smurf {
namespace {

constexpr std::uint32_t answerable =
    Property::normal | Property::gauss | Property::mean | Property::principal | Property::directions;
constexpr std::uint32_t no_face = std::numeric_limits<std::uint32_t>::max();

PointProperties on_device(Executor& executor, const Mesh& mesh, std::uint32_t wanted) {
  const std::size_t count = mesh.vertex_count();
  // The kernel that measures points, asked for part i at point i.
  Values<SurfaceCoordinates> numbers(count);
  for (std::size_t i = 0; i < count; i++) numbers[i] = {std::uint32_t(i), 0.0f, 0.0f};
  const auto words = std::make_shared<Values<std::uint32_t>>(count * words_per_point(wanted));
  const std::size_t bytes = words->size() * sizeof(std::uint32_t);
  const float unit = mesh_unit(mesh);
  std::array<float, MESH_UNIFORM_WORDS> numbers_of_mesh{};
  numbers_of_mesh[MESH_UNIT] = unit;
  const auto uniforms = executor.share(numbers_of_mesh.data(), sizeof numbers_of_mesh, "surface uniforms");
  const auto points = executor.share(mesh.vertices().data(), mesh.vertices().size_bytes(), "points");
  const auto coordinates =
      executor.share(numbers.data(), numbers.size() * sizeof(SurfaceCoordinates), "surface coordinates");
  auto columns = executor.share_results(words->data(), bytes, "properties");
  const bool is_shared = columns != nullptr;
  if (!is_shared) columns = executor.allocate(bytes, "properties");
  make_vertices(executor, mesh, unit, [&](DeviceBuffer* vertices) {
    launch(executor,
           Program{KernelId::measure,
                   {{"surface", std::string(kernel_source("mesh/vertex_surface.inc"))}},
                   {{"COORDINATES", "1"}, {"CURVATURE", wanted == std::uint32_t(Property::normal) ? "0" : "1"}},
                   {{"surface", {"uniforms", "vertices"}}}},
           arguments::measure{.surface = {{"uniforms", uniforms.get()}, {"vertices", vertices}},
                              .points = points.get(),
                              .coordinates = coordinates.get(),
                              .columns = columns.get(),
                              .end = int(count),
                              .stride = int(count),
                              .wanted = int(wanted)},
           count);
  });
  if (!is_shared) executor.read(*columns, 0, words->data(), bytes);
  columns.reset();
  PointProperties out;
  take_columns(words, count, wanted, out);
  return out;
}

// At a corner of a triangle each; vertices of no triangle are on no part of the surface.
PointProperties on_reference(const Mesh& mesh, std::uint32_t wanted) {
  Values<SurfaceCoordinates> corners(mesh.vertex_count(), {no_face, 0.0f, 0.0f});
  std::uint32_t number = 0;
  for (const glm::uvec3& face : mesh.faces()) {
    for (int k = 0; k < 3; k++) corners[face[k]] = {number, k == 1 ? 1.0f : 0.0f, k == 2 ? 1.0f : 0.0f};
    number++;
  }
  PointProperties out;
  const MeshSurface surface(mesh, MeshNormals::interpolated, false);
  interrogate_by_reference(surface)->measure({mesh.vertices(), corners, {}}, wanted, {}, out);
  return out;
}

}  // namespace

PointProperties vertex_properties(const Device& device, const Mesh& mesh, std::uint32_t properties) {
  if ((properties & ~answerable) != 0) {
    throw Error(ErrorCode::usage,
                fmt::format("property bits {:#x} cannot be asked of vertices; normal, gauss, mean, principal and "
                            "directions can",
                            properties & ~answerable));
  }
  PointProperties out =
      device.is_reference() ? on_reference(mesh, properties) : on_device(device.executor(), mesh, properties);
  record_properties("vertices of a mesh", device, {mesh.vertices(), {}, {}}, properties, out);
  return out;
}

}  // namespace smurf
