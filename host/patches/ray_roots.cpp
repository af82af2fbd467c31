#include "patches/ray_roots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>

#include "patches/ray_boxes.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double along_edge = 1e-3;       // by how much places along an edge may differ, in parts of it
constexpr double near_border = 1e-9;      // of the extent: what lies beyond a box or a stretch by less is looked at
constexpr double longest_tangent = 9e-3;  // of the extent: along longer ones the ray lies in the surface
constexpr std::uint32_t most_in_node = 4;

// ---- What is told once

// Two roots at borders in directions d and e that are one edge: 1, or -1 where the surface turns over between them; 0
// where they are at different places along it. As kernels/patch/roots.inc.
int at_edge(const BoxRoot& a, std::size_t d, const BoxRoot& b, std::size_t e) {
  const bool turned = (a.edges[d] & 1) != 0, same = a.piece == b.piece && a.sides[d] == b.sides[e];
  const auto runs_with = [](int side) { return side == 1 || side == 2; };
  const bool reversed = !same && ((runs_with(a.sides[d]) == runs_with(b.sides[e])) != turned);
  const double along = reversed ? 1 - b.along[e] : b.along[e];
  if (std::abs(a.along[d] - along) > along_edge) return 0;
  return turned && !same ? -1 : 1;
}

// Whether two roots at borders are at the same place of an edge, or with `by_vertex` at the same vertex: 0, or 1, or -1
// where the surface turns over between them.
int related(const BoxRoot& a, const BoxRoot& b, bool by_vertex) {
  if (std::abs(a.t - b.t) > 4 * (a.reach + b.reach)) return 0;
  if (by_vertex) return a.vertex != no_vertex && a.vertex == b.vertex ? 1 : 0;
  for (std::size_t d = 0; d < 2; d++) {
    for (std::size_t e = 0; e < 2; e++) {
      if (a.edges[d] == open_edge && b.edges[e] == open_edge && a.piece != b.piece) return 1;
      if (a.edges[d] < 0 || b.edges[e] < 0 || a.edges[d] / 2 != b.edges[e] / 2) continue;
      if (const int at = at_edge(a, d, b, e); at != 0) return at;
    }
  }
  return 0;
}

bool is_same(const BoxRoot& a, const BoxRoot& b) {
  if (a.piece != b.piece) return false;
  const dvec2 apart = glm::abs(a.at - b.at);
  return (apart.x <= a.alone.x && apart.y <= a.alone.y) || (apart.x <= b.alone.x && apart.y <= b.alone.y);
}

// Leaves one of the roots that stand for the same crossing.
void join(std::vector<BoxRoot>& roots) {
  std::ranges::sort(roots, {}, [](const BoxRoot& r) { return std::tuple(r.is_outside, r.piece, r.at.x, r.at.y); });
  std::vector<BoxRoot> distinct;
  for (const BoxRoot& root : roots) {
    if (std::ranges::none_of(distinct, [&](const BoxRoot& other) { return is_same(root, other); }))
      distinct.push_back(root);
  }
  // Groups of related roots, and whether the surface turns over on the way to a group's first.
  std::vector<std::size_t> group(distinct.size());
  std::iota(group.begin(), group.end(), std::size_t(0));
  std::vector<int> turn(distinct.size(), 1);
  for (const bool by_vertex : {false, true}) {
    for (std::size_t i = 0; i < distinct.size(); i++) {
      for (std::size_t j = 0; j < i; j++) {
        const int relation = group[i] == group[j] ? 0 : related(distinct[i], distinct[j], by_vertex);
        if (relation == 0) continue;
        const std::size_t from = group[i], to = group[j];
        const int turned = relation * turn[i] * turn[j];
        for (std::size_t k = 0; k < distinct.size(); k++) {
          if (group[k] != from) continue;
          group[k] = to;
          turn[k] *= turned;
        }
      }
    }
  }
  roots.clear();
  for (std::size_t g = 0; g < distinct.size(); g++) {
    std::optional<std::size_t> up, down;  // those that are inside come first
    std::size_t count = 0;
    bool inside = false, shared = true;
    for (std::size_t k = 0; k < distinct.size(); k++) {
      if (group[k] != g) continue;
      count++;
      inside = inside || !distinct[k].is_outside;
      shared = shared && distinct[k].edges[0] != open_edge && distinct[k].edges[1] != open_edge;
      std::optional<std::size_t>& best = distinct[k].side * turn[k] >= 0 ? up : down;
      if (!best) best = k;
    }
    // A silhouette that no piece has inside is passed by. What is outside by rounding alone, at an edge whose other
    // side tells nothing, lies along a piece that the ray runs in: such pieces are not hit, and their edges are.
    if (!inside && up && down) continue;
    if (!inside && count == 1 && !shared) continue;
    if (up) roots.push_back(distinct[*up]);
    if (down) roots.push_back(distinct[*down]);
  }
}

