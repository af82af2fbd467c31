// Functions by kind of field, made from kinds.def.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "flows/definition.hpp"

namespace smurf {

class Executor;
class ReferenceFlow;
class ResidentFlow;

using FlowReader = std::shared_ptr<const VectorFieldDefinition> (*)(const nlohmann::json&, std::string_view path,
                                                                    const std::filesystem::path& folder);
using FlowFileReader = std::shared_ptr<const VectorFieldDefinition> (*)(const std::filesystem::path& file);

std::unique_ptr<ResidentFlow> reside(const VectorFieldDefinition& definition, Executor& executor,
                                     const PrepareOptions& options);
std::shared_ptr<const ReferenceFlow> refer(const VectorFieldDefinition& definition);
// Also what "source" takes for its "vector".
std::shared_ptr<const VectorFieldDefinition> read_expression_flow(const nlohmann::json& field, std::string_view path,
                                                                  const std::filesystem::path& folder);
const std::map<std::string, FlowReader>& flow_readers();
const std::map<std::string, FlowFileReader>& flow_file_readers();

// The field that stands at `path` in a description, for stream surfaces ("field").
std::shared_ptr<const VectorFieldDefinition> read_flow(const nlohmann::json& object, std::string_view path,
                                                       const std::filesystem::path& folder);

}  // namespace smurf
