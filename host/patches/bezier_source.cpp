#include "patches/bezier_source.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "patches/weld.hpp"

namespace smurf {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr std::size_t most_points = most_patch_degree + 1;

using Weights = std::array<std::array<double, most_points>, most_points>;

// Row i: the weights of control points in point i of the part over [low, high], which may reach outside of [0, 1].
// That point is the value of the blossom with i arguments `high` and the others `low`, so its weights are the
// coefficients of ((1 - low) + low z)^(degree - i) ((1 - high) + high z)^i.
Weights part_weights(int degree, double low, double high) {
  Weights rows;
  for (int i = 0; i <= degree; i++) {
    auto& row = rows[std::size_t(i)];
    row.fill(0);
    row[0] = 1;
    for (int n = 0; n < degree; n++) {
      const double t = n < i ? high : low;
      for (auto k = std::size_t(n) + 1; k > 0; k--) row[k] = (1 - t) * row[k] + t * row[k - 1];
      row[0] *= 1 - t;
    }
  }
  return rows;
}

// By how much weights exceed 1 in sum: 1 within [0, 1].
double amplification(int degree, double low, double high) {
  const double sum = std::max(std::abs(1 - low) + std::abs(low), std::abs(1 - high) + std::abs(high));
  return std::pow(sum, degree);
}

// Intervals by component. They are not rounded outwards: who uses them adds a margin.
struct Span {
  glm::dvec3 low{0.0}, high{0.0};
};
Span operator-(const Span& a, const Span& b) { return {a.low - b.high, a.high - b.low}; }
Span times(double low, double high, const Span& a) {
  const glm::dvec3 p = low * a.low, q = low * a.high, r = high * a.low, s = high * a.high;
  return {glm::min(glm::min(p, q), glm::min(r, s)), glm::max(glm::max(p, q), glm::max(r, s))};
}
glm::dvec3 magnitude(const Span& a) { return glm::max(glm::abs(a.low), glm::abs(a.high)); }

}  // namespace

struct BezierSource::Hull {
  Span xyz;
  double w_low = 0, w_high = 0;
  Span ratio{glm::dvec3(infinity), glm::dvec3(-infinity)};  // of xyz by w, where w is above 0
  glm::dvec3 margin{0.0};                                   // of xyz, for rounding; included
  glm::dvec3 size() const { return magnitude(xyz); }
  Span by_weight(const Span& other) const { return times(w_low, w_high, other); }
  double weight() const { return std::max(std::abs(w_low), std::abs(w_high)); }
};

BezierSource::BezierSource(std::span<const Patch> patches, double weld) {
  for (std::size_t n = 0; n < patches.size(); n++) {
    for (BezierPiece& piece : bezier_pieces(patches[n], std::uint32_t(n))) pieces_.push_back(std::move(piece));
  }
  weld_borders(pieces_, weld);
  make_all_nets();
}

BezierSource::BezierSource(std::vector<BezierPiece> pieces) : pieces_(std::move(pieces)) { make_all_nets(); }

void BezierSource::make_all_nets() {
  for (const BezierPiece& piece : pieces_) {
    nets_.push_back(make_nets(piece));
    for (std::size_t d = 0; d < 2; d++) degree_[d] = std::max(degree_[d], piece.degree[d]);
  }
}

