// Readers of mesh files, one per format. Each takes the whole file and throws Error (input) that names it.
#pragma once

#include <filesystem>
#include <string>

#include "meshes/builder.hpp"

namespace smurf {

Polygons read_off(const std::filesystem::path& file, const std::string& text);
Polygons read_obj(const std::filesystem::path& file, const std::string& text);
Polygons read_ply(const std::filesystem::path& file, const std::string& bytes);
Polygons read_stl(const std::filesystem::path& file, const std::string& bytes);
Polygons read_by_assimp(const std::filesystem::path& file);

}  // namespace smurf