// ---- What is left open

// Enclosures that touch are one.
std::vector<OpenBox> clusters(std::vector<OpenBox> open, double touching) {
  std::ranges::sort(open, {}, [](const OpenBox& o) { return std::tuple(o.low, o.high, o.piece, o.at.x, o.at.y); });
  std::vector<OpenBox> joined;
  for (const OpenBox& one : open) {
    if (joined.empty() || one.low > joined.back().high + touching) {
      joined.push_back(one);
      continue;
    }
    joined.back().high = std::max(joined.back().high, one.high);
    joined.back().is_undecided = joined.back().is_undecided || one.is_undecided;
  }
  return joined;
}

}  // namespace

// ---- Leaves along a line

LeafBoxes::LeafBoxes(const std::vector<PatchLeaf>& leaves, double margin) {
  numbers_.resize(leaves.size());
  std::iota(numbers_.begin(), numbers_.end(), 0u);
  if (!leaves.empty()) build(leaves, margin, 0, std::uint32_t(leaves.size()));
}

std::uint32_t LeafBoxes::build(const std::vector<PatchLeaf>& leaves, double margin, std::uint32_t first,
                               std::uint32_t count) {
  const auto number = std::uint32_t(nodes_.size());
  SpaceBox box{dvec3(infinity), dvec3(-infinity)}, middles = box;
  const auto middle = [&](std::uint32_t n) { return 0.5 * (leaves[n].lower + leaves[n].upper); };
  for (const std::uint32_t n : std::span(numbers_).subspan(first, count)) {
    box = {glm::min(box.lower, leaves[n].lower), glm::max(box.upper, leaves[n].upper)};
    middles = {glm::min(middles.lower, middle(n)), glm::max(middles.upper, middle(n))};
  }
  nodes_.push_back({{box.lower - margin, box.upper + margin}, first, count});
  if (count <= most_in_node) return number;
  const dvec3 size = middles.upper - middles.lower;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  const std::uint32_t half = count / 2;
  const auto begin = numbers_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(middle(a)[axis], a) < std::pair(middle(b)[axis], b);
  });
  build(leaves, margin, first, half);
  const std::uint32_t second = build(leaves, margin, first + half, count - half);
  nodes_[number].first = second;
  nodes_[number].count = 0;
  return number;
}

void LeafBoxes::along(const dvec3& origin, const dvec3& direction, double low, double high,
                      std::vector<std::uint32_t>& found) const {
  std::vector<std::uint32_t> waiting;
  if (!nodes_.empty()) waiting.push_back(0);
  while (!waiting.empty()) {
    const std::uint32_t number = waiting.back();
    waiting.pop_back();
    const Node& node = nodes_[number];
    double from = low, to = high;
    if (!clip_to_box(node.box, origin, direction, from, to)) continue;
    if (node.count == 0) {
      waiting.push_back(node.first);
      waiting.push_back(number + 1);
    }
    found.insert(found.end(), numbers_.begin() + node.first,
                 numbers_.begin() + node.first + (node.count == 0 ? 0 : node.count));
  }
}