BezierSource::Nets BezierSource::make_nets(const BezierPiece& piece) {
  const auto derived = [](const Net& net, std::size_t direction) {
    Net result;
    if (net.points.empty() || net.degree[direction] == 0) return result;
    result.degree = net.degree;
    result.degree[direction]--;
    const auto columns = std::size_t(net.degree[0]) + 1;
    const std::size_t step = direction == 0 ? 1 : columns;
    for (int j = 0; j <= result.degree[1]; j++) {
      for (int i = 0; i <= result.degree[0]; i++) {
        const std::size_t at = std::size_t(j) * columns + std::size_t(i);
        result.points.push_back(double(net.degree[direction]) * (net.points[at + step] - net.points[at]));
      }
    }
    return result;
  };
  Nets nets;
  nets.s.degree = piece.degree;
  nets.s.points = piece.points;
  nets.u = derived(nets.s, 0);
  nets.v = derived(nets.s, 1);
  nets.uu = derived(nets.u, 0);
  nets.uv = derived(nets.u, 1);
  nets.vv = derived(nets.v, 1);
  for (const glm::dvec4& p : piece.points) nets.s.greatest = glm::max(nets.s.greatest, glm::abs(p));
  // Differences of points err by what the points themselves are rounded to: their magnitudes count, too.
  for (Net* net : {&nets.u, &nets.v, &nets.uu, &nets.uv, &nets.vv}) {
    net->greatest =
        net->points.empty()
            ? glm::dvec4(0)
            : nets.s.greatest * (4.0 * piece.degree[0] * piece.degree[0] + 4.0 * piece.degree[1] * piece.degree[1]);
  }
  glm::dvec3 lower(infinity), upper(-infinity);
  nets.weight = 0;
  for (const glm::dvec4& p : piece.points) {
    nets.polynomial = nets.polynomial && p.w == 1;
    nets.weight = std::max(nets.weight, p.w);
    if (p.w <= 0) continue;
    lower = glm::min(lower, glm::dvec3(p) / p.w);
    upper = glm::max(upper, glm::dvec3(p) / p.w);
  }
  nets.centre = glm::dvec3(glm::vec3(0.5 * (lower + upper)));
  for (const glm::dvec4& p : piece.points)
    nets.reach = glm::max(nets.reach, glm::abs(glm::dvec3(p) - p.w * nets.centre));
  return nets;
}

// Of the net's part over the box, moved by `origin` (times w).
BezierSource::Hull BezierSource::hull(const Net& net, const ParameterBox& box, const glm::dvec3& origin) {
  if (net.points.empty()) return {};
  const Weights in_u = part_weights(net.degree[0], box.lower.x, box.upper.x),
                in_v = part_weights(net.degree[1], box.lower.y, box.upper.y);
  const auto columns = std::size_t(net.degree[0]) + 1, rows = std::size_t(net.degree[1]) + 1;
  std::array<glm::dvec4, most_points * most_points> across;
  for (std::size_t j = 0; j < rows; j++) {
    for (std::size_t i = 0; i < columns; i++) {
      glm::dvec4 sum(0);
      for (std::size_t k = 0; k < columns; k++) sum += in_u[i][k] * net.points[j * columns + k];
      across[j * columns + i] = sum;
    }
  }
  Hull result;
  glm::dvec4 low(infinity), high(-infinity);
  for (std::size_t j = 0; j < rows; j++) {
    for (std::size_t i = 0; i < columns; i++) {
      glm::dvec4 p(0);
      for (std::size_t k = 0; k < rows; k++) p += in_v[j][k] * across[k * columns + i];
      p = glm::dvec4(glm::dvec3(p) - p.w * origin, p.w);
      low = glm::min(low, p);
      high = glm::max(high, p);
      if (p.w <= 0) continue;
      result.ratio.low = glm::min(result.ratio.low, glm::dvec3(p) / p.w);
      result.ratio.high = glm::max(result.ratio.high, glm::dvec3(p) / p.w);
    }
  }
  // Each weight errs by 3 roundings a factor, each sum by one a summand; the move by three more.
  const double roundings = (8.0 * double(rows + columns) + 16) * epsilon *
                           amplification(net.degree[0], box.lower.x, box.upper.x) *
                           amplification(net.degree[1], box.lower.y, box.upper.y);
  const double weight_margin = roundings * net.greatest.w;
  result.margin = roundings * (glm::dvec3(net.greatest) + net.greatest.w * glm::abs(origin));
  result.xyz = {glm::dvec3(low) - result.margin, glm::dvec3(high) + result.margin};
  result.w_low = low.w - weight_margin;
  result.w_high = high.w + weight_margin;
  return result;
}

