// What a surface kind provides. One file per kind in this folder; nothing else switches over kinds.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "device/executor.hpp"
#include "expression/line_roots.hpp"
#include "smurf/surface.hpp"
#include "surfaces/queries.hpp"

namespace smurf {

// A surface's buffers on one device and the source that answers for it.
// The source module "surface" defines Surface, surface_open, surface_find_hits and surface_frame, as
// kernels/grid/surface.inc does, and for kinds with coordinates surface_nearest_to.
class ResidentSurface {
 public:
  virtual ~ResidentSurface() = default;
  // Source modules by the name under which kernels include them; always "surface".
  virtual const std::map<std::string, std::string>& modules() const = 0;
  virtual const std::map<std::string, std::string>& defines() const = 0;
  virtual DeviceBuffer* uniforms() const = 0;
  virtual std::vector<DeviceBuffer*> buffers() const = 0;  // surface_a .. surface_d, at most 4
  virtual std::size_t bytes() const = 0;
  // Called before properties are measured: what only they need may be made now.
  virtual void prepare_properties() {}
  // Takes over another surface of the same kind over the same field; false if it cannot.
  virtual bool update(const SurfaceDefinition& model) = 0;
};

// A line of `smurf info`.
struct Fact {
  std::string name, value;
};

// The function of space that a surface is a level set of, in double; NaN where it is undefined. Normals point to
// smaller values.
struct AnalyticField {
  std::function<double(const glm::dvec3&)> value;  // may be called by threads at once
  double level = 0;
  Domain domain;
};

// Adds what double precision knows of a surface's roots on a ray, for t in [low, high], in order. May be called by
// threads at once.
using RootResolver =
    std::function<void(const Ray& ray, double low, double high, std::vector<expression::LineRoot>& roots)>;

class SurfaceDefinition {
 public:
  virtual ~SurfaceDefinition() = default;
  virtual std::string_view kind() const = 0;
  virtual Bounds bounds() const = 0;
  virtual std::uint32_t properties() const = 0;  // Property bits that this kind can answer
  // Whether hits have SurfaceCoordinates; their order along the ray is then made by the stage that orders rows.
  virtual bool has_coordinates() const { return false; }
  virtual std::vector<Fact> facts() const = 0;
  virtual std::unique_ptr<ResidentSurface> reside(Executor& executor, const PrepareOptions& options) const = 0;
  virtual std::unique_ptr<SurfaceQueries> reference() const = 0;  // host/reference
  // For kinds that can tell more of roots than their device code does, which is asked about hits that it flags
  // (host/api/resolve_hits.hpp).
  virtual RootResolver root_resolver() const { return {}; }
  // For kinds that are given by an expression.
  virtual std::optional<AnalyticField> analytic_field() const { return std::nullopt; }
};

// Reads the description of one kind; `folder` resolves file names.
using SurfaceReader =
    std::function<std::shared_ptr<const SurfaceDefinition>(const nlohmann::json&, const std::filesystem::path& folder)>;
// The list of kinds that descriptions can name: "isosurface" -> reader. One line per kind, in description.cpp.
const std::map<std::string, SurfaceReader>& surface_readers();

std::shared_ptr<const SurfaceDefinition> read_implicit(const nlohmann::json& description,
                                                       const std::filesystem::path& folder);
std::shared_ptr<const SurfaceDefinition> read_mesh(const nlohmann::json& description,
                                                   const std::filesystem::path& folder);
std::shared_ptr<const SurfaceDefinition> read_isosurface(const nlohmann::json& description,
                                                         const std::filesystem::path& folder);
// The isosurface of a field of kind "expression".
std::shared_ptr<const SurfaceDefinition> read_expression_isosurface(const nlohmann::json& field,
                                                                    const std::filesystem::path& folder,
                                                                    double isovalue);

}  // namespace smurf
