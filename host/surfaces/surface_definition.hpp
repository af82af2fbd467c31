// A surface as the host knows it, whatever its kind: no device, no kernel, no reference. One class per kind derives
// from SurfaceDefinition (host/surfaces/<kind>/definition.hpp); what is done with it is in kinds.hpp.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "expression/line_roots.hpp"
#include "numerics/fact.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/surface.hpp"

namespace smurf {

enum class SurfaceKind {
#define SURFACE_KIND(name) name,
#include "surfaces/kinds.def"
};

// The function of space that a surface is a level set of, in double; NaN where it is undefined. Normals point to
// smaller values.
struct AnalyticField {
  std::function<double(const glm::dvec3&)> value;  // may be called by threads at once
  double level = 0;
  Domain domain;
};

// What is inside of a level set: where the field's value, as Property::value tells it, is beyond the level.
struct InsideOfLevel {
  double level;
  bool greater;
};

// A root on a ray, and for kinds with coordinates where on the surface it lies.
struct ResolvedRoot {
  expression::LineRoot root;
  SurfaceCoordinates coordinates = {};
  HitStatus of_one = HitStatus::isolated;  // what a hit is that stands for one root
};

// Adds what double precision knows of a surface's roots on a ray, for t in [low, high], in order. May be called by
// threads at once.
using RootResolver = std::function<void(const Ray& ray, double low, double high, std::vector<ResolvedRoot>& roots)>;

class SurfaceDefinition {
 public:
  explicit SurfaceDefinition(SurfaceKind the_family) : family(the_family) {}
  virtual ~SurfaceDefinition() = default;

  const SurfaceKind family;
  virtual std::string_view kind() const = 0;  // as descriptions name it
  virtual Bounds bounds() const = 0;
  virtual std::uint32_t properties() const = 0;  // Property bits that this kind can answer
  // What the SurfaceCoordinates part, u and v of its hits are called in tables, as in {"face", "u", "v"}; empty for
  // kinds without them. Where there are any, the stage that orders rows puts the hits of a ray in order.
  virtual std::vector<std::string_view> coordinate_names() const { return {}; }
  bool has_coordinates() const { return !coordinate_names().empty(); }
  virtual std::size_t parts() const { return 1; }  // how many there are, of kinds with coordinates
  virtual std::vector<Fact> facts() const = 0;
  // Why there is no surface at all, where that is known beforehand; else empty.
  virtual std::string why_empty() const { return {}; }
  // What devices ask of rays beyond finite numbers, a direction and t_min <= t_max, for messages: ", and ...".
  virtual std::string_view ray_limits() const { return {}; }
  // For kinds that can tell more of roots than their device code does, which is asked about hits that it flags
  // (host/api/resolve_hits.hpp).
  virtual RootResolver root_resolver() const { return {}; }
  // For level sets.
  virtual std::optional<InsideOfLevel> inside_of_level() const { return std::nullopt; }
  // Why points cannot be told to be inside or outside, for messages; empty where they can.
  virtual std::string no_inside() const {
    return inside_of_level() ? "" : "the surface encloses nothing; level sets and closed meshes do";
  }
  // For kinds that are given by an expression.
  virtual std::optional<AnalyticField> analytic_field() const { return std::nullopt; }
};

}  // namespace smurf
