// Stream surfaces, answered by the reference: dense samples of (u, τ) tell where to begin, and the flow itself, from
// the seed curve on, where the surface is. Nothing of the mesh, the lattice and the variational equations that devices
// work with is used here.
#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/flow/extrapolation.hpp"
#include "reference/stream/crossings.hpp"
#include "reference/stream/map.hpp"
#include "reference/stream/samples.hpp"
#include "reference/surface.hpp"
#include "reference/walk/stream_charts.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/stream/definition.hpp"

namespace smurf {
namespace {

using glm::dvec3;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double singular_sine = 1e-9;  // of the angle of x_u and x_τ

class StreamReference : public ReferenceSurface {
 public:
  explicit StreamReference(const StreamSurface& surface)
      : map_(surface), samples_(map_), crossings_(map_, samples_), charts_(map_, samples_) {}

  bool has_coordinates() const override { return true; }

  void roots(const ReferenceRay& ray, bool, std::vector<ReferenceHit>& hits) const override {
    for (const StreamCrossing& c : crossings_.find(ray))
      hits.push_back({c.t, c.uncertainty, c.status, c.slope, 0.0, {0, float(c.u), float(c.time)}});
  }

  ReferencePoint measure(const dvec3& point, const SurfaceCoordinates* coordinates) const override {
    Place place;
    const bool found = coordinates ? locate(coordinates->u, coordinates->v, place) : nearest(point, place);
    if (!found) return {nan, undefined_frame()};
    const ReferenceStreamMap::Jet jet = map_.jet(map_.stretches()[place.stretch], place.u, place.time);
    return {nan, frame_of(jet), {0, float(place.u), float(place.time)}, jet.x};
  }

  ReferenceWalker begin_walk(const dvec3& point, const SurfaceCoordinates* coordinates, const dvec3& direction,
                             double tolerance) const override {
    Place place;
    const bool found = coordinates ? locate(coordinates->u, coordinates->v, place) : nearest(point, place);
    if (!found) return {.location = point, .status = WalkStatus::off_surface};
    const ReferenceStreamMap::Jet jet = map_.jet(map_.stretches()[place.stretch], place.u, place.time);
    ReferenceWalker walker = walk_start(point, jet.x, frame_of(jet).normal, direction, tolerance);
    walker.u = place.u;
    walker.v = place.time;
    return walker;
  }

  ReferenceWalker neighbor(const ReferenceWalker& from, double distance) const override {
    Place place;
    if (!locate(from.u, from.v, place)) return {.location = from.location, .status = WalkStatus::undefined};
    SectionEnd end = follow_section(charts_, section_start(from, distance), {place.stretch, {place.u, place.time}});
    const ReferenceStreamMap::Jet jet = map_.jet(map_.stretches()[end.part], end.u, end.v);
    end.part = 0;
    return walk_end(from, end, frame_of(jet).normal);
  }

  std::size_t bytes() const override { return samples_.bytes(); }
  std::shared_ptr<const ReferenceSurface> updated(const SurfaceDefinition&) const override { return nullptr; }

 private:
  struct Place {
    std::uint32_t stretch = 0;
    double u = 0, time = 0;
  };

  // Coordinates are floats, which miss the ends of ranges by a rounding. At a corner of the seed curve the part that
  // begins there.
  bool locate(double u, double time, Place& place) const {
    const auto rounding = [](double a, double b) { return 2 * double(0x1p-23f) * std::max(std::abs(a), std::abs(b)); };
    const glm::dvec2 range = map_.time();
    const double off_t = rounding(range.x, range.y);
    if (!(time >= range.x - off_t && time <= range.y + off_t) || !std::isfinite(u)) return false;
    place.time = std::clamp(time, range.x, range.y);
    const std::vector<StreamStretch>& all = map_.stretches();
    const double off_u = rounding(all.front().lower, all.back().upper);
    for (std::size_t i = all.size(); i-- > 0;) {
      if (u < all[i].lower - (i == 0 ? off_u : 0) || u > all[i].upper + off_u) continue;
      place.stretch = std::uint32_t(i);
      place.u = std::clamp(u, all[i].lower, all[i].upper);
      return true;
    }
    return false;
  }

  // With the dual basis g^u, g^τ of x_u and x_τ the derivative of the normal is
  // -(L g^u g^u + M (g^u g^τ + g^τ g^u) + N g^τ g^τ).
  SurfaceFrame frame_of(const ReferenceStreamMap::Jet& p) const {
    const dvec3 across = glm::cross(p.u, p.v);
    const double area = glm::length(across);
    if (!std::isfinite(area)) return undefined_frame();
    if (!(area > singular_sine * glm::length(p.u) * glm::length(p.v))) {
      SurfaceFrame none = undefined_frame();
      none.status |= PointStatus::singular;
      return none;
    }
    const dvec3 normal = across / area;
    const dvec3 gu = glm::cross(p.v, normal) / area, gv = glm::cross(normal, p.u) / area;
    const double l = glm::dot(p.uu, normal), m = glm::dot(p.uv, normal), n = glm::dot(p.vv, normal);
    const glm::dmat3 shape =
        -(l * glm::outerProduct(gu, gu) + m * (glm::outerProduct(gu, gv) + glm::outerProduct(gv, gu)) +
          n * glm::outerProduct(gv, gv));
    // Second differences are exact to about this, of the extent's inverse.
    SurfaceFrame frame = level_set_frame(normal, shape, 1, 1e-7 / samples_.extent());
    frame.normal = normal;  // also where the field has no second derivatives, and the surface no curvature
    return frame;
  }

