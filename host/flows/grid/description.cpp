// Vector fields on regular grids from a description.
#include "io/description.hpp"
#include "flows/vector_files.hpp"
#include "io/volumes/nrrd_vectors.hpp"
#include "io/volumes/volume_files.hpp"
#include "smurf/error.hpp"

namespace smurf {

FlowDefinition read_grid_flow(const nlohmann::json& object, std::string_view path,
                              const std::filesystem::path& folder) {
  description::only_members(object, path, {"kind", "file", "array", "reconstruction"});
  const VectorReconstruction reconstruction = reconstruction_member(object, path);
  const std::string array = array_member(object, path);
  const std::filesystem::path file = folder / description::text_member(object, path, "file");
  return description::named(path, "file", [&]() -> FlowDefinition {
    if (is_vtk_file(file)) {
      VtkVectors vectors = read_vtk_vectors(file, array);
      check_grid(file, vectors.grid, VtkGrid::image);
      return image_flow(std::move(vectors), reconstruction);
    }
    if (!array.empty())
      throw Error(ErrorCode::input, fmt::format("\"{}\": array \"{}\" is asked for, but files of this kind have no "
                                                "arrays by name; VTK files do",
                                                file.string(), array));
    return grid_flow(read_nrrd_vectors(file), reconstruction).share();
  });
}

}  // namespace smurf
