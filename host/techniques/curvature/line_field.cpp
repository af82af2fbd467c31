#include "techniques/curvature/line_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace smurf {
namespace {

// Curvatures that differ by less than this part of them, or of 1/extent, are equal: devices tell them from floats.
constexpr double umbilic_part = 1e-4;
constexpr int probes = 8;
constexpr double pi = std::numbers::pi;

bool is_finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// The angle modulo π, in [-π/2, π/2].
double line_angle(double angle) { return std::remainder(angle, pi); }

}  // namespace

std::vector<LinePlace> LineField::at(std::span<const Guess> guesses) const {
  RayBatch rays(guesses.size());
  for (std::size_t i = 0; i < guesses.size(); i++) {
    const Guess& g = guesses[i];
    Ray ray;
    ray.origin = glm::vec3(g.point - g.off * g.normal);
    ray.direction = glm::vec3(g.normal);
    ray.t_max = float(2 * g.off);
    rays.set(i, ray);
  }
  const HitList hits = query_.cast(
      rays,
      {.hits = Hits::all, .properties = Property::normal | Property::principal | std::uint32_t(Property::directions)});
  std::vector<LinePlace> places(guesses.size());
  if (hits.size() == 0) return places;
  const PointProperties& known =
      hits.properties(Property::normal | Property::principal | std::uint32_t(Property::directions));
  for (std::size_t i = 0; i < guesses.size(); i++) {
    std::optional<std::size_t> best;
    double least = 0;
    bool faces = false;
    for (std::size_t h = hits.offsets()[i]; h < hits.offsets()[i + 1]; h++) {
      const bool same = glm::dot(glm::dvec3(known.normal[h]), guesses[i].normal) > 0;
      const double distance = glm::distance(glm::dvec3(hits.locations()[h]), guesses[i].point);
      if (best && (faces != same ? faces : distance >= least)) continue;
      best = h, least = distance, faces = same;
    }
    if (!best) continue;
    LinePlace& place = places[i];
    place.found = true;
    place.position = glm::dvec3(hits.locations()[*best]);
    place.normal = glm::dvec3(known.normal[*best]);
    place.k1 = known.k1[*best];
    place.k2 = known.k2[*best];
    const glm::vec3 direction = principal_ == 1 ? known.d1[*best] : known.d2[*best];
    const double size = std::max({std::abs(double(place.k1)), std::abs(double(place.k2)), 1 / extent_});
    place.umbilic =
        (known.status[*best] & PointStatus::umbilic) != 0 || double(place.k1) - double(place.k2) <= umbilic_part * size;
    place.defined = std::isfinite(place.k1) && std::isfinite(place.k2) && is_finite(known.normal[*best]) &&
                    (place.umbilic || is_finite(direction));
    if (is_finite(direction)) place.direction = glm::dvec3(direction);
  }
  return places;
}

std::vector<LinePlace> LineField::near(std::span<const glm::vec3> points, double reach) const {
  const PointProperties known = query_.probe(points, std::uint32_t(Property::normal));
  std::vector<Guess> guesses(points.size());
  for (std::size_t i = 0; i < points.size(); i++) {
    // A ray that cannot be cast has no hit.
    const bool sane = is_finite(points[i]) && is_finite(known.normal[i]);
    guesses[i] = {sane ? glm::dvec3(points[i]) : glm::dvec3(0.0), sane ? glm::dvec3(known.normal[i]) : glm::dvec3(0.0),
                  reach};
  }
  return at(guesses);
}

UmbilicExit exit_of(const LineField& field, const LinePlace& centre, const glm::dvec3& way, double radius) {
  const glm::dvec3 n = centre.normal, u = glm::normalize(way - glm::dot(way, n) * n), v = glm::cross(n, u);
  const auto out_at = [&](double angle) { return std::cos(angle) * u + std::sin(angle) * v; };
  std::array<Guess, probes> guesses;
  // Half a step off the way in, on which a separatrix is likely to lie.
  const auto angle_of = [](int i) { return 2 * pi * (i + 0.5) / probes; };
  for (int i = 0; i < probes; i++)
    guesses[std::size_t(i)] = {centre.position + radius * out_at(angle_of(i)), n, radius};
  const std::vector<LinePlace> around = field.at(guesses);
  UmbilicExit exit;
  std::array<double, probes> angles{};
  bool region = true;
  for (std::size_t i = 0; i < probes; i++) {
    if (!around[i].found || !around[i].defined) return exit;
    region = region && around[i].umbilic;
    angles[i] = std::atan2(glm::dot(around[i].direction, v), glm::dot(around[i].direction, u));
  }
  if (region) {
    exit.kind = UmbilicExit::Kind::region;
    return exit;
  }
  double winding = 0;
  for (std::size_t i = 0; i < probes; i++) winding += line_angle(angles[(i + 1) % probes] - angles[i]);
  exit.twice_index = int(std::lround(winding / pi));
  exit.kind = exit.twice_index == 0 ? UmbilicExit::Kind::none : UmbilicExit::Kind::index;
  // Separatrices: where the field points outwards. The way in lies at an angle of π.
  double best = 0.75 * pi;
  for (int i = 0; i < probes; i++) {
    const double from = line_angle(angles[std::size_t(i)] - angle_of(i)),
                 to = line_angle(angles[std::size_t((i + 1) % probes)] - angle_of(i + 1));
    if ((from < 0) == (to < 0) || std::abs(from - to) >= 0.5 * pi) continue;
    const double angle = std::remainder(angle_of(i) + 2 * pi / probes * from / (from - to), 2 * pi);
    if (std::abs(angle) >= best) continue;
    best = std::abs(angle);
    exit.goes_on = true;
    exit.direction = out_at(angle);
  }
  if (!exit.goes_on) return exit;
  const Guess onto{centre.position + radius * exit.direction, n, radius};
  exit.place = field.at({&onto, 1}).front();
  exit.goes_on = exit.place.found && exit.place.defined && !exit.place.umbilic;
  return exit;
}

}  // namespace smurf
