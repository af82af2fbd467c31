// Interrogator and HitList: validate, then hand to the executor.
#include "smurf/interrogator.hpp"

#include <fmt/format.h>

#include "api/space_queries.hpp"
#include "device/executor.hpp"
#include "smurf/error.hpp"
#include "surfaces/queries.hpp"
#include "surfaces/record_answers.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {
namespace {

constexpr std::uint32_t all_properties = Property::value | Property::normal | Property::gauss | Property::mean |
                                         Property::principal | Property::directions | Property::normal_curvature |
                                         Property::parameters | Property::location;
constexpr std::uint32_t of_space = Property::distance | Property::inside;

void require_answerable(std::uint32_t wanted) {
  if ((wanted & of_space) != 0)
    throw Error(ErrorCode::usage, "distance and inside are told of points in space alone: ask for them by a probe");
  if ((wanted & ~all_properties) != 0)
    throw Error(ErrorCode::usage, fmt::format("unknown property bits {:#x}", wanted & ~all_properties));
}

float diagonal_of(const Bounds& bounds) { return glm::distance(glm::vec3(bounds.lower), glm::vec3(bounds.upper)); }

}  // namespace

std::string_view name_of(HitStatus status) {
  switch (status) {
    case HitStatus::isolated:
      return "isolated";
    case HitStatus::tangent:
      return "tangent";
    case HitStatus::unresolved:
      return "unresolved";
    case HitStatus::bracketed:
      return "bracketed";
    case HitStatus::sampled:
      return "sampled";
  }
  return "unknown";
}

Interrogator::Interrogator(const Device& device, const Surface& surface, const PrepareOptions& options) {
  auto queries = device.is_reference() ? interrogate_by_reference(surface.model())
                                       : interrogate_on_device(device, surface.share(), options);
  parts_ = surface.model().has_coordinates() ? surface.model().parts() : 0;
  diagonal_ = diagonal_of(surface.model().bounds());
  queries_ = recorded(std::move(queries), std::string(surface.kind()), device);
  space_ = std::make_shared<SpaceQueries>(*queries_, surface.share());
}

HitList Interrogator::cast(const RayBatch& rays, const CastOptions& options) const {
  require_answerable(options.properties);
  if (contains(options.properties, Property::normal_curvature)) {
    throw Error(ErrorCode::usage,
                "normal curvature needs a direction per hit: ask the hit list for normal_curvatures(directions)");
  }
  if (only_counts(options.hits) && options.properties != 0)
    throw Error(ErrorCode::usage, "a cast for any hit or for counts keeps no hits, so that it has no properties");
  HitList hits;
  queries_->cast(rays, options, hits);
  hits.queries_ = queries_;
  hits.diagonal_ = diagonal_;
  return hits;
}

PointProperties Interrogator::probe(std::span<const glm::vec3> points, std::uint32_t properties,
                                    const ProbeOptions& options) const {
  const std::uint32_t asked = properties, spatial = properties & of_space;
  space_->require_answerable(spatial);
  properties = (properties & ~of_space) | space_->needed(spatial);
  require_answerable(properties);
  const bool directed = contains(properties, Property::normal_curvature);
  if (directed && options.directions.size() != points.size()) {
    throw Error(ErrorCode::usage,
                fmt::format("normal curvature needs one direction per point: {} points, {} directions", points.size(),
                            options.directions.size()));
  }
  PointProperties out;
  queries_->measure({points, {}, directed ? options.directions : std::span<const glm::vec3>()}, properties, options,
                    out);
  space_->answer(points, spatial, out);
  out.measured |= asked;
  return out;
}

PointProperties Interrogator::properties_at(std::span<const SurfaceCoordinates> places, std::uint32_t properties,
                                            const ProbeOptions& options) const {
  require_answerable(properties);
  if (parts_ == 0)
    throw Error(ErrorCode::usage, "the surface has no coordinates; ask for the properties of points in space");
  const bool directed = contains(properties, Property::normal_curvature);
  if (directed && options.directions.size() != places.size()) {
    throw Error(ErrorCode::usage,
                fmt::format("normal curvature needs one direction per place: {} places, {} directions", places.size(),
                            options.directions.size()));
  }
  for (std::size_t i = 0; i < places.size(); i++) {
    if (places[i].part < parts_) continue;
    throw Error(ErrorCode::usage, fmt::format("place {} is on part {} of the surface, which has parts 0 to {}", i,
                                              places[i].part, parts_ - 1));
  }
  PointProperties out;
  const std::vector<glm::vec3> anywhere(places.size(), glm::vec3(0.0f));
  queries_->measure({anywhere, places, directed ? options.directions : std::span<const glm::vec3>()}, properties,
                    options, out);
  if (contains(properties, Property::parameters))
    out.coordinates = Values<SurfaceCoordinates>(places.begin(), places.end());
  return out;
}

void Interrogator::update(const Surface& surface) {
  queries_->update(surface.share());
  space_ = std::make_shared<SpaceQueries>(*queries_, surface.share());
  parts_ = surface.model().has_coordinates() ? surface.model().parts() : 0;
  diagonal_ = diagonal_of(surface.model().bounds());
}

std::size_t Interrogator::device_bytes() const { return queries_->device_bytes(); }

const PointProperties& HitList::properties(std::uint32_t wanted) const {
  require_answerable(wanted);
  const auto coordinates = std::uint32_t(Property::parameters);  // here already
  if ((wanted & coordinates) != 0 && properties_.coordinates.size() != coordinates_.size())
    properties_.coordinates = Values<SurfaceCoordinates>(coordinates_);
  if (wanted == coordinates) return properties_;
  const std::uint32_t missing = wanted & ~properties_.measured;
  if (missing != 0 || properties_.status.size() != size()) {
    queries_->measure({locations_, coordinates_, {}}, missing, {}, properties_);
  }
  return properties_;
}

std::span<const glm::vec3> HitList::normals() const { return properties(std::uint32_t(Property::normal)).normal; }
std::span<const float> HitList::gauss_curvatures() const { return properties(std::uint32_t(Property::gauss)).gauss; }
std::span<const float> HitList::mean_curvatures() const { return properties(std::uint32_t(Property::mean)).mean; }

std::span<const glm::vec2> HitList::principal_curvatures() const {
  const PointProperties& p = properties(std::uint32_t(Property::principal));
  if (principal_.size() != size()) {
    principal_.resize(size());
    for (std::size_t i = 0; i < size(); i++) principal_[i] = {p.k1[i], p.k2[i]};
  }
  return principal_;
}

std::span<const glm::vec3> HitList::first_principal_directions() const {
  return properties(std::uint32_t(Property::directions)).d1;
}
std::span<const glm::vec3> HitList::second_principal_directions() const {
  return properties(std::uint32_t(Property::directions)).d2;
}
std::span<const std::uint32_t> HitList::point_status() const {
  return properties(std::uint32_t(Property::gauss)).status;
}

Column<float> HitList::normal_curvatures(std::span<const glm::vec3> directions) const {
  if (directions.size() != size()) {
    throw Error(ErrorCode::usage, fmt::format("normal curvature needs one direction per hit: {} hits, {} directions",
                                              size(), directions.size()));
  }
  PointProperties out;
  queries_->measure({locations_, coordinates_, directions}, std::uint32_t(Property::normal_curvature), {}, out);
  return out.normal_curvature;
}

}  // namespace smurf
