// A libFuzzer target for what reads meshes: OFF, OBJ, PLY and STL. The first byte says which format, and whether
// vertices are welded. What is accepted must hold together. Only an Error may leave, of one line.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "io/mesh_file.hpp"
#include "meshes/builder.hpp"
#include "smurf/error.hpp"

namespace {

using namespace smurf;

void require(bool condition) {
  if (!condition) std::abort();
}

void check(const Mesh& mesh) {
  const MeshRepairs& r = mesh.repairs();
  require(mesh.face_count() > 0 && mesh.source_faces().size() == mesh.face_count());
  require(mesh.source_face_count() >= r.small_faces);
  for (std::size_t i = 0; i < mesh.face_count(); i++) {
    require(mesh.source_faces()[i] < mesh.source_face_count());
    for (int k = 0; k < 3; k++) {
      require(mesh.faces()[i][k] < mesh.vertex_count());
      const glm::vec3 v = mesh.vertices()[mesh.faces()[i][k]];
      for (int axis = 0; axis < 3; axis++) require(v[axis] >= mesh.lower()[axis] && v[axis] <= mesh.upper()[axis]);
    }
  }
  // No face is lost in silence: each is there, or counted.
  if (r.polygons_split == 0)
    require(mesh.face_count() + r.small_faces + r.repeated_corners + r.zero_area == mesh.source_face_count());
  const MeshTopology& t = mesh.topology();
  require(t.faces == mesh.face_count() && t.vertices + r.unreferenced_vertices == mesh.vertex_count());
  require(t.euler_characteristic == std::int64_t(t.vertices) - std::int64_t(t.edges) + std::int64_t(t.faces));
  require(std::isfinite(t.area) && t.area >= 0);  // that of a needle may be lost to rounding
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  using Reader = Polygons (*)(const std::filesystem::path&, const std::string&);
  static constexpr Reader readers[] = {read_off, read_obj, read_ply, read_stl};
  const int format = data[0] % 4;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  static const std::filesystem::path file = "fuzz";
  try {
    check(MeshBuilder::build(readers[format](file, bytes), {.weld = data[0] % 8 >= 4}, "\"fuzz\""));
  } catch (const Error& error) {
    require(error.code() == ErrorCode::input);
    require(std::string_view(error.what()).find_first_of("\r\n") == std::string_view::npos);
    require(std::string_view(error.what()).size() < 2000);
  }
  return 0;
}
