// What is done with a surface of any kind: made resident on a device, handed to the reference, read from a description.
// Nothing else tells kinds apart (kinds.def is the list).
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "surfaces/surface_definition.hpp"

namespace smurf {

class Executor;
class ReferenceSurface;
class ResidentSurface;
struct PrepareOptions;

// Uploads the surface and compiles what it takes. Throws Error (memory) that says how much was needed.
std::unique_ptr<ResidentSurface> reside(const SurfaceDefinition& definition, Executor& executor,
                                        const PrepareOptions& options);

// The surface in double precision. Throws Error (usage) where the kind knows no more than its device source.
std::shared_ptr<const ReferenceSurface> refer(const SurfaceDefinition& definition);

// Reads the description of one kind; `folder` resolves file names. Throws Error (input) that names the member.
using SurfaceReader =
    std::function<std::shared_ptr<const SurfaceDefinition>(const nlohmann::json&, const std::filesystem::path& folder)>;
const std::map<std::string, SurfaceReader>& surface_readers();

// Reads the field of an isosurface: the surface field = isovalue.
using IsosurfaceReader = std::function<std::shared_ptr<const SurfaceDefinition>(
    const nlohmann::json& field, const std::filesystem::path& folder, double isovalue)>;
const std::map<std::string, IsosurfaceReader>& isosurface_readers();

// Reads a file of data that stands where a description is expected. Throws Error (input) that names the file.
using DataFileReader = std::function<std::shared_ptr<const SurfaceDefinition>(const std::filesystem::path& file)>;
const std::map<std::string, DataFileReader>& data_file_readers();    // by the end of its name, in small letters
const std::map<std::string, DataFileReader>& data_member_readers();  // by a member of a JSON object without "kind"

}  // namespace smurf
