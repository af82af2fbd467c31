#include "surfaces/parametric/examine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "numerics/parallel.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity();

bool is_finite(const dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }
double greatest(const dvec3& p) { return std::max({p.x, p.y, p.z}); }
double size_of(const dvec3& p) { return greatest(glm::abs(p)); }

struct Hull {
  dvec3 lower{infinity}, upper{-infinity};
  void add(const dvec3& p) {
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  void add(const Hull& other) {
    lower = glm::min(lower, other.lower);
    upper = glm::max(upper, other.upper);
  }
  bool is_empty() const { return !(lower.x <= upper.x); }
  bool is_finite() const { return smurf::is_finite(lower) && smurf::is_finite(upper); }
  bool holds(const Hull& other) const {
    return glm::all(glm::lessThanEqual(lower, other.lower)) && glm::all(glm::lessThanEqual(other.upper, upper));
  }
};

dvec2 place_in(const ParameterBox& box, double x, double y) {
  return box.lower + dvec2(x, y) * (box.upper - box.lower);
}

// Of (count + 1)² points, where they are defined.
Hull hull_of_samples(const PieceSource& source, std::size_t piece, const ParameterBox& box, int count) {
  Hull hull;
  for (int j = 0; j <= count; j++) {
    for (int i = 0; i <= count; i++) {
      const dvec2 at = place_in(box, double(i) / count, double(j) / count);
      const dvec3 p = source.at(piece, at.x, at.y).position;
      if (is_finite(p)) hull.add(p);
    }
  }
  return hull;
}

// From bounds of the position, and from Taylor's expansion about the middle, which is the closer of the two in small
// boxes. Nothing where there is none.
std::optional<Hull> hull_of(const PieceSource& source, std::size_t piece, const ParameterBox& box) {
  const auto bounds = source.bounds(piece, box);
  if (!bounds) {
    const auto positions = source.positions(piece, box);
    if (!positions) return std::nullopt;
    const Hull hull{positions->lower, positions->upper};
    return hull.is_finite() ? std::optional(hull) : std::nullopt;
  }
  Hull hull{bounds->lower, bounds->upper};
  const dvec2 middle = place_in(box, 0.5, 0.5), half = 0.5 * (box.upper - box.lower);
  const PatchPoint at = source.at(piece, middle.x, middle.y);
  const dvec3 reach = half.x * glm::abs(at.u) + half.y * glm::abs(at.v) + 0.5 * half.x * half.x * bounds->uu +
                      half.x * half.y * bounds->uv + 0.5 * half.y * half.y * bounds->vv;
  const dvec3 rounding = 1e-13 * (glm::abs(at.position) + reach);
  const dvec3 lower = at.position - reach - rounding, upper = at.position + reach + rounding;
  if (is_finite(lower) && is_finite(upper)) {
    hull.lower = glm::max(hull.lower, lower);
    hull.upper = glm::min(hull.upper, upper);
  }
  return hull.is_finite() ? std::optional(hull) : std::nullopt;
}

// Of a box that no bounds are known of: what samples show. Follows the greatest of them into ever smaller boxes; where
// it keeps growing the surface is unbounded.
Hull hull_by_samples(const PieceSource& source, std::size_t piece, ParameterBox box) {
  constexpr int count = 4, steps = 30;
  constexpr double growth = 1e5;  // a pole of first order gives 1e9, one of a logarithm or a square root far less
  Hull all;
  double first = 0;
  for (int step = 0; step < steps; step++) {
    dvec2 top = place_in(box, 0.5, 0.5);
    double most = 0;
    for (int j = 0; j <= count; j++) {
      for (int i = 0; i <= count; i++) {
        const dvec2 at = place_in(box, double(i) / count, double(j) / count);
        const dvec3 p = source.at(piece, at.x, at.y).position;
        const double size = size_of(p);
        if (is_finite(p)) all.add(p);
        if (size > most) {
          most = size;
          top = at;
        }
      }
    }
    if (step == 0) first = most;
    if (most > growth * first)
      throw Error(ErrorCode::input,
                  fmt::format("the surface goes to infinity near u = {:g}, v = {:g}; leave that out", top.x, top.y));
    const dvec2 quarter = 0.25 * (box.upper - box.lower);
    top = glm::clamp(top, box.lower + quarter, box.upper - quarter);
    box = {top - quarter, top + quarter};
  }
  if (!all.is_empty()) {
    const dvec3 margin = 0.1 * (all.upper - all.lower);
    all.lower -= margin;
    all.upper += margin;
  }
  return all;
}

// Breadth first, so that all of the piece is looked at equally closely when the budget ends.
Hull hull_of_piece(const PieceSource& source, std::size_t piece, const Hull& samples, std::size_t budget) {
  constexpr double closely = 1e-4;
  const dvec3 margin(closely * greatest(samples.upper - samples.lower));
  const Hull near{samples.lower - margin, samples.upper + margin};
  constexpr int most_followed = 16;  // boxes that are told by samples alone
  int followed = 0;
  Hull all;
  std::deque<ParameterBox> boxes{source.range(piece)};
  for (std::size_t done = 0; !boxes.empty(); done++) {
    const ParameterBox box = boxes.front();
    boxes.pop_front();
    const auto hull = hull_of(source, piece, box);
    if (hull && (near.holds(*hull) || done >= budget)) {
      all.add(*hull);
    } else if (done < budget) {
      const dvec2 middle = place_in(box, 0.5, 0.5);
      for (const bool right : {false, true}) {
        for (const bool up : {false, true}) {
          boxes.push_back({{right ? middle.x : box.lower.x, up ? middle.y : box.lower.y},
                           {right ? box.upper.x : middle.x, up ? box.upper.y : middle.y}});
        }
      }
    } else {
      all.add(followed++ < most_followed ? hull_by_samples(source, piece, box)
                                         : hull_of_samples(source, piece, box, 2));
    }
  }
  return all;
}

}  // namespace

