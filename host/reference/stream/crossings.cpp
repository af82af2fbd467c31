#include "reference/stream/crossings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/flow/extrapolation.hpp"

namespace smurf {
namespace {

using glm::dmat2;
using glm::dvec2;
using glm::dvec3;

constexpr int deepest = 28;  // halvings of a cell
// Of a cell, which rays cross 18 times at most: open parts of one size, and folds. More are a ray along the surface.
constexpr std::size_t most_open = 256, most_folds = 64;
constexpr double outside = 0.05;       // of a part, by which the patch's crossing may lie beyond it
constexpr double exact_place = 1e-11;  // of the extent: how exactly places are found
constexpr double same_place = 1e-8;    // of the extent: crossings that are one
constexpr double seam_width = 2e-6;    // of the extent: by which the ends of a closed surface may miss each other
constexpr double flat = 1e-9;          // slope below which a crossing is double
constexpr double long_stretch = 1e-3;  // of the extent: along which a ray lies in the surface rather than touches it

double cross(const dvec2& a, const dvec2& b) { return a.x * b.y - a.y * b.x; }

}  // namespace

struct StreamCrossings::Line {
  ReferenceRay ray;
  dvec3 unit, e1, e2;
  double speed;
  double rounding;  // of places, in units of space

  explicit Line(const ReferenceRay& r) : ray(r), speed(glm::length(r.direction)) {
    unit = r.direction / speed;
    dvec3 axis(0.0);
    axis[std::abs(unit.x) < 0.6 ? 0 : std::abs(unit.y) < 0.6 ? 1 : 2] = 1;
    e1 = glm::normalize(glm::cross(unit, axis));
    e2 = glm::cross(unit, e1);
    rounding = 0x1p-50 * glm::length(r.origin);
  }
  dvec2 across(const dvec3& v) const { return {glm::dot(e1, v), glm::dot(e2, v)}; }
  dvec2 off(const dvec3& x) const { return across(x - ray.origin); }
  double t_of(const dvec3& x) const { return glm::dot(unit, x - ray.origin) / speed; }
};

// Control points across the ray, and t.
struct StreamCrossings::Piece {
  StreamNet net;
  double a0 = 0, a1 = 1, b0 = 0, b1 = 1;
  int depth = 0;

  dvec2 at(std::size_t i) const { return {net[i]}; }

  bool misses(const Line& line, double off) const {
    dvec3 lower = net[0], upper = net[0];
    for (const dvec3& c : net) lower = glm::min(lower, c), upper = glm::max(upper, c);
    const double t_off = off / line.speed;
    return lower.x > off || lower.y > off || upper.x < -off || upper.y < -off || lower.z > line.ray.t_max + t_off ||
           upper.z < line.ray.t_min - t_off || beside(off);
  }
  // All on one side of a line through the ray that is parallel to a diagonal of the piece.
  bool beside(double off) const {
    for (const dvec2& way : {at(15) - at(0), at(12) - at(3), at(3) - at(0), at(12) - at(0)}) {
      const double size = glm::length(way);
      if (!(size > 0)) continue;
      double least = std::numeric_limits<double>::infinity(), most = -least;
      for (std::size_t i = 0; i < 16; i++) {
        const double side = cross(way, at(i)) / size;
        least = std::min(least, side);
        most = std::max(most, side);
      }
      if (least > off || most < -off) return true;
    }
    return false;
  }
  double width() const {
    dvec2 lower = at(0), upper = at(0);
    for (std::size_t i = 0; i < 16; i++) lower = glm::min(lower, at(i)), upper = glm::max(upper, at(i));
    return std::max(upper.x - lower.x, upper.y - lower.y);
  }

  bool is_one_to_one() const {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (std::size_t k = 0; k < 12; k++) {
      const std::size_t along_a = k % 3 + 4 * (k / 3);
      const dvec2 a = at(along_a + 1) - at(along_a);
      for (std::size_t l = 0; l < 12; l++) {
        const dvec2 b = at(l + 4) - at(l);
        const double c = cross(a, b);
        least = std::min(least, c);
        most = std::max(most, c);
      }
    }
    return least > 0 || most < 0;
  }

