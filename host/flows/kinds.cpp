// Tables of functions by kind of field, made from kinds.def, and descriptions of fields.
#include "flows/kinds.hpp"

#include <fmt/format.h>

#include <bit>

#include "flows/resident_flow.hpp"
#include "flows/vector_files.hpp"
#include "io/description.hpp"
#include "smurf/error.hpp"

namespace smurf {

using nlohmann::json;

#define FLOW_KIND(name)                                                                                               \
  std::unique_ptr<ResidentFlow> reside_##name##_flow(const VectorFieldDefinition&, Executor&, const PrepareOptions&); \
  std::shared_ptr<const ReferenceFlow> refer_##name##_flow(const VectorFieldDefinition&);
#define FLOW_DESCRIPTION(kind, read) \
  std::shared_ptr<const VectorFieldDefinition> read(const json&, std::string_view, const std::filesystem::path&);
#define FLOW_FILE(ending, read) std::shared_ptr<const VectorFieldDefinition> read(const std::filesystem::path&);
#include "flows/kinds.def"

std::unique_ptr<ResidentFlow> reside(const VectorFieldDefinition& definition, Executor& executor,
                                     const PrepareOptions& options) {
  static constexpr std::unique_ptr<ResidentFlow> (*kinds[])(const VectorFieldDefinition&, Executor&,
                                                            const PrepareOptions&) = {
#define FLOW_KIND(name) reside_##name##_flow,
#include "flows/kinds.def"
  };
  return kinds[std::size_t(definition.family)](definition, executor, options);
}

std::shared_ptr<const ReferenceFlow> refer(const VectorFieldDefinition& definition) {
  static constexpr std::shared_ptr<const ReferenceFlow> (*kinds[])(const VectorFieldDefinition&) = {
#define FLOW_KIND(name) refer_##name##_flow,
#include "flows/kinds.def"
  };
  return kinds[std::size_t(definition.family)](definition);
}

const std::map<std::string, FlowReader>& flow_readers() {
  static const std::map<std::string, FlowReader> readers{
#define FLOW_DESCRIPTION(kind, read) {kind, read},
#include "flows/kinds.def"
  };
  return readers;
}

const std::map<std::string, FlowFileReader>& flow_file_readers() {
  static const std::map<std::string, FlowFileReader> readers{
#define FLOW_FILE(ending, read) {ending, read},
#include "flows/kinds.def"
  };
  return readers;
}

void put_flow_domain(const Domain& domain, std::span<std::uint32_t> words) {
  for (int axis = 0; axis < 3; axis++) {
    words[std::size_t(axis)] = std::bit_cast<std::uint32_t>(float(domain.lower[axis]));
    words[3 + std::size_t(axis)] = std::bit_cast<std::uint32_t>(float(domain.upper[axis]));
  }
  words[6] = std::bit_cast<std::uint32_t>(float(domain.radius));
}

std::string_view VectorField::kind() const { return model_->kind(); }
Bounds VectorField::bounds() const { return model_->bounds(); }

std::shared_ptr<const VectorFieldDefinition> read_flow(const json& object, std::string_view path,
                                                       const std::filesystem::path& folder) {
  return description::reader_of(flow_readers(), object, path, "vector fields")(object, path, folder);
}

VectorField load_vector_field(const std::filesystem::path& file) {
  const auto data = flow_file_readers().find(description::ending_of(file));
  if (data != flow_file_readers().end()) return VectorField(data->second(file));
  try {
    const json root = description::parse(file, "the description of a vector field");
    if (!root.is_object())
      throw Error(ErrorCode::input,
                  "the description of a vector field is a JSON object, not " + description::shown(root));
    const bool of_surface = root.contains("kind") && root["kind"] == "stream";
    if (!of_surface) return VectorField(read_flow(root, "", file.parent_path()));
    return VectorField(read_flow(description::object_member(root, "", "field"), "field", file.parent_path()));
  } catch (const Error& error) {
    description::fail_in(file, error);
  }
}

bool is_vector_field(const std::filesystem::path& file) {
  const std::string ending = description::ending_of(file);
  if (flow_file_readers().contains(ending)) return file_has_vectors(file);
  if (ending != ".json") return false;
  try {
    const json root = description::parse(file, "a description");
    return root.is_object() && root.contains("kind") && root["kind"].is_string() &&
           flow_readers().contains(root["kind"].get<std::string>());
  } catch (const Error&) {
    return false;  // load_surface says what is wrong
  }
}

}  // namespace smurf
