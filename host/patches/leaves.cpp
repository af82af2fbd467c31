#include "patches/leaves.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "numerics/parallel.hpp"

namespace smurf {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int deepest = 40;
constexpr double thinnest_leaf = 1e-8;  // of the extent: of no size to work with
// Leaves that are undefined somewhere may lie along curves: they end at this part of the extent, and of the range,
// because a square root at 0 is steeper than any number of them.
constexpr double smallest_undefined_leaf = 1e-4, smallest_undefined_part = 1.0 / 2048;
constexpr double smallest_wide_part = 1.0 / 64;
// Of the range, but for graded leaves: where a surface is that steep, whole areas would end in ever smaller leaves.
constexpr double smallest_area = 0x1p-20;

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x + v.y + v.z); }

struct Box {
  std::uint32_t piece = 0;
  int depth = 0;
  ParameterBox box{};

  std::array<Box, 2> halves(int direction) const {
    std::array<Box, 2> result{*this, *this};
    const double middle = 0.5 * (box.lower[direction] + box.upper[direction]);
    result[0].box.upper[direction] = result[1].box.lower[direction] = middle;
    result[0].depth = result[1].depth = depth + 1;
    return result;
  }
};

// What becomes of a box: a leaf (-1), its halves in a direction (0 or 1), or nothing.
constexpr int left_out = -2;
struct Outcome {
  int split = -1;
  PatchLeaf leaf{};
};

class Splitter {
 public:
  Splitter(const PieceSource& source, const PatchTopology& topology, double extent)
      : source_(source), topology_(topology), extent_(extent) {}

  Outcome look_at(const Box& box) const {
    const std::optional<Outcome> at_pole = at_collapsed_side(box);
    return at_pole ? *at_pole : elsewhere(box);
  }

 private:
  PatchLeaf leaf_of(const Box& box) const {
    PatchLeaf leaf;
    leaf.piece = box.piece;
    leaf.centre = 0.5 * (box.box.lower + box.box.upper);
    leaf.half = 0.5 * (box.box.upper - box.box.lower);
    return leaf;
  }

  Outcome elsewhere(const Box& box) const {
    Outcome outcome{-1, leaf_of(box)};
    PatchLeaf& leaf = outcome.leaf;
    const PatchPoint p = source_.at(box.piece, leaf.centre.x, leaf.centre.y);
    leaf.m = p.position;
    leaf.a = leaf.half.x * p.u;
    leaf.b = leaf.half.y * p.v;
    const double length_a = glm::length(leaf.a), length_b = glm::length(leaf.b);
    const std::optional<PieceBounds> bounds = leaf_bounds(source_, box.piece, leaf.centre, leaf.half);
    const bool known = bounds && is_finite(leaf.m) && is_finite(leaf.a) && is_finite(leaf.b);
    if (!known) return undefined(box, leaf);
    leaf.e = leaf_remainder(*bounds, leaf.half);
    leaf.error = bounds->error;

    const double shorter = std::min(length_a, length_b);
    if (!too_wide(box, leaf) && glm::length(leaf.e) <= limit(box) * shorter) return finished(box, leaf);
    outcome.split = best_direction(box, *bounds, leaf);
    const double length = outcome.split == 0 ? length_a : length_b, off = glm::length(leaf.e);
    const bool small = length_a + length_b + off < smallest_leaf * extent_ || length + off < thinnest_leaf * extent_;
    const ParameterBox range = source_.range(box.piece);
    const glm::dvec2 parts = 2.0 * leaf.half / (range.upper - range.lower);
    const bool tiny = limit(box) == largest_remainder && parts.x * parts.y < smallest_area;
    if (box.depth >= deepest || small || tiny) return finished(box, leaf);
    return outcome;
  }

  // Boxes of wide leaves exclude little. But where a surface goes to infinity, no number of leaves is enough.
  bool too_wide(const Box& box, const PatchLeaf& leaf) const {
    const ParameterBox range = source_.range(box.piece);
    const double length_a = glm::length(leaf.a), length_b = glm::length(leaf.b);
    const int d = length_a > length_b ? 0 : 1;
    const double part = (box.box.upper[d] - box.box.lower[d]) / (range.upper[d] - range.lower[d]);
    return std::max(length_a, length_b) > widest_leaf * extent_ && part > smallest_wide_part;
  }

