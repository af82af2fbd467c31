// Curves c(u) from which streamlines begin: polylines, splines and expressions.
//
// Polylines and splines have u = 0, 1, 2, ... at their points.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "smurf/flow.hpp"

namespace smurf {

struct SeedPoint {
  glm::dvec3 position{0.0};
  glm::dvec3 first{0.0}, second{0.0};  // c'(u), c''(u); not finite where the curve has none
};

class SeedCurve {
 public:
  virtual ~SeedCurve() = default;
  virtual glm::dvec2 range() const = 0;  // of u, the lesser number first
  // u is clamped to the range. At a corner the derivatives are the mean of those of both sides.
  // Throws Error (input) where the position is undefined or infinite.
  virtual SeedPoint at(double u) const = 0;
  // A bound of |c''| for u from `lower` to `upper`, between corners; infinite where none is known.
  virtual double greatest_bend(double lower, double upper) const = 0;
  // Where c' jumps inside of the range, ascending; those of expressions are not known.
  virtual std::vector<double> corners() const { return {}; }

  // Spread evenly in u, both ends among them; one seed is in the middle.
  FlowSeeds sample(std::size_t count) const;
};

// Each throws Error (input) on fewer than two points, points that are not finite, and neighbours that are equal.
std::shared_ptr<const SeedCurve> polyline_seeds(std::vector<glm::dvec3> points);
// The natural cubic spline through the points: C², with second derivative 0 at both ends.
std::shared_ptr<const SeedCurve> spline_seeds(const std::vector<glm::dvec3>& points);
// Three expressions in u, in the words of implicit(), for u in [range.x, range.y]. Throws Error (input) that names the
// expression ("position[1]: ...") when one is wrong, and when the curve is a single point.
std::shared_ptr<const SeedCurve> expression_seeds(const std::array<std::string, 3>& position, const glm::dvec2& range,
                                                  const Parameters& parameters = {});

// {"points": [[x, y, z], ...]}, with "spline": true a smooth curve; or {"position": [...], "u": [a, b]} with
// "parameters". `path` says where the object stands in a description. Throws Error (input) that names the member.
std::shared_ptr<const SeedCurve> read_seed_curve(const nlohmann::json& object, std::string_view path);

// Seeds from a file. CSV: columns x, y, z and optionally the tangents dx, dy, dz. JSON: a seed curve with "count"
// (100; of a polyline the points themselves), or the description of a stream surface, whose "seed" is taken. Throws
// Error (input), one line that names the file and what is wrong with it.
FlowSeeds load_seeds(const std::filesystem::path& file);

}  // namespace smurf
