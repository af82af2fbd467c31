#include "patches/topology.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "numerics/parallel.hpp"
#include "patches/clusters.hpp"

namespace smurf {
namespace {

constexpr std::size_t places = 9;       // compared along a side
constexpr double joined_within = 1e-6;  // of the extent
constexpr double collapsed_within = 1e-7;

struct Side {
  std::array<glm::dvec3, places> points;
  bool collapsed = false;
};

// The corners of a side, in the order of the parameter along it.
constexpr std::array<std::array<std::uint32_t, 2>, 4> ends_of_side{{{0, 2}, {1, 3}, {0, 1}, {2, 3}}};

// Whether the parameter along a side grows where the piece's border is followed counter-clockwise in (u, v).
bool runs_along(std::size_t side) { return side == 1 || side == 2; }

glm::dvec2 on_side(const ParameterBox& range, std::size_t side, double part) {
  // Ends are taken as they are: rounding must not part corners.
  const auto along = [&](int d) {
    return part == 1 ? range.upper[d] : range.lower[d] + part * (range.upper[d] - range.lower[d]);
  };
  if (side < 2) return {side == 0 ? range.lower.x : range.upper.x, along(1)};
  return {along(0), side == 2 ? range.lower.y : range.upper.y};
}

double gap(const Side& a, const Side& b, bool reversed) {
  double greatest = 0;
  for (std::size_t i = 0; i < places; i++) {
    const double d = greatest_difference(a.points[i], b.points[reversed ? places - 1 - i : i]);
    if (!(d <= greatest)) greatest = d;
  }
  return greatest;
}

// The two sides that are one edge, and how they run.
struct Match {
  std::uint32_t a = 0, b = 0;
  bool reversed = false;
  double gap = 0;
};

Match better_match(const std::vector<Side>& sides, std::uint32_t a, std::uint32_t b) {
  const double forward = gap(sides[a], sides[b], false), backward = gap(sides[a], sides[b], true);
  return backward < forward ? Match{a, b, true, backward} : Match{a, b, false, forward};
}

// Edges among sides that agree in their end points' clusters.
class Matches {
 public:
  Matches(const std::vector<Side>& sides, double within) : sides_(sides), within_(within), groups_(sides.size()) {}

  void among(const std::vector<std::uint32_t>& candidates) {
    for (std::size_t i = 0; i < candidates.size(); i++) {
      for (std::size_t j = i + 1; j < candidates.size(); j++) {
        const Match match = better_match(sides_, candidates[i], candidates[j]);
        if (!(match.gap <= within_)) continue;
        found_.push_back(match);
        groups_.unite(match.a, match.b);
      }
    }
  }

  // Those of exactly two sides; counts the sides of the others.
  std::vector<Match> edges(std::size_t& branching_sides) {
    std::vector<std::uint32_t> members(sides_.size(), 0);
    for (std::uint32_t s = 0; s < sides_.size(); s++) members[groups_.find(s)]++;
    for (const std::uint32_t n : members) branching_sides += n > 2 ? n : 0;
    std::vector<Match> result;
    for (const Match& match : found_) {
      if (members[groups_.find(match.a)] == 2) result.push_back(match);
    }
    return result;
  }

 private:
  const std::vector<Side>& sides_;
  double within_;
  DisjointSets groups_;
  std::vector<Match> found_;
};

// ---- Poles

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x + v.y + v.z); }

// dn along the surface; `normal` is of unit length.
glm::dmat3 shape_of(const PatchPoint& p, const glm::dvec3& normal) {
  const double uu = glm::dot(p.u, p.u), uv = glm::dot(p.u, p.v), vv = glm::dot(p.v, p.v);
  const double area = uu * vv - uv * uv;
  const glm::dvec3 dual_u = (vv * p.u - uv * p.v) / area, dual_v = (uu * p.v - uv * p.u) / area;
  const double l = glm::dot(p.uu, normal), m = glm::dot(p.uv, normal), n = glm::dot(p.vv, normal);
  return -(l * glm::outerProduct(dual_u, dual_u) +
           m * (glm::outerProduct(dual_u, dual_v) + glm::outerProduct(dual_v, dual_u)) +
           n * glm::outerProduct(dual_v, dual_v));
}

double greatest_element(const glm::dmat3& m) {
  double greatest = 0;
  for (int c = 0; c < 3; c++) {
    for (int r = 0; r < 3; r++) {
      if (!(std::abs(m[c][r]) <= greatest)) greatest = std::abs(m[c][r]);
    }
  }
  return greatest;
}