  // How long e may be, relative to |a| and |b|.
  double limit(const Box& box) const {
    const ParameterBox range = source_.range(box.piece);
    const std::array<bool, 4>& collapsed = topology_.pieces[box.piece].collapsed;
    for (int d = 0; d < 2; d++) {
      const double near = 0.125 * (range.upper[d] - range.lower[d]);
      if (collapsed[2 * std::size_t(d)] && box.box.upper[d] - range.lower[d] <= near) return largest_graded_remainder;
      if (collapsed[2 * std::size_t(d) + 1] && range.upper[d] - box.box.lower[d] <= near)
        return largest_graded_remainder;
    }
    return largest_remainder;
  }

  // The one whose halving leaves the least remainder beside the shorter tangent, as far as is known beforehand.
  int best_direction(const Box& box, const PieceBounds& bounds, const PatchLeaf& leaf) const {
    const double length_a = glm::length(leaf.a), length_b = glm::length(leaf.b);
    if (too_wide(box, leaf)) return length_a > length_b ? 0 : 1;
    const double in_u =
        glm::length(leaf_remainder(bounds, {0.5 * leaf.half.x, leaf.half.y})) / std::min(0.5 * length_a, length_b);
    const double in_v =
        glm::length(leaf_remainder(bounds, {leaf.half.x, 0.5 * leaf.half.y})) / std::min(length_a, 0.5 * length_b);
    if (in_u < in_v) return 0;
    if (in_v < in_u) return 1;
    if (length_a != length_b) return length_a < length_b ? 0 : 1;  // one is 0: only of its own halves it may be none
    return wider_in_range(box);
  }

  int wider_in_range(const Box& box) const {
    const ParameterBox range = source_.range(box.piece);
    const glm::dvec2 parts = (box.box.upper - box.box.lower) / (range.upper - range.lower);
    return parts.x >= parts.y ? 0 : 1;
  }

  // Split until it is small in space.
  Outcome undefined(const Box& box, PatchLeaf& leaf) const {
    const std::optional<SpaceBox> space = source_.positions(box.piece, box.box);
    leaf.kind = LeafKind::open;
    leaf.a = leaf.b = leaf.e = leaf.error = glm::dvec3(0);
    if (!is_finite(leaf.m)) leaf.m = glm::dvec3(0);
    leaf.lower = space ? space->lower : glm::dvec3(-infinity);
    leaf.upper = space ? space->upper : glm::dvec3(infinity);
    const glm::dvec3 size = leaf.upper - leaf.lower;
    if (size.x < 0) return {left_out, leaf};
    const int d = wider_in_range(box);
    const ParameterBox range = source_.range(box.piece);
    const double part = (box.box.upper[d] - box.box.lower[d]) / (range.upper[d] - range.lower[d]);
    const double greatest = std::max({size.x, size.y, size.z});  // infinite where nothing is known
    const bool small = greatest < smallest_undefined_leaf * extent_ || part < smallest_undefined_part;
    if (box.depth >= deepest || small) return {-1, leaf};
    return {d, leaf};
  }

  Outcome finished(const Box& box, PatchLeaf& leaf) const {
    const glm::dvec3 bend = leaf.e / (2 * leaf_reach);
    const glm::dvec3 reach = (glm::abs(leaf.a) + glm::abs(leaf.b) + bend) * (1 + 1e-12) + 1e-15 * glm::abs(leaf.m);
    leaf.lower = leaf.m - reach;
    leaf.upper = leaf.m + reach;
    if (const std::optional<SpaceBox> space = source_.positions(box.piece, box.box)) {
      leaf.lower = glm::max(leaf.lower, space->lower);
      leaf.upper = glm::min(leaf.upper, space->upper);
    }
    return {-1, leaf};
  }

