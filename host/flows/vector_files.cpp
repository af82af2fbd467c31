#include "flows/vector_files.hpp"

#include <fmt/format.h>

#include <limits>
#include <utility>

#include "io/description.hpp"
#include "io/volumes/nrrd_vectors.hpp"
#include "io/volumes/volume_files.hpp"
#include "smurf/error.hpp"

namespace smurf {

using nlohmann::json;
using std::filesystem::path;

VectorReconstruction reconstruction_member(const json& object, std::string_view path) {
  if (!object.contains("reconstruction")) return VectorReconstruction::trilinear;
  const std::string name = description::text_member(object, path, "reconstruction");
  if (name == "trilinear") return VectorReconstruction::trilinear;
  if (name == "tricubic") return VectorReconstruction::tricubic;
  throw Error(ErrorCode::input, fmt::format("member \"{}\": \"{}\" is no known reconstruction of vectors; known are "
                                            "trilinear, tricubic",
                                            description::join(path, "reconstruction"), name));
}

std::string array_member(const json& object, std::string_view path) {
  return object.contains("array") ? description::text_member(object, path, "array") : "";
}

FlowDefinition with_notes(const VectorField& field, std::vector<Fact> notes) {
  field.share()->set_notes(std::move(notes));
  return field.share();
}

namespace {

// For kinds that know of no blanking: a vector that is not finite makes the cells about it undefined.
void spoil_blanked(VtkVectors& vectors) {
  for (std::size_t i = 0; i < vectors.blanked.size(); i++) {
    if (vectors.blanked[i] != 0) vectors.vectors[i] = glm::vec3(std::numeric_limits<float>::quiet_NaN());
  }
}

std::string_view name_of(VtkGrid grid) {
  switch (grid) {
    case VtkGrid::image:
      return "regular";
    case VtkGrid::rectilinear:
      return "rectilinear";
    case VtkGrid::structured:
      return "structured (curvilinear)";
  }
  return "unknown";
}

std::string_view kind_of(VtkGrid grid) {
  switch (grid) {
    case VtkGrid::image:
      return "grid";
    case VtkGrid::rectilinear:
      return "rectilinear";
    case VtkGrid::structured:
      return "curvilinear";
  }
  return "unknown";
}

}  // namespace

FlowDefinition image_flow(VtkVectors vectors, VectorReconstruction reconstruction) {
  spoil_blanked(vectors);
  return with_notes(grid_flow({vectors.size, vectors.placement, std::move(vectors.vectors)}, reconstruction),
                    std::move(vectors.notes));
}

FlowDefinition rectilinear_grid_flow(VtkVectors vectors, VectorReconstruction reconstruction) {
  spoil_blanked(vectors);
  return with_notes(rectilinear_flow(vectors.axes, std::move(vectors.vectors), reconstruction),
                    std::move(vectors.notes));
}

FlowDefinition structured_grid_flow(VtkVectors vectors, VectorReconstruction reconstruction, double tolerance) {
  std::vector<CurvilinearBlock> blocks(1);
  blocks[0] = {vectors.size, std::move(vectors.points), std::move(vectors.vectors), std::move(vectors.blanked)};
  return with_notes(curvilinear_flow(std::move(blocks), reconstruction, tolerance), std::move(vectors.notes));
}

void check_grid(const path& file, VtkGrid there, VtkGrid wanted) {
  if (there == wanted) return;
  throw Error(ErrorCode::input, fmt::format("\"{}\": holds a {} grid, which \"kind\": \"{}\" reads, not a {} one",
                                            file.string(), name_of(there), kind_of(there), name_of(wanted)));
}

FlowDefinition read_vector_file(const path& file) {
  try {
    if (!is_vtk_file(file)) return grid_flow(read_nrrd_vectors(file)).share();
    VtkVectors vectors = read_vtk_vectors(file, "");
    if (vectors.grid == VtkGrid::image) return image_flow(std::move(vectors), VectorReconstruction::trilinear);
    if (vectors.grid == VtkGrid::rectilinear)
      return rectilinear_grid_flow(std::move(vectors), VectorReconstruction::trilinear);
    return structured_grid_flow(std::move(vectors), VectorReconstruction::trilinear, 0);
  } catch (const Error& error) {
    description::fail_in(file, error);
  }
}

bool file_has_vectors(const path& file) {
  const std::string ending = description::ending_of(file);
  if (ending == ".vtr" || ending == ".vts") return true;  // no kind of surface reads them
  try {
    return is_vtk_file(file) ? vtk_has_vectors(file) : nrrd_has_vectors(file);
  } catch (const Error&) {
    return is_vtk_file(file);
  }
}

}  // namespace smurf