// The normal in the limit at a place of a collapsed side. There the tangent along the side is 0, and its derivative
// across the side times the way across takes its place.
std::optional<glm::dvec3> limit_normal(const PieceSource& source, std::size_t piece, std::size_t side, double part) {
  const ParameterBox range = source.range(piece);
  const glm::dvec2 place = on_side(range, side, part);
  const PatchPoint p = source.at(piece, place.x, place.y);
  const double inwards = side % 2 == 0 ? 1 : -1;
  const glm::dvec3& across = side < 2 ? p.u : p.v;
  glm::dvec3 normal = inwards * (side < 2 ? glm::cross(p.u, p.uv) : glm::cross(p.uv, p.v));
  double length = glm::length(normal);
  if (!(length > 1e-9 * glm::length(p.uv) * glm::length(across))) {
    // Of higher order, or undefined just there: a place very near it.
    const int d = side < 2 ? 0 : 1;
    glm::dvec2 near = place;
    near[d] += inwards * 1e-6 * (range.upper[d] - range.lower[d]);
    const PatchPoint q = source.at(piece, near.x, near.y);
    normal = glm::cross(q.u, q.v);
    length = glm::length(normal);
  }
  if (!(length > 0) || !is_finite(normal / length)) return std::nullopt;
  return normal / length;
}

// The shape tensor in the limit, by values at two small distances from the side.
glm::dmat3 limit_shape(const PieceSource& source, std::size_t piece, std::size_t side, double part) {
  const ParameterBox range = source.range(piece);
  const int d = side < 2 ? 0 : 1;
  const auto at_distance = [&](double distance) {
    glm::dvec2 place = on_side(range, side, part);
    place[d] += (side % 2 == 0 ? 1 : -1) * distance * (range.upper[d] - range.lower[d]);
    const PatchPoint p = source.at(piece, place.x, place.y);
    return shape_of(p, glm::normalize(glm::cross(p.u, p.v)));
  };
  constexpr double distance = 1e-3;
  return 2.0 * at_distance(distance / 2) - at_distance(distance);
}

struct CollapsedSide {
  std::size_t piece = 0, side = 0;
};

// Looks for limits at 8 places along every collapsed side of the pole.
void find_limits(const PieceSource& source, const PatchTopology& topology, double extent,
                 const std::vector<CollapsedSide>& sides, Pole& pole) {
  constexpr int looks = 8;
  const auto part = [](int i) { return (i + 0.5) / looks; };
  const auto has_turned_side = [&](std::size_t piece) {
    return std::ranges::any_of(topology.pieces[piece].turned, [](bool turned) { return turned; });
  };
  std::vector<double> signs;
  for (const CollapsedSide& s : sides) {
    for (int i = 0; i < looks; i++) {
      std::optional<glm::dvec3> normal = limit_normal(source, s.piece, s.side, part(i));
      if (!normal) return;
      if (signs.empty()) pole.normal = *normal;
      if (i == 0) {
        // Pieces may be turned against each other only where an edge says so.
        const bool other = glm::dot(*normal, pole.normal) < 0 && !signs.empty() &&
                           (has_turned_side(s.piece) || has_turned_side(sides[0].piece));
        signs.push_back(other ? -1 : 1);
      }
      if (!(greatest_difference(signs.back() * *normal, pole.normal) <= 1e-4)) return;
    }
  }
  pole.has_normal = true;
  for (std::size_t n = 0; n < sides.size(); n++) {
    for (int i = 0; i < looks; i++) {
      const glm::dmat3 shape = signs[n] * limit_shape(source, sides[n].piece, sides[n].side, part(i));
      if (n == 0 && i == 0) pole.shape = shape;
      // A flat surface has no curvature to be relative to.
      const double within = 1e-3 * std::max(greatest_element(pole.shape), 1e-2 / extent);
      if (!(greatest_element(shape - pole.shape) <= within)) return;
    }
  }
  pole.has_curvature = true;
}

}  // namespace

