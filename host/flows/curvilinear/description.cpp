// Vector fields on curvilinear and rectilinear grids from a description.
#include <cmath>

#include "flows/vector_files.hpp"
#include "io/description.hpp"
#include "io/plot3d.hpp"
#include "io/volumes/nrrd_vectors.hpp"
#include "io/volumes/volume_files.hpp"
#include "smurf/error.hpp"

namespace smurf {

using description::join;
using nlohmann::json;

namespace {

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::input, message); }

// Members that belong to another way of giving a field.
void refuse_members(const json& object, std::string_view path, std::initializer_list<std::string_view> members,
                    std::string_view beside) {
  for (const std::string_view member : members) {
    if (object.contains(std::string(member)))
      fail(fmt::format("member \"{}\" does not go with \"{}\"", join(path, member), join(path, beside)));
  }
}

double tolerance_member(const json& object, std::string_view path) {
  if (!object.contains("tolerance")) return 0;
  const double tolerance = description::number_member(object, path, "tolerance");
  if (!(tolerance > 0) || !std::isfinite(tolerance))
    fail(fmt::format("member \"{}\" must be positive, not {}", join(path, "tolerance"), tolerance));
  return tolerance;
}

std::array<std::vector<double>, 3> axes_member(const json& object, std::string_view path) {
  const json& value = description::member(object, path, "axes");
  const std::string name = join(path, "axes");
  if (!value.is_array() || value.size() != 3)
    fail(fmt::format("member \"{}\" must be three lists of coordinates, [[x, ...], [y, ...], [z, ...]], not {}", name,
                     description::shown(value)));
  std::array<std::vector<double>, 3> axes;
  for (std::size_t axis = 0; axis < 3; axis++) {
    const std::string list = fmt::format("{}[{}]", name, axis);
    if (!value[axis].is_array())
      fail(fmt::format("member \"{}\" must be a list of coordinates, not {}", list, description::shown(value[axis])));
    for (std::size_t i = 0; i < value[axis].size(); i++)
      axes[axis].push_back(description::constant(value[axis][i], fmt::format("{}[{}]", list, i)));
  }
  return axes;
}

}  // namespace

FlowDefinition read_curvilinear_flow(const json& object, std::string_view path, const std::filesystem::path& folder) {
  description::only_members(object, path,
                            {"kind", "file", "solution", "array", "points", "vectors", "reconstruction", "tolerance"});
  const VectorReconstruction reconstruction = reconstruction_member(object, path);
  const double tolerance = tolerance_member(object, path);
  const auto file_of = [&](std::string_view member) { return folder / description::text_member(object, path, member); };

  if (object.contains("points") || object.contains("vectors")) {
    refuse_members(object, path, {"file", "solution", "array"}, object.contains("points") ? "points" : "vectors");
    const auto points = file_of("points"), vectors = file_of("vectors");
    return description::named(path, "points", [&] {
      std::vector<CurvilinearBlock> blocks;
      blocks.push_back(read_nrrd_block(points, vectors));
      return curvilinear_flow(std::move(blocks), reconstruction, tolerance).share();
    });
  }
  const auto file = file_of("file");
  if (is_vtk_file(file)) {
    refuse_members(object, path, {"solution"}, "file");
    const std::string array = array_member(object, path);
    return description::named(path, "file", [&] {
      VtkVectors vectors = read_vtk_vectors(file, array);
      check_grid(file, vectors.grid, VtkGrid::structured);
      return structured_grid_flow(std::move(vectors), reconstruction, tolerance);
    });
  }
  if (!object.contains("solution"))
    fail(
        fmt::format("member \"{}\" is missing: a PLOT3D grid needs the file of its solution; .vts and .vtk files hold "
                    "points and vectors",
                    join(path, "solution")));
  refuse_members(object, path, {"array"}, "solution");
  const auto solution = file_of("solution");
  return description::named(path, "file", [&] {
    Plot3d plot3d = read_plot3d(file, solution);
    return with_notes(curvilinear_flow(std::move(plot3d.blocks), reconstruction, tolerance), std::move(plot3d.layout));
  });
}

FlowDefinition read_rectilinear_flow(const json& object, std::string_view path, const std::filesystem::path& folder) {
  description::only_members(object, path, {"kind", "file", "array", "axes", "vectors", "reconstruction"});
  const VectorReconstruction reconstruction = reconstruction_member(object, path);
  if (object.contains("axes") || object.contains("vectors")) {
    refuse_members(object, path, {"file", "array"}, object.contains("axes") ? "axes" : "vectors");
    const auto axes = axes_member(object, path);
    const auto file = folder / description::text_member(object, path, "vectors");
    return description::named(path, "vectors", [&] {
      VectorGrid grid = read_nrrd_vectors(file);
      if (glm::ivec3(axes[0].size(), axes[1].size(), axes[2].size()) != grid.size)
        fail(fmt::format("\"{}\": {}x{}x{} vectors, but the axes have {}x{}x{} coordinates; they must agree",
                         file.string(), grid.size.x, grid.size.y, grid.size.z, axes[0].size(), axes[1].size(),
                         axes[2].size()));
      return rectilinear_flow(axes, std::move(grid.vectors), reconstruction).share();
    });
  }
  const std::string array = array_member(object, path);
  const auto file = folder / description::text_member(object, path, "file");
  return description::named(path, "file", [&] {
    if (!is_vtk_file(file))
      fail(
          fmt::format("\"{}\": rectilinear grids are read from .vtr and .vtk files, or given as \"axes\" with "
                      "\"vectors\"",
                      file.string()));
    VtkVectors vectors = read_vtk_vectors(file, array);
    check_grid(file, vectors.grid, VtkGrid::rectilinear);
    return rectilinear_grid_flow(std::move(vectors), reconstruction);
  });
}

}  // namespace smurf
