// Tables of functions by kind, made from kinds.def. The kinds' own headers are not needed: each function takes the
// definition as its base and knows which one it is.
#include "surfaces/kinds.hpp"

#include "surfaces/resident_surface.hpp"

namespace smurf {

#define SURFACE_KIND(name)                                                                                    \
  std::unique_ptr<ResidentSurface> reside_##name(const SurfaceDefinition&, Executor&, const PrepareOptions&); \
  std::shared_ptr<const ReferenceSurface> refer_##name(const SurfaceDefinition&);
#define DESCRIPTION(kind, read) \
  std::shared_ptr<const SurfaceDefinition> read(const nlohmann::json&, const std::filesystem::path&);
#define ISOSURFACE_FIELD(kind, read) \
  std::shared_ptr<const SurfaceDefinition> read(const nlohmann::json&, const std::filesystem::path&, double);
#define DATA_FILE(ending, read) std::shared_ptr<const SurfaceDefinition> read(const std::filesystem::path&);
#define DATA_MEMBER(member, read) std::shared_ptr<const SurfaceDefinition> read(const std::filesystem::path&);
#include "surfaces/kinds.def"

std::unique_ptr<ResidentSurface> reside(const SurfaceDefinition& definition, Executor& executor,
                                        const PrepareOptions& options) {
  static constexpr decltype(&reside) kinds[] = {
#define SURFACE_KIND(name) reside_##name,
#include "surfaces/kinds.def"
  };
  return kinds[std::size_t(definition.family)](definition, executor, options);
}

std::shared_ptr<const ReferenceSurface> refer(const SurfaceDefinition& definition) {
  static constexpr decltype(&refer) kinds[] = {
#define SURFACE_KIND(name) refer_##name,
#include "surfaces/kinds.def"
  };
  return kinds[std::size_t(definition.family)](definition);
}

const std::map<std::string, SurfaceReader>& surface_readers() {
  static const std::map<std::string, SurfaceReader> readers{
#define DESCRIPTION(kind, read) {kind, read},
#include "surfaces/kinds.def"
  };
  return readers;
}

const std::map<std::string, IsosurfaceReader>& isosurface_readers() {
  static const std::map<std::string, IsosurfaceReader> readers{
#define ISOSURFACE_FIELD(kind, read) {kind, read},
#include "surfaces/kinds.def"
  };
  return readers;
}

const std::map<std::string, DataFileReader>& data_file_readers() {
  static const std::map<std::string, DataFileReader> readers{
#define DATA_FILE(ending, read) {ending, read},
#include "surfaces/kinds.def"
  };
  return readers;
}

const std::map<std::string, DataFileReader>& data_member_readers() {
  static const std::map<std::string, DataFileReader> readers{
#define DATA_MEMBER(member, read) {member, read},
#include "surfaces/kinds.def"
  };
  return readers;
}

}  // namespace smurf
