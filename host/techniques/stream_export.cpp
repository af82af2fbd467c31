#include "smurf/stream_export.hpp"

#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace smurf {
namespace {

constexpr std::uint32_t wanted =
    Property::location | Property::normal | Property::gauss | Property::mean | std::uint32_t(Property::principal);

bool is_finite(const glm::vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

template <class T>
void keep(Column<T>& column, const std::vector<std::uint32_t>& places) {
  Values<T> kept(places.size());
  for (std::size_t i = 0; i < places.size(); i++) kept[i] = column[places[i]];
  column = Column<T>(std::move(kept));
}

// Polygons whose corners all have a location, and the places that these use.
void leave_out_unreached(MeasuredPolygons& mesh) {
  StreamPolygons kept;
  kept.offsets.push_back(0);
  constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(mesh.polygons.places.size(), unused), places;
  const StreamPolygons& all = mesh.polygons;
  for (std::size_t i = 0; i + 1 < all.offsets.size(); i++) {
    const std::span corners(all.corners.data() + all.offsets[i], all.corners.data() + all.offsets[i + 1]);
    bool reached = true;
    for (const std::uint32_t corner : corners) reached &= is_finite(mesh.points.location[corner]);
    if (!reached) {
      mesh.left_out++;
      continue;
    }
    for (const std::uint32_t corner : corners) {
      if (number[corner] == unused) {
        number[corner] = std::uint32_t(places.size());
        places.push_back(corner);
        kept.places.push_back(all.places[corner]);
      }
      kept.corners.push_back(number[corner]);
    }
    kept.offsets.push_back(std::uint32_t(kept.corners.size()));
  }
  PointProperties& points = mesh.points;
  keep(points.location, places);
  keep(points.normal, places);
  keep(points.gauss, places);
  keep(points.mean, places);
  keep(points.k1, places);
  keep(points.k2, places);
  keep(points.status, places);
  mesh.polygons = std::move(kept);
}

}  // namespace

MeasuredPolygons measured_polygons(const Device& device, const Surface& surface,
                                   std::function<void(std::size_t done, std::size_t total)> progress) {
  // First, for it traces the surface on its own device; what comes later finds it traced.
  const Interrogator query(device, surface);
  MeasuredPolygons mesh;
  mesh.polygons = stream_polygons(surface);
  std::vector<SurfaceCoordinates> places;
  places.reserve(mesh.polygons.places.size());
  for (const glm::dvec2& place : mesh.polygons.places) places.push_back({0, float(place.x), float(place.y)});
  mesh.points = query.properties_at(places, wanted, {.progress = std::move(progress)});
  leave_out_unreached(mesh);
  return mesh;
}

}  // namespace smurf