  // Of a box that touches a collapsed side: it is split across until it is small, then it becomes caps.
  std::optional<Outcome> at_collapsed_side(const Box& box) const {
    const ParameterBox range = source_.range(box.piece);
    const PieceBorders& borders = topology_.pieces[box.piece];
    for (int side = 0; side < 4; side++) {
      const int d = side / 2, along = 1 - d;
      const bool least = side % 2 == 0;
      const bool touches = least ? box.box.lower[d] == range.lower[d] : box.box.upper[d] == range.upper[d];
      if (!borders.collapsed[std::size_t(side)] || !touches) continue;
      // Far from the side nothing is known of the way there: the opposite side may be collapsed as well.
      if (box.box.upper[d] - box.box.lower[d] > 0.25 * (range.upper[d] - range.lower[d]))
        return Outcome{d, leaf_of(box)};
      const auto opposite = [&](double part) {
        glm::dvec2 place;
        place[d] = least ? box.box.upper[d] : box.box.lower[d];
        place[along] = box.box.lower[along] + part * (box.box.upper[along] - box.box.lower[along]);
        return source_.at(box.piece, place.x, place.y).position;
      };
      glm::dvec2 end;
      end[d] = least ? range.lower[d] : range.upper[d];
      end[along] = 0.5 * (box.box.lower[along] + box.box.upper[along]);
      PatchLeaf leaf = leaf_of(box);
      leaf.kind = LeafKind::cap;
      leaf.side = side;
      leaf.m = pole_of(borders, side, end, box.piece);
      const glm::dvec3 a = opposite(0) - leaf.m, b = opposite(1) - leaf.m, middle = opposite(0.5) - leaf.m;
      const double size = std::max({glm::length(a), glm::length(b), glm::length(middle)});
      if (!std::isfinite(size)) return undefined(box, leaf);
      if (size > widest_cap * extent_ && box.depth < deepest) return Outcome{d, leaf};
      const double off = glm::length(middle - 0.5 * (a + b));
      if (off > 0.02 * size && box.depth < deepest + 12) return Outcome{along, leaf};
      // How far the surface leaves the triangle's plane half way out.
      const glm::dvec3 normal = glm::cross(a, b);
      const glm::dvec2 place = half_way(end, d, box);
      const glm::dvec3 inner = source_.at(box.piece, place.x, place.y).position - leaf.m;
      const double bend = std::abs(glm::dot(inner, normal)) / glm::length(normal);
      const bool small = size < small_cap * extent_;
      const bool flat = size < cap_size * extent_ || bend < (small ? 2e-3 * size : flat_cap * extent_);
      // Next to a tip the arc is what leaves the plane; else it is the way out.
      const bool arc = small && off > 2e-3 * size && box.depth < deepest + 12;
      if (!flat && (arc || box.depth < deepest)) return Outcome{arc ? along : d, leaf};
      finish_cap(box, leaf, a, b);
      return Outcome{-1, leaf};
    }
    return std::nullopt;
  }

  // Between a place at a collapsed side and the opposite border of the box.
  static glm::dvec2 half_way(const glm::dvec2& end, int d, const Box& box) {
    glm::dvec2 place = end;
    place[d] = 0.5 * (box.box.lower[d] + box.box.upper[d]);
    return place;
  }

  glm::dvec3 pole_of(const PieceBorders& borders, int side, const glm::dvec2& place, std::uint32_t piece) const {
    constexpr std::array<std::size_t, 4> corner{0, 1, 0, 2};
    const std::uint32_t vertex = borders.vertices[corner[std::size_t(side)]];
    const auto pole = std::ranges::lower_bound(topology_.poles, vertex, {}, &Pole::vertex);
    if (pole != topology_.poles.end() && pole->vertex == vertex) return pole->position;
    return source_.at(piece, place.x, place.y).position;
  }

  void finish_cap(const Box& box, PatchLeaf& leaf, const glm::dvec3& a, const glm::dvec3& b) const {
    leaf.a = cap_reach * a;
    leaf.b = cap_reach * b;
    leaf.lower = glm::min(leaf.m, glm::min(leaf.m + leaf.a, leaf.m + leaf.b));
    leaf.upper = glm::max(leaf.m, glm::max(leaf.m + leaf.a, leaf.m + leaf.b));
    if (const std::optional<SpaceBox> space = source_.positions(box.piece, box.box)) {
      // Bounds that are wild for so small a leaf say nothing.
      const glm::dvec3 size = space->upper - space->lower;
      if (std::max({size.x, size.y, size.z}) < 100 * widest_cap * extent_) {
        leaf.lower = glm::min(leaf.lower, space->lower);
        leaf.upper = glm::max(leaf.upper, space->upper);
      }
    }
    const std::optional<PieceBounds> bounds = source_.bounds(box.piece, box.box);
    // Where no bound is known, as of a square root at the pole, a part of the cap's size takes its place.
    leaf.error = bounds ? bounds->error : glm::dvec3(0.25 * cap_size * extent_);
  }

