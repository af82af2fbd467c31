// Vector fields from files of data, and members that descriptions of grids share.
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "flows/definition.hpp"
#include "io/vtk/vtk_files.hpp"

namespace smurf {

using FlowDefinition = std::shared_ptr<const VectorFieldDefinition>;

// "reconstruction": trilinear where it is missing.
VectorReconstruction reconstruction_member(const nlohmann::json& object, std::string_view path);
// "array": empty where it is missing.
std::string array_member(const nlohmann::json& object, std::string_view path);

// The field with notes on how it was read.
FlowDefinition with_notes(const VectorField& field, std::vector<Fact> notes);

// Fields of what a VTK file holds. Nodes that are hidden have no vectors, or are blanked where the kind knows of it.
FlowDefinition image_flow(VtkVectors vectors, VectorReconstruction reconstruction);
FlowDefinition rectilinear_grid_flow(VtkVectors vectors, VectorReconstruction reconstruction);
FlowDefinition structured_grid_flow(VtkVectors vectors, VectorReconstruction reconstruction, double tolerance);

// Throws Error (input) unless the file holds a grid that `kind` reads.
void check_grid(const std::filesystem::path& file, VtkGrid there, VtkGrid wanted);

// Whether a file that load_vector_field reads holds vectors, rather than scalars alone. True where that cannot be told
// of a VTK file: what reads it says why.
bool file_has_vectors(const std::filesystem::path& file);

}  // namespace smurf
