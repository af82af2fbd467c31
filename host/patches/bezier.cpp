#include "patches/bezier.hpp"

#include <span>

namespace smurf {
namespace {

// The value of the blossom of a B-spline's piece over [t_span, t_span+1]: de Boor's algorithm with an argument of its
// own in each round. `points` are the degree + 1 control points that matter there, and are lost.
glm::dvec4 blossom(std::span<const double> knots, std::size_t span, std::span<const double> arguments,
                   std::span<glm::dvec4> points) {
  const std::size_t degree = arguments.size();
  for (std::size_t r = 1; r <= degree; r++) {
    for (std::size_t j = degree; j >= r; j--) {
      const std::size_t k = span - degree + j;  // the number of control point j
      const double a = knots[k], b = knots[k + degree + 1 - r];
      const double part = (arguments[r - 1] - a) / (b - a);
      points[j] = (1 - part) * points[j - 1] + part * points[j];
    }
  }
  return points[degree];
}

// Spans of the range that are not empty.
std::vector<std::size_t> spans_of(std::span<const double> knots, int degree, int size) {
  std::vector<std::size_t> spans;
  for (auto i = std::size_t(degree); i < std::size_t(size); i++) {
    if (knots[i] < knots[i + 1]) spans.push_back(i);
  }
  return spans;
}

// Along one direction: `row` becomes the control points of its pieces, degree + 1 each.
std::vector<glm::dvec4> cut(std::span<const double> knots, std::span<const std::size_t> spans, int degree,
                            std::span<const glm::dvec4> row) {
  const auto count = std::size_t(degree) + 1;
  std::vector<glm::dvec4> pieces;
  std::vector<double> arguments(std::size_t(degree), 0.0);
  std::vector<glm::dvec4> points(count);
  for (std::size_t s = 0; s < spans.size(); s++) {
    const std::size_t span = spans[s];
    for (std::size_t j = 0; j < count; j++) {
      for (std::size_t a = 0; a < arguments.size(); a++) arguments[a] = knots[a < j ? span + 1 : span];
      for (std::size_t k = 0; k < count; k++) points[k] = row[span - std::size_t(degree) + k];
      pieces.push_back(blossom(knots, span, arguments, points));
    }
    // Continuous where the knot does not part the patch: then both sides have the same point there.
    const bool joined = s > 0 && span - spans[s - 1] <= std::size_t(degree);
    if (joined) pieces[pieces.size() - count] = pieces[pieces.size() - count - 1];
  }
  return pieces;
}

// Bernstein polynomials of a degree at t, and their first and second derivatives by t.
struct Basis {
  std::array<std::array<double, most_patch_degree + 1>, 3> of{};
};

std::array<double, most_patch_degree + 1> bernstein(int degree, double t) {
  std::array<double, most_patch_degree + 1> values{};
  if (degree < 0) return values;
  values[0] = 1;
  for (int n = 1; n <= degree; n++) {
    double carried = 0;
    for (int i = 0; i < n; i++) {
      const double value = values[std::size_t(i)];
      values[std::size_t(i)] = carried + (1 - t) * value;
      carried = t * value;
    }
    values[std::size_t(n)] = carried;
  }
  return values;
}

Basis basis(int degree, double t) {
  Basis all;
  all.of[0] = bernstein(degree, t);
  const auto lower = bernstein(degree - 1, t), lowest = bernstein(degree - 2, t);
  const auto at = [](const auto& values, int i, int n) { return i < 0 || i > n ? 0.0 : values[std::size_t(i)]; };
  for (int i = 0; i <= degree; i++) {
    all.of[1][std::size_t(i)] = degree * (at(lower, i - 1, degree - 1) - at(lower, i, degree - 1));
    all.of[2][std::size_t(i)] =
        degree * (degree - 1) *
        (at(lowest, i - 2, degree - 2) - 2 * at(lowest, i - 1, degree - 2) + at(lowest, i, degree - 2));
  }
  return all;
}

}  // namespace

std::vector<BezierPiece> bezier_pieces(const Patch& patch, std::uint32_t number) {
  const auto spans_u = spans_of(patch.knots[0], patch.degree[0], patch.size[0]);
  const auto spans_v = spans_of(patch.knots[1], patch.degree[1], patch.size[1]);
  const auto size_u = std::size_t(patch.size[0]), size_v = std::size_t(patch.size[1]);
  // First along u: rows of control points of pieces.
  std::vector<std::vector<glm::dvec4>> rows;
  for (std::size_t j = 0; j < size_v; j++)
    rows.push_back(cut(patch.knots[0], spans_u, patch.degree[0], std::span(patch.points).subspan(j * size_u, size_u)));
  // Then along v.
  std::vector<std::vector<glm::dvec4>> columns;
  for (std::size_t i = 0; i < rows[0].size(); i++) {
    std::vector<glm::dvec4> column;
    for (const auto& row : rows) column.push_back(row[i]);
    columns.push_back(cut(patch.knots[1], spans_v, patch.degree[1], column));
  }
  const auto count_u = std::size_t(patch.degree[0]) + 1, count_v = std::size_t(patch.degree[1]) + 1;
  std::vector<BezierPiece> pieces;
  for (std::size_t b = 0; b < spans_v.size(); b++) {
    for (std::size_t a = 0; a < spans_u.size(); a++) {
      BezierPiece piece{number,
                        patch.degree,
                        {patch.knots[0][spans_u[a]], patch.knots[1][spans_v[b]]},
                        {patch.knots[0][spans_u[a] + 1], patch.knots[1][spans_v[b] + 1]}};
      for (std::size_t j = 0; j < count_v; j++) {
        for (std::size_t i = 0; i < count_u; i++) piece.points.push_back(columns[a * count_u + i][b * count_v + j]);
      }
      pieces.push_back(std::move(piece));
    }
  }
  return pieces;
}

PatchPoint evaluate_unit(const BezierPiece& piece, double u, double v) {
  const Basis in_u = basis(piece.degree[0], u), in_v = basis(piece.degree[1], v);
  // Homogeneous derivatives [by u][by v].
  std::array<std::array<glm::dvec4, 3>, 3> h{};
  std::size_t at = 0;
  for (int j = 0; j <= piece.degree[1]; j++) {
    for (int i = 0; i <= piece.degree[0]; i++, at++) {
      for (std::size_t a = 0; a < 3; a++) {
        for (std::size_t b = 0; a + b < 3; b++)
          h[a][b] += in_u.of[a][std::size_t(i)] * in_v.of[b][std::size_t(j)] * piece.points[at];
      }
    }
  }
  const glm::dvec4 &by_u = h[1][0], &by_v = h[0][1], &by_uu = h[2][0], &by_uv = h[1][1], &by_vv = h[0][2];
  // Quotient rule (Piegl, Tiller 1997, eq. 4.20).
  const double w = h[0][0].w;
  PatchPoint p;
  p.position = glm::dvec3(h[0][0]) / w;
  p.u = (glm::dvec3(by_u) - by_u.w * p.position) / w;
  p.v = (glm::dvec3(by_v) - by_v.w * p.position) / w;
  p.uu = (glm::dvec3(by_uu) - 2 * by_u.w * p.u - by_uu.w * p.position) / w;
  p.uv = (glm::dvec3(by_uv) - by_u.w * p.v - by_v.w * p.u - by_uv.w * p.position) / w;
  p.vv = (glm::dvec3(by_vv) - 2 * by_v.w * p.v - by_vv.w * p.position) / w;
  return p;
}

PatchPoint evaluate(const BezierPiece& piece, double u, double v) {
  const glm::dvec2 extent = piece.upper - piece.lower;
  PatchPoint p = evaluate_unit(piece, (u - piece.lower.x) / extent.x, (v - piece.lower.y) / extent.y);
  p.u /= extent.x;
  p.v /= extent.y;
  p.uu /= extent.x * extent.x;
  p.uv /= extent.x * extent.y;
  p.vv /= extent.y * extent.y;
  return p;
}

BezierPiece elevated(const BezierPiece& piece, int degree_u, int degree_v) {
  BezierPiece result = piece;
  // P'_i = i/(n+1) P_{i-1} + (1 - i/(n+1)) P_i (Farin 2002, §6.1); ends stay to the bit.
  while (result.degree[0] < degree_u) {
    const int n = result.degree[0];
    std::vector<glm::dvec4> points;
    for (int j = 0; j <= result.degree[1]; j++) {
      const glm::dvec4* row = &result.points[std::size_t(j) * std::size_t(n + 1)];
      for (int i = 0; i <= n + 1; i++) {
        const double part = double(i) / (n + 1);
        points.push_back(i == 0 ? row[0] : i == n + 1 ? row[n] : part * row[i - 1] + (1 - part) * row[i]);
      }
    }
    result.points = std::move(points);
    result.degree[0]++;
  }
  const auto columns = std::size_t(result.degree[0]) + 1;
  while (result.degree[1] < degree_v) {
    const int n = result.degree[1];
    std::vector<glm::dvec4> points;
    for (int j = 0; j <= n + 1; j++) {
      const double part = double(j) / (n + 1);
      for (std::size_t i = 0; i < columns; i++) {
        const auto row = [&](int r) { return result.points[std::size_t(r) * columns + i]; };
        points.push_back(j == 0 ? row(0) : j == n + 1 ? row(n) : part * row(j - 1) + (1 - part) * row(j));
      }
    }
    result.points = std::move(points);
    result.degree[1]++;
  }
  return result;
}

}  // namespace smurf