std::optional<PieceBounds> BezierSource::bounds(std::size_t piece, const ParameterBox& box) const {
  const Nets& nets = nets_[piece];
  PieceBounds result;
  // The device evaluates sums of control points, floats relative to the centre, with products of Bernstein polynomials
  // as weights. The points are rounded once, each basis errs by two roundings a degree, the sums by one a summand.
  const double roundings = 2.0 * (degree_[0] + degree_[1]) + 8;
  const double errs = std::ldexp(roundings, -24) * amplification(degree_[0], box.lower.x, box.upper.x) *
                      amplification(degree_[1], box.lower.y, box.upper.y);
  if (nets.polynomial) {
    const glm::dvec3 none(0);
    const Hull s = hull(nets.s, box, none);
    result.lower = s.xyz.low;
    result.upper = s.xyz.high;
    result.uu = hull(nets.uu, box, none).size();
    result.uv = hull(nets.uv, box, none).size();
    result.vv = hull(nets.vv, box, none).size();
    result.error = errs * nets.reach;
    return result;
  }
  // Relative to the point in the middle, so that what is subtracted below is small.
  const glm::dvec2 middle = 0.5 * (box.lower + box.upper);
  const glm::dvec3 origin = at(piece, middle.x, middle.y).position;
  if (!std::isfinite(origin.x + origin.y + origin.z)) return std::nullopt;
  const Hull s = hull(nets.s, box, origin);
  if (!(s.w_low > 0)) return std::nullopt;
  const Hull u = hull(nets.u, box, origin), v = hull(nets.v, box, origin), uu = hull(nets.uu, box, origin),
             uv = hull(nets.uv, box, origin), vv = hull(nets.vv, box, origin);
  const double low = 1 / s.w_high, high = 1 / s.w_low;
  const glm::dvec3 position_margin = (2.0 * s.margin + 8 * epsilon * s.size()) * high;
  const Span x{s.ratio.low - position_margin, s.ratio.high + position_margin};
  const Span x_u = times(low, high, u.xyz - u.by_weight(x)), x_v = times(low, high, v.xyz - v.by_weight(x));
  const Span twice_u{2.0 * x_u.low, 2.0 * x_u.high}, twice_v{2.0 * x_v.low, 2.0 * x_v.high};
  // Some ten operations on numbers that are no greater than the sums of magnitudes.
  const auto rounded = [&](const Span& value, const glm::dvec3& sizes) {
    return magnitude(value) + 64 * epsilon * high * sizes;
  };
  result.uu = rounded(times(low, high, uu.xyz - u.by_weight(twice_u) - uu.by_weight(x)),
                      uu.size() + u.weight() * magnitude(twice_u) + uu.weight() * magnitude(x));
  result.uv =
      rounded(times(low, high, uv.xyz - u.by_weight(x_v) - v.by_weight(x_u) - uv.by_weight(x)),
              uv.size() + u.weight() * magnitude(x_v) + v.weight() * magnitude(x_u) + uv.weight() * magnitude(x));
  result.vv = rounded(times(low, high, vv.xyz - v.by_weight(twice_v) - vv.by_weight(x)),
                      vv.size() + v.weight() * magnitude(twice_v) + vv.weight() * magnitude(x));
  const glm::dvec3 outwards = 4 * epsilon * (glm::abs(origin) + magnitude(x));
  result.lower = origin + x.low - outwards;
  result.upper = origin + x.high + outwards;
  // Of the quotient: numerator and weight err by themselves.
  const glm::dvec3 far = glm::max(glm::abs(result.lower - nets.centre), glm::abs(result.upper - nets.centre));
  result.error = errs * high * (nets.reach + nets.weight * far) + std::ldexp(5.0, -24) * far;
  return result;
}

}  // namespace smurf