  const PieceSource& source_;
  const PatchTopology& topology_;
  double extent_;
};

// A box that is to be split further, or what has become of it.
struct Part {
  std::optional<Box> box{};
  std::vector<PatchLeaf> leaves{};
};

std::vector<PatchLeaf> split_all(const Splitter& splitter, const Box& top) {
  std::vector<PatchLeaf> leaves;
  std::vector<Box> waiting{top};
  while (!waiting.empty()) {
    const Box box = waiting.back();
    waiting.pop_back();
    const Outcome outcome = splitter.look_at(box);
    if (outcome.split < 0) {
      if (outcome.split != left_out) leaves.push_back(outcome.leaf);
      continue;
    }
    const auto halves = box.halves(outcome.split);
    waiting.push_back(halves[1]);
    waiting.push_back(halves[0]);
  }
  return leaves;
}

// What `splitter` does once to every box, so that few pieces become enough boxes for all threads.
std::vector<Part> split_once(const Splitter& splitter, std::vector<Part> parts) {
  std::vector<Part> result;
  for (Part& part : parts) {
    if (!part.box) {
      result.push_back(std::move(part));
      continue;
    }
    const Outcome outcome = splitter.look_at(*part.box);
    if (outcome.split < 0) {
      if (outcome.split != left_out) result.push_back({std::nullopt, {outcome.leaf}});
      continue;
    }
    for (const Box& half : part.box->halves(outcome.split)) result.push_back({half, {}});
  }
  return result;
}

}  // namespace

std::optional<PieceBounds> leaf_bounds(const PieceSource& source, std::size_t piece, const glm::dvec2& centre,
                                       const glm::dvec2& half) {
  ParameterBox wide{centre - leaf_reach * half, centre + leaf_reach * half};
  std::optional<PieceBounds> bounds = source.bounds(piece, wide);
  if (bounds) return bounds;
  const ParameterBox range = source.range(piece);
  wide = {glm::max(wide.lower, range.lower), glm::min(wide.upper, range.upper)};
  return source.bounds(piece, wide);
}

glm::dvec3 leaf_remainder(const PieceBounds& bounds, const glm::dvec2& half) {
  return leaf_reach * (1 + 1e-6) *
         (bounds.uu * (half.x * half.x) + 2.0 * bounds.uv * (half.x * half.y) + bounds.vv * (half.y * half.y));
}

std::vector<PatchLeaf> make_leaves(const PieceSource& source, const PatchTopology& topology, double extent,
                                   const std::function<void(std::size_t done, std::size_t total)>& progress) {
  const Splitter splitter(source, topology, extent);
  std::vector<Part> parts;
  for (std::size_t piece = 0; piece < source.size(); piece++)
    parts.push_back({Box{std::uint32_t(piece), 0, source.range(piece)}, {}});
  constexpr std::size_t enough = 128;
  for (int round = 0; round < 12 && parts.size() < enough; round++) parts = split_once(splitter, std::move(parts));

  std::mutex mutex;
  std::size_t done = 0;
  parallel_for(parts.size(), [&](std::size_t i) {
    Part& part = parts[i];
    if (part.box) part.leaves = split_all(splitter, *part.box);
    if (!progress) return;
    const std::lock_guard lock(mutex);
    progress(++done, parts.size());
  });

  std::vector<PatchLeaf> leaves;
  for (Part& part : parts) leaves.insert(leaves.end(), part.leaves.begin(), part.leaves.end());
  // Where nothing is known, a leaf may be anywhere that the surface is.
  glm::dvec3 lower(infinity), upper(-infinity);
  for (const PatchLeaf& leaf : leaves) {
    if (!is_finite(leaf.lower) || !is_finite(leaf.upper)) continue;
    lower = glm::min(lower, leaf.lower);
    upper = glm::max(upper, leaf.upper);
  }
  for (PatchLeaf& leaf : leaves) {
    if (is_finite(leaf.lower) && is_finite(leaf.upper)) continue;
    leaf.lower = lower;
    leaf.upper = upper;
  }
  return leaves;
}

}  // namespace smurf
