#include "patches/ray_boxes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double half_step = 0x1p-53;        // the rounding of a double, relative
constexpr double float_to_double = 0x1p-29;  // from PieceBounds::error, which is of floats
constexpr double certain = 0.95, bend = 1 / (2 * leaf_reach);
constexpr double settled = 1e-6, rough = 0.2, degenerate = 64;
constexpr int newton_steps = 12;
constexpr int depth_of_flat = 4;  // of boxes of which it is asked whether their piece is flat
constexpr double flat_within = 1e-13, along_flat = 1e-11;
constexpr int most_boxes = 8192, deepest = 120;
constexpr std::size_t many_open = 64;       // beyond which only the ends of enclosures are told more closely
constexpr double smallest_open = 4e-9;      // of the extent
constexpr double grazing = 1e-6;            // the sine of an angle
constexpr double smallest_at_pole = 1e-12;  // of the extent
constexpr double smallest_unknown = 1e-9;   // of the extent, where there are no bounds of derivatives
constexpr int deepest_unknown = 80;

bool is_finite(const dvec3& v) { return std::isfinite(v.x + v.y + v.z); }
double sum(const dvec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); }
double largest(const dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

// (o - c) + t·d, rounded once.
double shifted(double o, double c, double t, double d) {
  const double from = o - c, back = from - o;
  const double from_low = (o - (from - back)) - (c + back);
  const double way = t * d, way_low = std::fma(t, d, -way);
  const double total = from + way, of_way = total - from;
  return total + ((from - (total - of_way)) + (way - of_way) + (from_low + way_low));
}

}  // namespace

BoxRay box_ray(const dvec3& origin, const dvec3& direction, const dvec3& centre, double extent) {
  BoxRay ray;
  ray.direction = direction;
  ray.centre = centre;
  ray.start = glm::dot(centre - origin, direction) / glm::dot(direction, direction);
  for (int i = 0; i < 3; i++) ray.origin[i] = shifted(origin[i], centre[i], ray.start, direction[i]);
  ray.error = 4 * half_step * (2 * extent + largest(centre));
  return ray;
}