Bounds bounds_of(const PieceSource& source) {
  const std::size_t pieces = source.size();
  constexpr double all_samples = 20000, all_boxes = 20000;
  const int samples = int(std::clamp(std::sqrt(all_samples / double(pieces)), 2.0, 128.0));
  const auto budget = std::max(std::size_t(all_boxes) / pieces, std::size_t(16));
  std::vector<Hull> hulls(pieces);
  parallel_for(pieces, [&](std::size_t i) { hulls[i] = hull_of_samples(source, i, source.range(i), samples); });
  Hull seen;
  for (const Hull& hull : hulls) seen.add(hull);
  if (seen.is_empty()) throw Error(ErrorCode::input, "the surface is undefined in all of its range");
  parallel_for(pieces, [&](std::size_t i) { hulls[i] = hull_of_piece(source, i, seen, budget); });
  const Hull samples_alone = seen;
  for (const Hull& hull : hulls) seen.add(hull);
  // What rounding alone adds is left out, so that round numbers stay round.
  const double rounding = 1e-11 * greatest(seen.upper - seen.lower);
  for (int axis = 0; axis < 3; axis++) {
    if (samples_alone.lower[axis] - seen.lower[axis] <= rounding) seen.lower[axis] = samples_alone.lower[axis];
    if (seen.upper[axis] - samples_alone.upper[axis] <= rounding) seen.upper[axis] = samples_alone.upper[axis];
  }
  if (!(size_of(seen.lower) < 1e30) || !(size_of(seen.upper) < 1e30))
    throw Error(ErrorCode::input, "the surface reaches as far as 1e30, where floats end");
  return {seen.lower, seen.upper};
}

Extension extension_of(const PieceSource& source, std::size_t piece, double extent) {
  constexpr int count = 7;
  constexpr double small = 1e-12, flat = 1e-10;
  const ParameterBox range = source.range(piece);
  const dvec2 size = range.upper - range.lower;
  Extension found = Extension::nowhere;
  Hull hull;
  for (int j = 0; j < count; j++) {
    for (int i = 0; i < count; i++) {
      // Off the middle and the diagonals, where surfaces with symmetries may well have no area.
      const dvec2 at = place_in(range, (i + 0.37) / count, (j + 0.41) / count);
      const PatchPoint p = source.at(piece, at.x, at.y);
      if (!is_finite(p.position) || !is_finite(p.u) || !is_finite(p.v)) continue;
      hull.add(p.position);
      const double u = glm::length(p.u), v = glm::length(p.v), area = glm::length(glm::cross(p.u, p.v));
      if (u * size.x > small * extent && v * size.y > small * extent && area > flat * u * v) return Extension::surface;
      found = Extension::curve;
    }
  }
  const double magnitude = std::max(size_of(hull.lower), size_of(hull.upper));
  if (found == Extension::curve && greatest(hull.upper - hull.lower) <= small * magnitude) found = Extension::point;
  return found;
}

namespace {

// Halves of Bernstein coefficients (de Casteljau), of `count` rows of `degree` + 1 that stand `step` apart.
std::array<std::vector<double>, 2> halves(const std::vector<double>& whole, const std::array<int, 2>& degree,
                                          bool along_v) {
  std::array<std::vector<double>, 2> parts{whole, whole};
  const int across = along_v ? degree[0] : degree[1], along = along_v ? degree[1] : degree[0];
  const auto place = [&](int i, int k) {
    return std::size_t(along_v ? i * (degree[0] + 1) + k : k * (degree[0] + 1) + i);
  };
  for (int k = 0; k <= across; k++) {
    std::vector<double>& right = parts[1];
    for (int level = 1; level <= along; level++) {
      for (int i = 0; i + level <= along; i++) right[place(i, k)] = 0.5 * (right[place(i, k)] + right[place(i + 1, k)]);
      parts[0][place(level, k)] = right[place(0, k)];
    }
  }
  return parts;
}

void require_positive(const std::vector<double>& weights, const BezierPiece& piece, const ParameterBox& box, int depth,
                      double least, const std::string& what) {
  constexpr int deepest = 20;  // halves, of u and v in turn
  if (std::ranges::min(weights) > least) return;
  if (depth == deepest) {
    const dvec2 at = place_in(box, 0.5, 0.5);
    throw Error(ErrorCode::input, fmt::format("{}: the weight vanishes near u = {:g}, v = {:g}, where the surface goes "
                                              "to infinity; weights must keep it positive",
                                              what, at.x, at.y));
  }
  const bool along_v = depth % 2 == 1;
  const auto parts = halves(weights, piece.degree, along_v);
  const int axis = along_v ? 1 : 0;
  ParameterBox left = box, right = box;
  left.upper[axis] = right.lower[axis] = 0.5 * (box.lower[axis] + box.upper[axis]);
  require_positive(parts[0], piece, left, depth + 1, least, what);
  require_positive(parts[1], piece, right, depth + 1, least, what);
}

}  // namespace

void require_weights(const BezierPiece& piece, const std::string& what) {
  std::vector<double> weights;
  for (const glm::dvec4& p : piece.points) weights.push_back(p.w);
  const double least = 1e-12 * std::ranges::max(weights);
  require_positive(weights, piece, {piece.lower, piece.upper}, 0, least, what);
}

}  // namespace smurf