// ---- Roots of a ray

RayRoots::RayRoots(const PieceSource& source, const PatchTopology& topology, std::vector<PatchLeaf> leaves,
                   double extent)
    : source_(source),
      topology_(topology),
      leaves_(std::move(leaves)),
      extent_(extent),
      boxes_(leaves_, near_border * extent + gap_of(topology, extent)) {
  SpaceBox all{dvec3(infinity), dvec3(-infinity)};
  for (const PatchLeaf& leaf : leaves_) all = {glm::min(all.lower, leaf.lower), glm::max(all.upper, leaf.upper)};
  if (!leaves_.empty()) centre_ = dvec3(glm::vec3(0.5 * (all.lower + all.upper)));
}

void RayRoots::find(const dvec3& origin, const dvec3& direction, double low, double high,
                    std::vector<PatchRoot>& roots) const {
  const BoxRay ray = box_ray(origin, direction, centre_, extent_);
  const double beyond = near_border * extent_ / glm::length(direction);
  std::vector<std::uint32_t> found;
  boxes_.along(ray.origin + centre_, direction, low - ray.start - beyond, high - ray.start + beyond, found);
  RayBoxes boxes(source_, topology_, extent_, ray, low - ray.start - beyond, high - ray.start + beyond);
  std::ranges::sort(found);
  for (const std::uint32_t number : found) boxes.add(leaves_[number]);
  boxes.search();

  std::vector<BoxRoot> single = boxes.roots();
  std::vector<OpenBox> open = boxes.open();
  open = clusters(std::move(open), 1e-12 * extent_ / glm::length(direction));
  // A root at the border of boxes that stay open is told by them.
  std::erase_if(single, [&](const BoxRoot& r) {
    return std::ranges::any_of(open, [&](const OpenBox& o) {
      return o.low <= r.t + r.t_error && o.high >= r.t - r.t_error && (r.is_pole || !boxes.is_apart(r));
    });
  });
  join(single);
  // What regular boxes tell next to a pole is not told again at the pole.
  const std::vector<BoxRoot> all = single;
  std::erase_if(single, [&](const BoxRoot& pole) {
    return pole.is_pole && std::ranges::any_of(all, [&](const BoxRoot& r) {
             return !r.is_pole && glm::distance(r.place, pole.place) <= 2 * pole.size &&
                    (pole.side == 0 || r.side == pole.side);
           });
  });

  const std::size_t before = roots.size();
  using Kind = expression::LineRoot::Kind;
  for (const BoxRoot& r : single) {
    const double t = r.t + ray.start;
    const double error = r.t_error + 4e-16 * (std::abs(r.t) + std::abs(ray.start));
    if (t < low || t > high) continue;
    roots.push_back({{t - error, t + error, Kind::one}, r.piece, r.at.x, r.at.y});
  }
  for (const OpenBox& o : open) {
    const double error = 4e-16 * (std::abs(o.low) + std::abs(o.high) + std::abs(ray.start));
    const double from = std::max(o.low + ray.start - error, low), to = std::min(o.high + ray.start + error, high);
    if (from > to) continue;
    const bool along = (o.high - o.low) * glm::length(direction) > longest_tangent * extent_;
    roots.push_back({{from, to, o.is_undecided || along ? Kind::undecided : Kind::touching}, o.piece, o.at.x, o.at.y});
  }
  std::sort(roots.begin() + std::ptrdiff_t(before), roots.end(), [](const PatchRoot& a, const PatchRoot& b) {
    return std::tuple(a.root.low + a.root.high, a.piece, a.u, a.v) <
           std::tuple(b.root.low + b.root.high, b.piece, b.u, b.v);
  });
}

}  // namespace smurf
