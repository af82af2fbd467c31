#include "patches/patch.hpp"

#include <fmt/format.h>

#include <cmath>

#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr std::array<const char*, 2> names = {"u", "v"};

void require_knots(const Patch& patch, std::size_t direction, const std::string& what) {
  const auto fail = [&](const std::string& message) {
    throw Error(ErrorCode::input, fmt::format("{}: {}", what, message));
  };
  const std::vector<double>& knots = patch.knots[direction];
  const int degree = patch.degree[direction], size = patch.size[direction];
  if (degree < 1 || degree > most_patch_degree)
    fail(fmt::format("the degree in {} is {}; it must be 1 to {}", names[direction], degree, most_patch_degree));
  if (size < degree + 1)
    fail(fmt::format("there are {} control points in {}; degree {} needs at least {}", size, names[direction], degree,
                     degree + 1));
  const std::size_t wanted = std::size_t(size) + std::size_t(degree) + 1;
  if (knots.size() != wanted)
    fail(fmt::format("there are {} knots in {}; {} control points of degree {} need {}", knots.size(), names[direction],
                     size, degree, wanted));
  int times = 1;
  for (std::size_t i = 0; i < knots.size(); i++) {
    if (!std::isfinite(knots[i])) fail(fmt::format("knot {} in {} is not finite", i, names[direction]));
    if (i == 0) continue;
    if (knots[i] < knots[i - 1])
      fail(fmt::format("the knots in {} decrease: {} stands behind {}", names[direction], knots[i], knots[i - 1]));
    times = knots[i] == knots[i - 1] ? times + 1 : 1;
    if (times > degree + 1)
      fail(fmt::format("the knot {} in {} stands more than {} times, which degree {} allows", knots[i],
                       names[direction], degree + 1, degree));
  }
  if (!(patch.lower(int(direction)) < patch.upper(int(direction))))
    fail(fmt::format("the range in {} is empty: it is [{}, {}]", names[direction], patch.lower(int(direction)),
                     patch.upper(int(direction))));
}

}  // namespace

Patch bezier_patch(int degree_u, int degree_v, std::vector<glm::dvec4> points) {
  Patch patch;
  patch.degree = {degree_u, degree_v};
  patch.size = {degree_u + 1, degree_v + 1};
  patch.points = std::move(points);
  for (std::size_t direction = 0; direction < 2; direction++) {
    const auto count = std::size_t(patch.size[direction]);
    patch.knots[direction].assign(count, 0.0);
    patch.knots[direction].resize(2 * count, 1.0);
  }
  return patch;
}

void require_valid(const Patch& patch, const std::string& what) {
  for (std::size_t direction = 0; direction < 2; direction++) require_knots(patch, direction, what);
  const std::size_t wanted = std::size_t(patch.size[0]) * std::size_t(patch.size[1]);
  if (patch.points.size() != wanted)
    throw Error(ErrorCode::input, fmt::format("{}: there are {} control points; {} x {} are needed", what,
                                              patch.points.size(), patch.size[0], patch.size[1]));
  for (std::size_t i = 0; i < patch.points.size(); i++) {
    const glm::dvec4& p = patch.points[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z) || !std::isfinite(p.w))
      throw Error(ErrorCode::input, fmt::format("{}: control point {} is not finite", what, i));
    if (p.w < 0)
      throw Error(ErrorCode::input,
                  fmt::format("{}: the weight of control point {} is {}; weights must not be negative", what, i, p.w));
  }
}

}  // namespace smurf