  bool nearest(const dvec3& point, Place& place) const {
    if (!is_finite(point)) return false;
    double best = std::numeric_limits<double>::infinity();
    std::size_t best_cell = 0;
    glm::dvec2 best_at(0.5);
    const auto near = [&](const BoxTree::Box& box) {
      const dvec3 away = glm::max(glm::max(box.lower - point, point - box.upper), dvec3(0.0));
      return glm::length(away) < best;
    };
    // The nearest corner first, so that few patches are looked at.
    samples_.boxes().visit(near, [&](std::int32_t cell) {
      const StreamNet net = samples_.net(std::size_t(cell));
      for (const std::size_t corner : {0, 3, 12, 15}) {
        const double distance = glm::distance(net[corner], point);
        if (distance >= best) continue;
        best = distance;
        best_cell = std::size_t(cell);
        best_at = glm::dvec2(corner % 4 == 3, corner / 4 == 3);
      }
    });
    if (!std::isfinite(best)) return false;
    best *= 1 + 1e-9;
    samples_.boxes().visit(near, [&](std::int32_t cell) {
      const StreamNet net = samples_.net(std::size_t(cell));
      glm::dvec2 at(0.5);
      const double distance = descend([&](const glm::dvec2& w) { return evaluate(net, w.x, w.y); }, point,
                                      {glm::dvec2(0.0), glm::dvec2(1.0)}, at);
      if (distance >= best) return;
      best = distance;
      best_cell = std::size_t(cell);
      best_at = at;
    });
    const StreamCellPlace cell = samples_.place(best_cell);
    const StreamNet net = samples_.net(best_cell);
    const StreamStretch& stretch = map_.stretches()[cell.stretch];
    const glm::dvec2 size(cell.u1 - cell.u0, cell.t1 - cell.t0), corner(cell.u0, cell.t0);
    // On the surface itself, with the patch's second derivatives.
    const auto truth = [&](const glm::dvec2& w) {
      NetPoint p = evaluate(net, w.x, w.y);
      const double u = std::clamp(cell.u0 + w.x * size.x, stretch.lower, stretch.upper);
      const ReferenceStreamMap::Spot spot = map_.at(u, cell.t0 + w.y * size.y);
      p.x = spot.x;
      p.b = spot.v * size.y;
      return p;
    };
    const glm::dvec2 lower = glm::max(glm::dvec2(-1.0), (glm::dvec2(stretch.lower, map_.time().x) - corner) / size),
                     upper = glm::min(glm::dvec2(2.0), (glm::dvec2(stretch.upper, map_.time().y) - corner) / size);
    descend(truth, point, {lower, upper}, best_at);
    place = {cell.stretch, cell.u0 + best_at.x * size.x, cell.t0 + best_at.y * size.y};
    // A line that ends before ends the surface.
    const ReferenceStreamMap::Spot spot = map_.at(std::clamp(place.u, stretch.lower, stretch.upper), place.time);
    if (!spot.reached) place.time = spot.end;
    return true;
  }

  // Gauss and Newton's method for the nearest point, within bounds; the distance.
  template <class At>
  static double descend(const At& position, const dvec3& point, const std::array<glm::dvec2, 2>& bounds,
                        glm::dvec2& at) {
    NetPoint p = position(at);
    double distance = glm::distance(p.x, point);
    for (int step = 0; step < 20; step++) {
      const dvec3 away = p.x - point;
      const glm::dvec2 slope(glm::dot(p.a, away), glm::dot(p.b, away));
      const auto fixed = [&](int axis) {
        return (at[axis] <= bounds[0][axis] && slope[axis] > 0) || (at[axis] >= bounds[1][axis] && slope[axis] < 0);
      };
      glm::dmat2 by(glm::dot(p.a, p.a) + glm::dot(p.aa, away), glm::dot(p.a, p.b) + glm::dot(p.ab, away), 0,
                    glm::dot(p.b, p.b) + glm::dot(p.bb, away));
      by[1][0] = by[0][1];
      if (!(by[0][0] > 0) || !(glm::determinant(by) > 1e-12 * by[0][0] * by[1][1]))
        by = glm::dmat2(2 * glm::dot(p.a, p.a), 0, 0, 2 * glm::dot(p.b, p.b));
      glm::dvec2 move(0.0);
      if (!fixed(0) && !fixed(1)) move = -(glm::inverse(by) * slope);
      else if (!fixed(0)) move.x = -slope.x / by[0][0];
      else if (!fixed(1)) move.y = -slope.y / by[1][1];
      bool better = false;
      for (double part = 1; part > 1e-2 && !better; part *= 0.35) {
        const glm::dvec2 next = glm::clamp(at + part * move, bounds[0], bounds[1]);
        if (next == at) continue;
        const NetPoint there = position(next);
        const double d = glm::distance(there.x, point);
        if (!(d < distance)) continue;
        better = glm::length(next - at) > 1e-9;
        at = next;
        p = there;
        distance = d;
      }
      if (!better) break;
    }
    return distance;
  }

  ReferenceStreamMap map_;
  StreamSamples samples_;
  StreamCrossings crossings_;
  StreamCharts charts_;
};

}  // namespace

std::shared_ptr<const ReferenceSurface> refer_stream(const SurfaceDefinition& definition) {
  return std::make_shared<StreamReference>(dynamic_cast<const StreamSurface&>(definition));
}

}  // namespace smurf