PatchTopology join_pieces(const PieceSource& source, double extent, std::array<bool, 2> closed) {
  const double within = joined_within * extent;
  std::vector<Side> sides(4 * source.size());
  parallel_for((source.size() + 63) / 64, [&](std::size_t block) {
    for (std::size_t piece = 64 * block; piece < std::min(64 * block + 64, source.size()); piece++) {
      const ParameterBox range = source.range(piece);
      for (std::size_t s = 0; s < 4; s++) {
        Side& side = sides[4 * piece + s];
        side.collapsed = true;
        for (std::size_t i = 0; i < places; i++) {
          const glm::dvec2 place = on_side(range, s, double(i) / (places - 1));
          side.points[i] = source.at(piece, place.x, place.y).position;
          side.collapsed =
              side.collapsed && greatest_difference(side.points[i], side.points[0]) <= collapsed_within * extent;
        }
      }
    }
  });

  PatchTopology topology;
  topology.pieces.resize(source.size());
  std::vector<glm::dvec3> corners(4 * source.size());
  for (std::uint32_t s = 0; s < sides.size(); s++) {
    const auto [first, last] = ends_of_side[s % 4];
    corners[s - s % 4 + first] = sides[s].points.front();
    corners[s - s % 4 + last] = sides[s].points.back();
  }
  const auto corner = [](std::uint32_t side, std::size_t end) { return side - side % 4 + ends_of_side[side % 4][end]; };

  // Edges.
  const std::vector<std::uint32_t> clusters = cluster_points(corners, within);
  std::map<std::array<std::uint32_t, 2>, std::vector<std::uint32_t>> by_ends;
  for (std::uint32_t s = 0; s < sides.size(); s++) {
    topology.pieces[s / 4].collapsed[s % 4] = sides[s].collapsed;
    const bool declared = source.size() == 1 && closed[s / 2 % 2];
    if (sides[s].collapsed || declared) continue;
    const auto [low, high] = std::minmax(clusters[corner(s, 0)], clusters[corner(s, 1)]);
    by_ends[{low, high}].push_back(s);
  }
  Matches matches(sides, within);
  for (const auto& [ends, candidates] : by_ends) matches.among(candidates);
  std::vector<Match> edges = matches.edges(topology.branching_sides);
  for (std::uint32_t d = 0; d < 2 && source.size() == 1; d++) {
    const std::uint32_t a = 2 * d, b = a + 1;
    if (closed[d] && !sides[a].collapsed && !sides[b].collapsed) edges.push_back(better_match(sides, a, b));
  }
  std::ranges::sort(edges, {}, &Match::a);

  DisjointSets vertices(corners.size());
  for (std::uint32_t c = 0; c < corners.size(); c++) vertices.unite(c, clusters[c]);
  for (const Match& match : edges) {
    const auto number = std::uint32_t(topology.edges++);
    for (const std::uint32_t s : {match.a, match.b}) {
      PieceBorders& borders = topology.pieces[s / 4];
      borders.edges[s % 4] = number;
      // Fitting borders run against each other.
      borders.turned[s % 4] = (runs_along(match.a % 4) == runs_along(match.b % 4)) != match.reversed;
    }
    vertices.unite(corner(match.a, 0), corner(match.b, match.reversed ? 1 : 0));
    vertices.unite(corner(match.a, 1), corner(match.b, match.reversed ? 0 : 1));
    topology.greatest_gap = std::max(topology.greatest_gap, match.gap);
  }

  // Vertices, and the poles among them.
  std::vector<std::uint32_t> numbers(corners.size(), no_edge);
  for (std::uint32_t s = 0; s < sides.size(); s++) {
    if (sides[s].collapsed) vertices.unite(corner(s, 0), corner(s, 1));
    if (!sides[s].collapsed && topology.pieces[s / 4].edges[s % 4] == no_edge) topology.open_sides++;
  }
  for (std::uint32_t c = 0; c < corners.size(); c++) {
    std::uint32_t& number = numbers[vertices.find(c)];
    if (number == no_edge) number = std::uint32_t(topology.vertices++);
    topology.pieces[c / 4].vertices[c % 4] = number;
  }
  std::map<std::uint32_t, std::vector<CollapsedSide>> collapsed;
  std::vector<bool> ordinary(topology.vertices);  // where a piece comes with a corner that is none of a collapsed side
  for (std::uint32_t s = 0; s < sides.size(); s++) {
    if (sides[s].collapsed)
      collapsed[topology.pieces[s / 4].vertices[ends_of_side[s % 4][0]]].push_back({s / 4, s % 4});
  }
  for (std::uint32_t c = 0; c < corners.size(); c++) {
    const PieceBorders& borders = topology.pieces[c / 4];
    if (!borders.collapsed[c % 2] && !borders.collapsed[2 + c % 4 / 2]) ordinary[borders.vertices[c % 4]] = true;
  }
  for (const auto& [vertex, around] : collapsed) {
    Pole pole;
    pole.vertex = vertex;
    pole.position = sides[4 * around[0].piece + around[0].side].points[0];
    if (!ordinary[vertex]) find_limits(source, topology, extent, around, pole);
    topology.poles.push_back(pole);
  }
  return topology;
}

}  // namespace smurf
