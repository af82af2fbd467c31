// Kinds of fields that are not there yet; this file goes with the last of them.
#include "flows/kinds.hpp"
#include "flows/queries.hpp"
#include "flows/resident_flow.hpp"
#include "smurf/error.hpp"

#if !__has_include("reference/flow/queries.cpp")
namespace smurf {
class ReferenceFlow {};
}  // namespace smurf
#endif

namespace smurf {

#if !__has_include("flows/grid/resident.cpp")
std::unique_ptr<ResidentFlow> reside_grid_flow(const VectorFieldDefinition&, Executor&, const PrepareOptions&) {
  throw Error(ErrorCode::usage, "grid fields cannot be traced yet");
}
#endif
#if !__has_include("reference/flow/queries.cpp")
std::shared_ptr<const ReferenceFlow> refer_grid_flow(const VectorFieldDefinition&) {
  throw Error(ErrorCode::usage, "there is no reference for flows yet");
}
#endif
#if !__has_include("flows/curvilinear/resident.cpp")
std::unique_ptr<ResidentFlow> reside_curvilinear_flow(const VectorFieldDefinition&, Executor&, const PrepareOptions&) {
  throw Error(ErrorCode::usage, "curvilinear fields cannot be traced yet");
}
#endif
#if !__has_include("reference/flow/queries.cpp")
std::shared_ptr<const ReferenceFlow> refer_curvilinear_flow(const VectorFieldDefinition&) {
  throw Error(ErrorCode::usage, "there is no reference for flows yet");
}
#endif
#if !__has_include("reference/flow/queries.cpp")
std::shared_ptr<const ReferenceFlow> refer_expression_flow(const VectorFieldDefinition&) {
  throw Error(ErrorCode::usage, "there is no reference for flows yet");
}
#endif
#if !__has_include("reference/flow/queries.cpp")
std::shared_ptr<const ReferenceFlow> refer_source_flow(const VectorFieldDefinition&) {
  throw Error(ErrorCode::usage, "there is no reference for flows yet");
}
#endif
#if !__has_include("flows/grid/description.cpp")
std::shared_ptr<const VectorFieldDefinition> read_grid_flow(const nlohmann::json&, std::string_view,
                                                            const std::filesystem::path&) {
  throw Error(ErrorCode::usage, "such fields cannot be read yet");
}
#endif
#if !__has_include("flows/curvilinear/description.cpp")
std::shared_ptr<const VectorFieldDefinition> read_curvilinear_flow(const nlohmann::json&, std::string_view,
                                                                   const std::filesystem::path&) {
  throw Error(ErrorCode::usage, "such fields cannot be read yet");
}
#endif
#if !__has_include("flows/curvilinear/description.cpp")
std::shared_ptr<const VectorFieldDefinition> read_rectilinear_flow(const nlohmann::json&, std::string_view,
                                                                   const std::filesystem::path&) {
  throw Error(ErrorCode::usage, "such fields cannot be read yet");
}
#endif
#if !__has_include("reference/flow/queries.cpp")
std::unique_ptr<FlowQueries> trace_by_reference(const VectorFieldDefinition&) {
  throw Error(ErrorCode::usage, "there is no reference for flows yet");
}
#endif

}  // namespace smurf
