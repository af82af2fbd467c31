// The worst offender of a case, as files and a command that asks about this one ray again.
#pragma once

#include <filesystem>
#include <string>

#include "smurf/mesh.hpp"
#include "smurf/rays.hpp"
#include "smurf/surface.hpp"
#include "smurf/volume.hpp"

namespace smurf::test {

// The folder that tests write to; created.
std::filesystem::path output_folder();

// Writes a volume as NRRD, and returns the file.
std::filesystem::path save_volume(const Volume& volume, const std::filesystem::path& file);

// Writes the surface (NRRD and JSON) and the ray (CSV) into the output folder, named by the case; returns the command
// line of the program that casts it on the device.
std::string replay_command(const std::string& name, const Volume& volume, double isovalue,
                           Reconstruction reconstruction, const Ray& ray, const std::string& device);

// The same for a mesh, which is written as OBJ.
std::string replay_command(const std::string& name, const Mesh& mesh, const Ray& ray, const std::string& device);

// The same for a surface whose description (JSON) stands for itself.
std::string replay_command(const std::string& name, const std::string& description, const Ray& ray,
                           const std::string& device);

}  // namespace smurf::test