  void split(Piece& low, Piece& high) const {
    double sizes[2] = {0, 0};
    for (std::size_t k = 0; k < 12; k++) {
      const std::size_t along_a = k % 3 + 4 * (k / 3);
      sizes[0] = std::max(sizes[0], glm::distance(net[along_a + 1], net[along_a]));
      sizes[1] = std::max(sizes[1], glm::distance(net[k + 4], net[k]));
    }
    const bool in_a = sizes[0] >= sizes[1];
    low = high = *this;
    const std::size_t step = in_a ? 1 : 4, row = in_a ? 4 : 1;
    for (std::size_t r = 0; r < 4; r++) {
      const std::size_t i = r * row;
      const dvec3 p0 = net[i], p1 = net[i + step], p2 = net[i + 2 * step], p3 = net[i + 3 * step];
      const dvec3 q0 = 0.5 * (p0 + p1), q1 = 0.5 * (p1 + p2), q2 = 0.5 * (p2 + p3), r0 = 0.5 * (q0 + q1),
                  r1 = 0.5 * (q1 + q2), m = 0.5 * (r0 + r1);
      low.net[i + step] = q0, low.net[i + 2 * step] = r0, low.net[i + 3 * step] = m;
      high.net[i] = m, high.net[i + step] = r1, high.net[i + 2 * step] = q2;
    }
    low.depth = high.depth = depth + 1;
    (in_a ? low.a1 : low.b1) = (in_a ? high.a0 : high.b0) = in_a ? 0.5 * (a0 + a1) : 0.5 * (b0 + b1);
  }
};

std::vector<StreamCrossing> StreamCrossings::find(const ReferenceRay& ray) const {
  const Line line(ray);
  std::vector<StreamCrossing> found;
  const auto meets = [&](const BoxTree::Box& box) {
    double enter = ray.t_min, leave = ray.t_max;
    const double margin = line.rounding + 1e-12 * samples_.extent();
    for (int axis = 0; axis < 3; axis++) {
      const double low = box.lower[axis] - margin - ray.origin[axis],
                   high = box.upper[axis] + margin - ray.origin[axis];
      if (ray.direction[axis] == 0) {
        if (low > 0 || high < 0) return false;
        continue;
      }
      const double a = low / ray.direction[axis], b = high / ray.direction[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    const double slack = margin / line.speed + 1e-15 * std::abs(enter);
    return enter <= leave + slack;
  };
  samples_.boxes().visit(meets, [&](std::int32_t cell) { cross_cell(line, std::size_t(cell), found); });
  merge(line, found);
  return found;
}

void StreamCrossings::cross_cell(const Line& line, std::size_t cell, std::vector<StreamCrossing>& found) const {
  const StreamCellPlace place = samples_.place(cell);
  const StreamNet net = samples_.net(cell);
  const double off = place.off + line.rounding;
  Piece whole;
  for (std::size_t i = 0; i < 16; i++) whole.net[i] = dvec3(line.off(net[i]), line.t_of(net[i]));
  // Level by level: parts that are still open at one tell how far the ray runs along the surface.
  std::vector<Piece> open{whole}, folds;
  const auto cross_piece = [&](const Piece& piece, std::vector<Piece>& halves) {
    if (piece.misses(line, off)) return;
    const bool clear = piece.is_one_to_one();
    if (clear) {
      // The crossing of the patch, continued.
      dvec2 at(0.5 * (piece.a0 + piece.a1), 0.5 * (piece.b0 + piece.b1));
      const dvec2 size(piece.a1 - piece.a0, piece.b1 - piece.b0);
      bool left = false, done = false;
      double reach = 0;  // how far the surface may carry the crossing from that of the patch, of the piece
      for (int step = 0; step < 30 && !left && !done; step++) {
        const NetPoint p = evaluate(net, at.x, at.y);
        const dmat2 by(line.across(p.a), line.across(p.b));
        const double determinant = cross(by[0], by[1]);
        if (determinant == 0) break;
        const dvec2 move = -(glm::inverse(by) * line.off(p.x));
        at += move;
        const double largest = std::sqrt(glm::dot(by[0], by[0]) + glm::dot(by[1], by[1]));
        reach = off * largest / std::abs(determinant) / std::min(size.x, size.y);
        const dvec2 local = (at - dvec2(piece.a0, piece.b0)) / size;
        left = std::max({-local.x, local.x - 1, -local.y, local.y - 1}) > 3;
        done = std::max(std::abs(move.x) / size.x, std::abs(move.y) / size.y) < 1e-9;
      }
      if (left && reach < outside) return;
      if (done && reach < outside) {
        const dvec2 local = (at - dvec2(piece.a0, piece.b0)) / size;
        if (std::max({-local.x, local.x - 1, -local.y, local.y - 1}) > outside) return;
        if (const auto crossing = polish(line, place, net, at.x, at.y, false)) found.push_back(*crossing);
        return;
      }
    }
    if (piece.depth >= deepest || piece.width() < 4 * off) {
      folds.push_back(piece);
      return;
    }
    halves.resize(halves.size() + 2);
    piece.split(halves[halves.size() - 2], halves.back());
  };
  while (!open.empty() && open.size() <= most_open && folds.size() <= most_folds) {
    std::vector<Piece> halves;
    for (const Piece& piece : open) cross_piece(piece, halves);
    open = std::move(halves);
  }
  if (open.empty() && folds.size() <= most_folds) {
    for (const Piece& piece : folds) unfold(line, place, net, piece, found);
    return;
  }
  open.insert(open.end(), folds.begin(), folds.end());
  std::erase_if(open, [&](const Piece& piece) { return piece.misses(line, off); });
  run_along(line, place, open, found);
}

// A ray that lies in the surface to as much as parts of this size tell: one enclosure of all that is open.
void StreamCrossings::run_along(const Line& line, const StreamCellPlace& place, const std::vector<Piece>& open,
                                std::vector<StreamCrossing>& found) const {
  if (open.empty()) return;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Piece& piece : open) {
    for (const dvec3& c : piece.net) low = std::min(low, c.z), high = std::max(high, c.z);
  }
  const double slack = (place.off + line.rounding) / line.speed;
  low = std::max(low - slack, line.ray.t_min);
  high = std::min(high + slack, line.ray.t_max);
  if (low > high) return;
  const Piece& middle = open[open.size() / 2];
  StreamCrossing c;
  c.stretch = place.stretch;
  c.u = std::lerp(place.u0, place.u1, 0.5 * (middle.a0 + middle.a1));
  c.time = std::lerp(place.t0, place.t1, 0.5 * (middle.b0 + middle.b1));
  c.t = 0.5 * (low + high);
  c.uncertainty = 0.5 * (high - low);
  c.slope = 0;
  c.status = HitStatus::tangent;
  found.push_back(c);
}

// Newton's method on the true map. Its derivative along the flow is exact; that along the seed curve is the patch's, or
// where `exact` is asked for that of the surface. Steps are as far off as the patch's derivative is; the last one is so
// short that this is less than what is wanted.
std::optional<StreamCrossing> StreamCrossings::polish(const Line& line, const StreamCellPlace& place,
                                                      const StreamNet& net, double a, double b, bool exact) const {
  const StreamStretch& stretch = map_.stretches()[place.stretch];
  const glm::dvec2 range = map_.time();
  const double extent = samples_.extent(), du = place.u1 - place.u0, dt = place.t1 - place.t0;
  StreamCrossing c;
  c.stretch = place.stretch;
  c.u = place.u0 + a * du;
  c.time = place.t0 + b * dt;
  double before = std::numeric_limits<double>::infinity();
  for (int step = 0; step < 12; step++) {
    // Beyond its ends the surface goes on straight.
    const double u = std::clamp(c.u, stretch.lower, stretch.upper), time = std::clamp(c.time, range.x, range.y);
    const ReferenceStreamMap::Spot spot = map_.at(u, time);
    if (!is_finite(spot.x) || !is_finite(spot.v)) return std::nullopt;
    const NetPoint p = evaluate(net, (u - place.u0) / du, (time - place.t0) / dt);
    const dvec3 x_u = exact ? map_.along(stretch, u, time) : p.a / du;
    const dvec3 x = spot.x + (c.u - u) * x_u + (c.time - time) * spot.v;
    const dmat2 by(line.across(x_u), line.across(spot.v));
    const double determinant = cross(by[0], by[1]);
    const double area = glm::length(glm::cross(x_u, spot.v));
    c.slope = std::abs(determinant) / area;
    if (!(c.slope > flat)) return std::nullopt;
    const dvec2 move = -(glm::inverse(by) * line.off(x));
    c.u += move.x;
    c.time += move.y;
    c.t = line.t_of(x + move.x * x_u + move.y * spot.v);
    const double length = glm::length(x_u) * std::abs(move.x) + glm::length(spot.v) * std::abs(move.y);
    if (!(length < 0.5 * extent)) return std::nullopt;
    if (!exact && step > 1 && length > 0.5 * before) return polish(line, place, net, a, b, true);
    // What a step leaves: the square of its length by curvature, and what the derivative is off.
    const double size = std::max(1e-300, std::min(glm::length(p.a), glm::length(p.b)));
    const double leaves = length * ((exact ? 1e-7 : 8 * place.off / size) + 4 * length / size) / c.slope;
    before = length;
    if (leaves > exact_place * extent && length > exact_place * extent) continue;
    c.uncertainty = (exact_place * extent / c.slope + line.rounding) / line.speed;
    if (!accept(line, c, glm::length(x_u), glm::length(spot.v),
                spot.reached ? std::numeric_limits<double>::infinity() : std::abs(spot.end)))
      return std::nullopt;
    return c;
  }
  if (!exact) return polish(line, place, net, a, b, true);
  return std::nullopt;
}

// Whether it lies within the ends of the surface, and of the ray; its place is made to. At ends that meet others a
// crossing is taken from either side, as two that are merged.
bool StreamCrossings::accept(const Line& line, StreamCrossing& c, double x_u, double x_t, double end) const {
  const StreamStretch& stretch = map_.stretches()[c.stretch];
  const glm::dvec2 range = map_.time();
  const double rounding = 1e-9 * samples_.extent(), seam = seam_width * samples_.extent();
  const auto meets_next = [&](double u) {
    const bool first = u == map_.stretches().front().lower, last = u == map_.stretches().back().upper;
    return first || last ? samples_.is_closed_in_u() : true;
  };
  const double low = (meets_next(stretch.lower) && samples_.is_closed_in_u() ? seam : rounding) / x_u;
  const double high = (meets_next(stretch.upper) && samples_.is_closed_in_u() ? seam : rounding) / x_u;
  const double over = (samples_.is_closed_in_time() ? seam : rounding) / x_t;
  if (c.u < stretch.lower - low || c.u > stretch.upper + high) return false;
  if (c.time < range.x - over || c.time > range.y + over) return false;
  if (std::abs(c.time) > end + rounding / x_t) return false;
  c.u = std::clamp(c.u, stretch.lower, stretch.upper);
  c.time = std::clamp(c.time, range.x, range.y);
  const double slack = 4 * c.uncertainty;
  if (c.t < line.ray.t_min - slack || c.t > line.ray.t_max + slack) return false;
  c.t = std::clamp(c.t, line.ray.t_min, line.ray.t_max);
  return true;
}

// The surface about a fold: off(α, β) across the ray, with the direction in which it hardly moves found by singular
// values. The fold is where it does not move at all along that direction; there the distance from the ray is ρ, and off
// grows by κ α²/2.
void StreamCrossings::unfold(const Line& line, const StreamCellPlace& place, const StreamNet& net, const Piece& piece,
                             std::vector<StreamCrossing>& found) const {
  const StreamStretch& stretch = map_.stretches()[place.stretch];
  const glm::dvec2 range = map_.time();
  const double extent = samples_.extent(), du = place.u1 - place.u0, dt = place.t1 - place.t0;
  const dvec2 middle(0.5 * (piece.a0 + piece.a1), 0.5 * (piece.b0 + piece.b1));
  dvec2 at = middle, weak(0.0);
  double rho = 0, kappa = 0, t = 0, by_t = 0, fold = 0, x_u = 0, x_t = 0, end = 0, strong_size = 0;
  const double exact = exact_place * extent + line.rounding;
  for (int step = 0; step < 4; step++) {
    const double u = std::clamp(place.u0 + at.x * du, stretch.lower, stretch.upper),
                 time = std::clamp(place.t0 + at.y * dt, range.x, range.y);
    at = dvec2((u - place.u0) / du, (time - place.t0) / dt);
    if (glm::distance(at, middle) > 1) return;
    const ReferenceStreamMap::Spot spot = map_.at(u, time);
    if (!is_finite(spot.x) || !is_finite(spot.v)) return;
    end = spot.reached ? std::numeric_limits<double>::infinity() : std::abs(spot.end);
    const dvec3 a = map_.along(stretch, u, time) * du, b = spot.v * dt;
    x_u = glm::length(a) / du;
    x_t = glm::length(b) / dt;
    const dvec2 g = line.off(spot.x), ga = line.across(a), gb = line.across(b);
    // The eigenvector of the lesser singular value.
    const double aa = glm::dot(ga, ga), ab = glm::dot(ga, gb), bb = glm::dot(gb, gb);
    const double angle = 0.5 * std::atan2(2 * ab, aa - bb);
    const dvec2 strong(std::cos(angle), std::sin(angle));
    weak = dvec2(-strong.y, strong.x);
    const dvec2 moved = strong.x * ga + strong.y * gb;
    strong_size = glm::length(moved);
    if (!(strong_size > 0)) return;
    const dvec2 q1 = moved / strong_size, q2(-q1.y, q1.x);
    const double slope = glm::dot(q2, weak.x * ga + weak.y * gb);
    const NetPoint p = evaluate(net, at.x, at.y);
    const dvec3 bend = weak.x * weak.x * p.aa + 2 * weak.x * weak.y * p.ab + weak.y * weak.y * p.bb;
    kappa = glm::dot(q2, line.across(bend));
    fold = std::abs(kappa) > 1e-9 * strong_size ? std::clamp(-slope / kappa, -1.0, 1.0) : 0;
    rho = glm::dot(q2, g) + slope * fold + 0.5 * kappa * fold * fold;
    by_t = glm::dot(line.unit, weak.x * a + weak.y * b) / line.speed;
    t = line.t_of(spot.x);
    const dvec2 move = -glm::dot(q1, g) / strong_size * strong + fold * weak;
    at += move;
    if (glm::length(move) < 1e-9) break;
  }
  // The part alone is looked at, and what is next to it.
  const dvec2 size(piece.a1 - piece.a0, piece.b1 - piece.b0);
  const double half = 0.5 * glm::length(size * weak);
  const double bend = std::max(std::abs(kappa), 1e-300);
  if (glm::length((at - middle) / size) > 8 + std::sqrt(2 * place.off / bend) / std::min(size.x, size.y)) return;
  if (rho * kappa < 0 && std::abs(rho) > exact) {
    const double alpha = std::sqrt(-2 * rho / kappa);
    for (const double side : {-1.0, 1.0}) {
      const dvec2 start = at + side * alpha * weak;
      if (glm::distance(start, middle) > 2) continue;
      if (const auto crossing = polish(line, place, net, start.x, start.y, true)) found.push_back(*crossing);
    }
    return;
  }
  if (std::abs(rho) > exact) return;
  StreamCrossing c;
  c.stretch = place.stretch;
  c.u = place.u0 + at.x * du;
  c.time = place.t0 + at.y * dt;
  c.t = t;
  c.slope = 0;
  c.status = HitStatus::tangent;
  const double alpha = std::min(std::sqrt(2 * 2 * exact / bend), std::max(half, 1e-6));
  c.uncertainty = std::abs(by_t) * alpha + 4 * exact / line.speed;
  if (accept(line, c, x_u, x_t, end)) found.push_back(c);
}

// How far apart two crossings are on the surface, about.
double StreamCrossings::apart(const Line& line, const StreamCrossing& a, const StreamCrossing& b) const {
  const StreamStretch& sa = map_.stretches()[a.stretch];
  const StreamStretch& sb = map_.stretches()[b.stretch];
  const double first = map_.stretches().front().lower, last = map_.stretches().back().upper;
  double off_u = std::abs(a.u - b.u), off_t = std::abs(a.time - b.time);
  if (samples_.is_closed_in_u()) off_u = std::min(off_u, std::abs(last - first - off_u));
  if (samples_.is_closed_in_time()) off_t = std::min(off_t, std::abs(map_.time().y - map_.time().x - off_t));
  const double sizes = std::max(sa.size(), sb.size()), whole = map_.time().y - map_.time().x;
  return std::max({off_u / sizes, off_t / whole, std::abs(a.t - b.t) * line.speed / samples_.extent()});
}

void StreamCrossings::merge(const Line& line, std::vector<StreamCrossing>& found) const {
  std::ranges::sort(found, [](const StreamCrossing& a, const StreamCrossing& b) { return a.t < b.t; });
  std::vector<StreamCrossing> kept;
  const glm::dvec2 range = map_.time();
  const auto at_end = [&](const StreamCrossing& c) {
    const double first = map_.stretches().front().lower, last = map_.stretches().back().upper;
    const double near_u = seam_width * 4 * (last - first), near_t = seam_width * 4 * (range.y - range.x);
    return (samples_.is_closed_in_u() && (c.u < first + near_u || c.u > last - near_u)) ||
           (samples_.is_closed_in_time() && (c.time < range.x + near_t || c.time > range.y - near_t));
  };
  for (const StreamCrossing& c : found) {
    bool again = false;
    for (StreamCrossing& other : kept) {
      // Tangent to a fold: enclosures that overlap are one.
      if (c.status == HitStatus::tangent && other.status == HitStatus::tangent) {
        if (c.t - c.uncertainty > other.t + other.uncertainty + 1e-9 * samples_.extent() / line.speed) continue;
        const double low = std::min(other.t - other.uncertainty, c.t - c.uncertainty),
                     high = std::max(other.t + other.uncertainty, c.t + c.uncertainty);
        other.t = 0.5 * (low + high);
        other.uncertainty = 0.5 * (high - low);
        again = true;
        break;
      }
      if (c.status != other.status) continue;
      // Next to a fold places are known as the root of what the map is.
      const double same = same_place + exact_place / std::max({c.slope, other.slope, 1e-9});
      const double near = at_end(c) && at_end(other) ? std::max(same, 4 * seam_width / std::max(c.slope, 1e-3)) : same;
      if (apart(line, c, other) > near) continue;
      again = true;
      break;
    }
    if (!again) kept.push_back(c);
  }
  for (StreamCrossing& c : kept)
    if (c.status == HitStatus::tangent && 2 * c.uncertainty * line.speed > long_stretch * samples_.extent())
      c.status = HitStatus::unresolved;
  found = std::move(kept);
}

}  // namespace smurf