bool clip_to_box(const SpaceBox& box, const dvec3& origin, const dvec3& direction, double& low, double& high) {
  for (int axis = 0; axis < 3; axis++) {
    if (direction[axis] == 0) {
      if (origin[axis] < box.lower[axis] || origin[axis] > box.upper[axis]) return false;
      continue;
    }
    const double a = (box.lower[axis] - origin[axis]) / direction[axis];
    const double b = (box.upper[axis] - origin[axis]) / direction[axis];
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return low <= high;
}

double gap_of(const PatchTopology& topology, double extent) {
  return std::min(topology.greatest_gap, 1e-6 * extent) + 1e-15 * extent;
}

RayBoxes::RayBoxes(const PieceSource& source, const PatchTopology& topology, double extent, const BoxRay& ray,
                   double low, double high)
    : source_(source),
      topology_(topology),
      extent_(extent),
      ray_(ray),
      low_(low),
      high_(high),
      gap_(gap_of(topology, extent)) {}

void RayBoxes::add(const PatchLeaf& leaf) {
  Box box{.piece = leaf.piece, .centre = leaf.centre, .half = leaf.half};
  if (leaf.kind == LeafKind::regular) box.leaf = &leaf;
  waiting_.push_back(box);
}

void RayBoxes::search() {
  int left = most_boxes;
  std::vector<Box> next;
  while (!waiting_.empty()) {
    next.clear();
    for (const Box& box : waiting_) {
      if (left-- > 0) {
        look(box, next);
        continue;
      }
      // Too many: those that are left are told as they are.
      Plane plane;
      if (box.bounds >= 0 || box.leaf) plane = plane_of(box);
      if (!is_finite(plane.m + plane.a + plane.b + plane.e) || plane.a == dvec3(0.0)) {
        double low = low_, high = high_;
        const auto space = source_.positions(box.piece, {box.centre - box.half, box.centre + box.half});
        if (!space || clip_to_box({space->lower - ray_.centre, space->upper - ray_.centre}, ray_.origin, ray_.direction,
                                  low, high))
          open_.push_back({low, high, box.piece, box.centre, box.half, true});
        continue;
      }
      const Meeting k = meet(plane, slack_of(box, plane));
      if (!k.is_met) continue;
      if (auto one = enclosure(box, plane, k)) {
        one->is_undecided = true;
        kept_.emplace_back(*one, box);
      }
    }
    waiting_.swap(next);
  }
  refine_open();
}

int RayBoxes::collapsed_side(const Box& box) const {
  const ParameterBox range = source_.range(box.piece);
  const auto& collapsed = topology_.pieces[box.piece].collapsed;
  for (int d = 0; d < 2; d++) {
    // The ends of boxes are rounded when they are split deeply.
    const double off = 1e-3 * box.half[d];
    if (collapsed[2 * std::size_t(d)] && box.centre[d] - box.half[d] <= range.lower[d] + off) return 2 * d;
    if (collapsed[2 * std::size_t(d) + 1] && box.centre[d] + box.half[d] >= range.upper[d] - off) return 2 * d + 1;
  }
  return -1;
}

dvec2 RayBoxes::slack_of(const Box& box, const Plane& plane) const {
  const ParameterBox range = source_.range(box.piece);
  const PieceBorders& borders = topology_.pieces[box.piece];
  dvec2 slack(0.0);
  for (int d = 0; d < 2; d++) {
    const bool least = borders.edges[2 * std::size_t(d)] != no_edge && box.centre[d] - box.half[d] <= range.lower[d];
    const bool most = borders.edges[2 * std::size_t(d) + 1] != no_edge && box.centre[d] + box.half[d] >= range.upper[d];
    const double length = glm::length(d == 0 ? plane.a : plane.b);
    // Beyond the reach of the bounds nothing is known.
    if (least || most) slack[d] = std::min(gap_ / length, 0.2);
  }
  return slack;
}

RayBoxes::Plane RayBoxes::plane_of(const Box& box) const {
  Plane plane;
  double float_error = 0;
  if (box.leaf) {
    plane = {box.leaf->m - ray_.centre, box.leaf->a, box.leaf->b, box.leaf->e, 0};
    float_error = largest(box.leaf->error);
  } else {
    const PatchPoint p = source_.at(box.piece, box.centre.x, box.centre.y);
    const PieceBounds& bounds = bounds_[std::size_t(box.bounds)];
    plane.m = p.position - ray_.centre;
    plane.a = box.half.x * p.u;
    plane.b = box.half.y * p.v;
    plane.e = leaf_remainder(bounds, box.half) + 1e-14 * (glm::abs(plane.a) + glm::abs(plane.b));
    float_error = largest(bounds.error);
  }
  // What rounding of u and v does to the position.
  const double moved =
      2 * half_step *
      (largest(plane.a) / box.half.x * std::abs(box.centre.x) + largest(plane.b) / box.half.y * std::abs(box.centre.y));
  plane.error = ray_.error + float_to_double * float_error + moved;
  return plane;
}

RayBoxes::Meeting RayBoxes::meet(const Plane& plane, const dvec2& slack) const {
  const dvec3& d = ray_.direction;
  Meeting k;
  k.row_x = glm::cross(plane.b, d);
  k.row_y = glm::cross(d, plane.a);
  k.determinant = glm::dot(plane.a, k.row_x);
  k.t = glm::dot(plane.m - ray_.origin, d) / glm::dot(d, d);
  k.foot = ray_.origin + k.t * d;
  const dvec3 w = k.foot - plane.m;
  k.x = glm::dot(k.row_x, w);
  k.y = glm::dot(k.row_y, w);
  const double length = glm::length(d), a = glm::length(plane.a), b = glm::length(plane.b);
  double q_x = glm::dot(glm::abs(k.row_x), plane.e), q_y = glm::dot(glm::abs(k.row_y), plane.e);
  if (plane.flat != dvec3(0.0)) {
    // The rest lies in the plane.
    const double within = std::abs(glm::dot(plane.flat, d)) * glm::length(plane.e);
    q_x = std::min(q_x, b * within);
    q_y = std::min(q_y, a * within);
  }
  k.off = std::max(sum(k.row_x), sum(k.row_y)) * plane.error + 16 * half_step * (a + b) * length * largest(w);
  const double size = std::abs(k.determinant);
  k.q = std::max(q_x, q_y);
  k.is_certain = k.q < certain * size && size > degenerate * half_step * a * b * length;
  k.is_met = std::abs(k.x) <= size * (1 + slack.x) + bend * q_x + k.off &&
             std::abs(k.y) <= size * (1 + slack.y) + bend * q_y + k.off;
  if (!k.is_met) return k;
  // Where the ray runs along the plane both rows look in one direction: across it and the plane's normal there is more.
  const dvec3 normal = glm::cross(plane.a, plane.b), across = glm::cross(d, normal);
  const double reach = (1 + slack.x) * std::abs(glm::dot(across, plane.a)) +
                       (1 + slack.y) * std::abs(glm::dot(across, plane.b)) + bend * glm::dot(glm::abs(across), plane.e);
  const double rounding = sum(across) * (plane.error + 16 * half_step * (a + b + largest(w)));
  k.is_met = std::abs(glm::dot(across, w)) <= reach + rounding;
  // And where a or b vanishes, neither looks anywhere.
  const double farthest = a * (1 + slack.x) + b * (1 + slack.y) + bend * glm::length(plane.e) + 2 * plane.error;
  k.is_met = k.is_met && glm::length(w) <= farthest * (1 + 1e-12);
  return k;
}

// The stretch of the ray in which the box lies; nothing where that is not looked at.
std::optional<OpenBox> RayBoxes::enclosure(const Box& box, const Plane& plane, const Meeting& k) const {
  const double around = (plane.lengths() + plane.error) / glm::length(ray_.direction) + 8 * half_step * std::abs(k.t);
  const OpenBox one{k.t - around, k.t + around, box.piece, box.centre, box.half, false};
  if (one.high < low_ || one.low > high_) return std::nullopt;
  return one;
}

void RayBoxes::halve(const Box& box, int direction, bool ask, std::vector<Box>& next) const {
  for (const double to : {-0.5, 0.5}) {
    Box half = box;
    half.leaf = nullptr;
    half.half[direction] = 0.5 * box.half[direction];
    half.centre[direction] = box.centre[direction] + to * box.half[direction];
    half.depth = box.depth + 1;
    if (ask) half.bounds = bounds_asked;
    next.push_back(half);
  }
}

// The one whose halving leaves the least remainder beside the shorter tangent.
int RayBoxes::best_direction(const Box& box, const Plane& plane) const {
  const double a = glm::length(plane.a), b = glm::length(plane.b);
  const PieceBounds& bounds = bounds_[std::size_t(box.bounds)];
  const double in_u = glm::length(leaf_remainder(bounds, {0.5 * box.half.x, box.half.y})) / std::min(0.5 * a, b);
  const double in_v = glm::length(leaf_remainder(bounds, {box.half.x, 0.5 * box.half.y})) / std::min(a, 0.5 * b);
  if (in_u != in_v) return in_u < in_v ? 0 : 1;
  return a >= b ? 0 : 1;
}

void RayBoxes::look(Box box, std::vector<Box>& next) {
  const int side = collapsed_side(box);
  if (!box.leaf && box.bounds == bounds_asked) {
    const std::optional<PieceBounds> known = leaf_bounds(source_, box.piece, box.centre, box.half);
    box.bounds = known ? int(bounds_.size()) : bounds_none;
    if (known) bounds_.push_back(*known);
  }
  if (!box.leaf && box.bounds == bounds_none) return look_without_bounds(box, side, next);
  Plane plane = plane_of(box);
  if (!is_finite(plane.m + plane.a + plane.b + plane.e)) return look_without_bounds(box, side, next);
  if (box.depth >= depth_of_flat) {
    plane.flat = flat_normal(box.piece);
    if (plane.flat != dvec3(0.0)) {
      if (std::abs(glm::dot(plane.flat, ray_.direction)) < along_flat * glm::length(ray_.direction)) return;
      plane.error += flat_within * extent_;
    }
  }
  const dvec2 slack = slack_of(box, plane);
  const Meeting k = meet(plane, slack);
  if (!k.is_met) return;
  const std::optional<OpenBox> here = enclosure(box, plane, k);
  if (!here) return;
  if (k.is_certain && newton(box, plane, k, slack) != Verdict::open) {
    alone_.push_back({box.piece, {box.centre - leaf_reach * box.half, box.centre + leaf_reach * box.half}});
    return;
  }
  if (side >= 0 && (plane.lengths() < smallest_at_pole * extent_ || box.depth >= deepest_unknown))
    return add_pole(box, side, plane.m, plane.lengths() + plane.error);
  // Where the ray grazes the surface, double roots are as wide as the root of rounding: smaller boxes tell no more.
  const double area = glm::length(plane.a) * glm::length(plane.b) * glm::length(ray_.direction);
  const bool is_small = plane.lengths() < smallest_open * extent_ && std::abs(k.determinant) <= grazing * area;
  if ((side < 0 && (sum(plane.e) <= 0.5 * plane.error || is_small)) || box.depth >= deepest) {
    kept_.emplace_back(*here, box);
    return;
  }
  if (side >= 0) return halve(box, side / 2, true, next);
  if (box.leaf) {
    // Its halves need the second derivatives by themselves.
    const std::optional<PieceBounds> known = leaf_bounds(source_, box.piece, box.centre, box.half);
    box.bounds = known ? int(bounds_.size()) : bounds_none;
    if (!known) return look_without_bounds(box, side, next);
    bounds_.push_back(*known);
  }
  halve(box, best_direction(box, plane), box.depth == 5 || box.depth == 11, next);
}

void RayBoxes::look_without_bounds(const Box& box, int side, std::vector<Box>& next) {
  const auto space = source_.positions(box.piece, {box.centre - box.half, box.centre + box.half});
  double low = low_, high = high_, size = infinity;
  if (space) {
    if (space->lower.x > space->upper.x) return;  // undefined throughout
    const SpaceBox wide{space->lower - ray_.centre - ray_.error - gap_, space->upper - ray_.centre + ray_.error + gap_};
    if (!clip_to_box(wide, ray_.origin, ray_.direction, low, high)) return;
    size = largest(space->upper - space->lower);
  }
  if (size < smallest_unknown * extent_ || box.depth >= deepest_unknown) {
    if (side >= 0 && space) return add_pole(box, side, 0.5 * (space->lower + space->upper) - ray_.centre, size);
    open_.push_back({low, high, box.piece, box.centre, box.half, true});
    return;
  }
  const ParameterBox range = source_.range(box.piece);
  const dvec2 part = box.half / (range.upper - range.lower);
  halve(box, side >= 0 ? side / 2 : (part.x >= part.y ? 0 : 1), true, next);
}

RayBoxes::Verdict RayBoxes::newton(const Box& box, const Plane& plane, const Meeting& k, const dvec2& slack) {
  const double inverse = 1 / k.determinant, size = std::abs(inverse), q = k.q * size, reach = 1 / (1 - q);
  double off = k.off * size * reach;
  if (!(off <= rough)) return Verdict::open;
  double x = std::clamp(k.x * inverse, -1.0, 1.0), y = std::clamp(k.y * inverse, -1.0, 1.0);
  for (int step = 0; step < newton_steps; step++) {
    const dvec2 at = box.centre + box.half * dvec2(x, y);
    const PatchPoint p = source_.at(box.piece, at.x, at.y);
    const dvec3 f = p.position - ray_.centre - k.foot;
    if (!is_finite(f)) return Verdict::open;
    // How far away the root is at most: by the rows of the whole box, whose q is known.
    const double away = std::max(std::abs(glm::dot(k.row_x, f)), std::abs(glm::dot(k.row_y, f))) * size * reach;
    if (std::abs(x) - away > 1 + slack.x + off || std::abs(y) - away > 1 + slack.y + off) return Verdict::none;
    const dvec3 a = box.half.x * p.u, b = box.half.y * p.v, normal = glm::cross(a, b);
    const dvec3 row_x = glm::cross(b, ray_.direction), row_y = glm::cross(ray_.direction, a);
    const double by = 1 / glm::dot(a, row_x);
    const double next_x = x - glm::dot(row_x, f) * by, next_y = y - glm::dot(row_y, f) * by;
    if (!std::isfinite(next_x + next_y)) return Verdict::open;
    if (away <= std::max(settled, off)) {
      // The step's own error is that of second derivatives, which q bounds as well.
      const double left = off + q * reach * away * away;
      const dvec2 beyond = dvec2(std::abs(next_x), std::abs(next_y)) - 1.0 - slack;
      if (beyond.x > left || beyond.y > left) return Verdict::none;
      BoxRoot root;
      root.piece = box.piece;
      root.at = box.centre + box.half * dvec2(next_x, next_y);
      root.alone = 0.8 * (leaf_reach - 1) * box.half;
      root.t = k.t + glm::dot(normal, f) * by;
      const double steep = sum(normal) * std::abs(by);
      root.t_error = steep * (plane.error + sum(plane.e) * away * away);
      root.reach = root.t_error + steep * gap_;
      root.side = k.determinant > 0 ? 1 : -1;
      root.place = k.foot + (root.t - k.t) * ray_.direction;
      add_root(box, root.at, left * box.half, root);
      return Verdict::root;
    }
    const bool stays = std::abs(next_x) <= leaf_reach && std::abs(next_y) <= leaf_reach;
    x = stays ? next_x : std::clamp(next_x, -1.0, 1.0);
    y = stays ? next_y : std::clamp(next_y, -1.0, 1.0);
  }
  return Verdict::open;
}

void RayBoxes::add_root(const Box& box, const dvec2& at, const dvec2& off, BoxRoot root) {
  const ParameterBox range = source_.range(box.piece);
  const PieceBorders& borders = topology_.pieces[box.piece];
  const PatchPoint p = source_.at(box.piece, at.x, at.y);
  std::array<int, 2> end{-1, -1};
  for (int d = 0; d < 2; d++) {
    const double length = glm::length(d == 0 ? p.u : p.v);
    const double near = off[d] + 8 * half_step * std::abs(at[d]) + (length > 0 ? 2 * gap_ / length : 0);
    if (at[d] <= range.lower[d] + near) end[std::size_t(d)] = 0;
    if (at[d] >= range.upper[d] - near) end[std::size_t(d)] = 1;
    if (end[std::size_t(d)] < 0) continue;
    root.is_outside = root.is_outside || at[d] < range.lower[d] || at[d] > range.upper[d];
    const std::size_t side = 2 * std::size_t(d) + std::size_t(end[std::size_t(d)]);
    const std::uint32_t edge = borders.edges[side];
    root.edges[std::size_t(d)] = edge == no_edge ? open_edge : int(2 * edge + (borders.turned[side] ? 1 : 0));
    root.sides[std::size_t(d)] = int(side);
    root.along[std::size_t(d)] = (at[1 - d] - range.lower[1 - d]) / (range.upper[1 - d] - range.lower[1 - d]);
  }
  if (end[0] >= 0 && end[1] >= 0) root.vertex = borders.vertices[std::size_t(end[0]) + 2 * std::size_t(end[1])];
  root.at = glm::clamp(at, range.lower, range.upper);
  roots_.push_back(root);
}

void RayBoxes::add_pole(const Box& box, int side, const dvec3& place, double size) {
  constexpr std::array<std::size_t, 4> corner{0, 1, 0, 2};
  const std::uint32_t vertex = topology_.pieces[box.piece].vertices[corner[std::size_t(side)]];
  const auto pole = std::ranges::lower_bound(topology_.poles, vertex, {}, &Pole::vertex);
  const bool is_known = pole != topology_.poles.end() && pole->vertex == vertex && pole->has_normal;
  const ParameterBox range = source_.range(box.piece);
  const dvec3& d = ray_.direction;
  dvec2 at = range.lower;
  at[side / 2] = side % 2 == 0 ? range.lower[side / 2] : range.upper[side / 2];
  const double length = glm::length(d), t = glm::dot(place - ray_.origin, d) / (length * length);
  const double slope = is_known ? glm::dot(pole->normal, d) / length : 0;
  // Without a normal nothing tells how often a ray passes there; along the plane it touches.
  if (std::abs(slope) < 1e-6) {
    open_.push_back({t - 2 * size / length, t + 2 * size / length, box.piece, at, dvec2(0.0), false});
    return;
  }
  BoxRoot root;
  root.piece = box.piece;
  root.at = at;
  root.t = t;
  root.t_error = 2 * size / (length * std::abs(slope));
  root.reach = root.t_error;
  root.vertex = vertex;
  root.is_pole = true;
  root.place = place;
  root.size = 4 * size / std::abs(slope);
  for (BoxRoot& other : roots_) {
    if (!other.is_pole || other.vertex != vertex) continue;
    other.size = std::max(other.size, root.size);
    other.t_error = std::max(other.t_error, root.t_error);
    return;
  }
  roots_.push_back(root);
}

// Of a flat piece; else 0.
dvec3 RayBoxes::flat_normal(std::uint32_t piece) {
  const auto [known, is_new] = flat_.try_emplace(piece, dvec3(0.0));
  if (!is_new) return known->second;
  constexpr int count = 8;
  const ParameterBox range = source_.range(piece);
  dvec3 normal(0.0), first(0.0);
  for (int k = 0; k < (count + 1) * (count + 1); k++) {
    const int i = k % (count + 1), j = k / (count + 1);
    const dvec2 part(double(i) / count, double(j) / count);
    const dvec2 at = range.lower + part * (range.upper - range.lower);
    const PatchPoint p = source_.at(piece, at.x, at.y);
    const dvec3 n = glm::cross(p.u, p.v);
    if (normal == dvec3(0.0) && glm::length(n) > 1e-6 * glm::length(p.u) * glm::length(p.v)) {
      normal = glm::normalize(n);
      first = p.position;
    }
    if (!(std::abs(glm::dot(normal, p.position - first)) <= flat_within * extent_)) return known->second;
  }
  return known->second = normal;
}

bool RayBoxes::is_apart(const BoxRoot& root) const {
  return std::ranges::none_of(open_, [&](const OpenBox& o) {
    const dvec2 away = glm::abs(root.at - o.at) - 1.5 * o.half;
    return o.piece == root.piece && away.x <= 0 && away.y <= 0;
  });
}

// Of what stays open by rounding, boxes are halved while that tells where it begins and ends.
void RayBoxes::refine_open() {
  // Within a box that is certain nothing is open.
  const auto is_told = [&](const OpenBox& o) {
    return std::ranges::any_of(alone_, [&](const Alone& a) {
      const dvec2 low = o.at - o.half, high = o.at + o.half;
      return a.piece == o.piece && low.x >= a.box.lower.x && low.y >= a.box.lower.y && high.x <= a.box.upper.x &&
             high.y <= a.box.upper.y;
    });
  };
  std::erase_if(kept_, [&](const auto& one) { return is_told(one.first); });
  std::vector<std::pair<OpenBox, Box>> now = std::move(kept_);
  if (now.size() > many_open) {
    // Those amid others stay as they are.
    const auto by_start = [](const auto& one) { return std::pair(one.first.low, one.first.high); };
    std::ranges::sort(now, {}, by_start);
    std::vector<std::pair<OpenBox, Box>> ends;
    for (std::size_t i = 0, next; i < now.size(); i = next) {
      double high = now[i].first.high;
      for (next = i + 1; next < now.size() && now[next].first.low <= high; next++)
        high = std::max(high, now[next].first.high);
      for (std::size_t k = i; k < next; k++) {
        const OpenBox& o = now[k].first;
        const double size = o.high - o.low;
        const bool is_end = o.low < now[i].first.low + 0.5 * size || o.high > high - 0.5 * size;
        if (is_end && ends.size() < 2 * many_open) {
          ends.push_back(now[k]);
        } else {
          open_.push_back(o);
        }
      }
    }
    now.swap(ends);
  }
  for (int round = 0; round < 64; round++) {
    const double length = glm::length(ray_.direction);
    const bool many = now.size() > many_open;
    std::ranges::sort(now, {}, [](const auto& one) { return std::pair(one.first.low, one.first.high); });
    std::vector<std::pair<OpenBox, Box>> then;
    std::vector<std::pair<Box, bool>> halves;
    double reached = -infinity;
    for (std::size_t i = 0; i < now.size(); i++) {
      const auto& [o, box] = now[i];
      const bool begins = o.low > reached;
      double beyond = -infinity;
      for (std::size_t j = 0; j < now.size(); j++) {
        if (j != i && now[j].first.low <= o.high) beyond = std::max(beyond, now[j].first.high);
      }
      reached = std::max(reached, o.high);
      const bool is_end = begins || beyond < o.high;
      if ((o.high - o.low) * length < smallest_open * extent_ || (many && !is_end)) {
        then.push_back(now[i]);
        continue;
      }
      const PatchPoint p = source_.at(box.piece, box.centre.x, box.centre.y);
      const bool in_u = glm::length(p.u) * box.half.x >= glm::length(p.v) * box.half.y;
      Box known = box;
      if (box.leaf || box.bounds < 0) {
        const std::optional<PieceBounds> bounds = leaf_bounds(source_, box.piece, box.centre, box.half);
        if (!bounds) {
          then.push_back(now[i]);
          continue;
        }
        known.bounds = int(bounds_.size());
        bounds_.push_back(*bounds);
      }
      std::vector<Box> two;
      halve(known, in_u ? 0 : 1, false, two);
      for (const Box& half : two) halves.emplace_back(half, o.is_undecided);
    }
    if (halves.empty()) break;
    for (const auto& [half, is_undecided] : halves) {
      const Plane plane = plane_of(half);
      const Meeting k = meet(plane, slack_of(half, plane));
      if (!k.is_met) continue;
      auto one = enclosure(half, plane, k);
      if (!one || is_told(*one)) continue;
      one->is_undecided = is_undecided;
      then.emplace_back(*one, half);
    }
    now.swap(then);
  }
  for (const auto& one : now) open_.push_back(one.first);
}

}  // namespace smurf
