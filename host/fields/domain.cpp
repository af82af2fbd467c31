#include "fields/domain.hpp"

#include <fmt/format.h>

#include <cmath>

#include "smurf/error.hpp"

namespace smurf {
namespace {

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

const Domain& require_domain(const Domain& domain) {
  const glm::dvec3 &lower = domain.lower, &upper = domain.upper;
  if (!finite(lower) || !finite(upper) || glm::any(glm::greaterThan(lower, upper))) {
    throw Error(ErrorCode::input,
                fmt::format("the domain must be a box of finite corners, the lower first, not [{}, {}, {}] to "
                            "[{}, {}, {}]",
                            lower.x, lower.y, lower.z, upper.x, upper.y, upper.z));
  }
  if (!(domain.radius >= 0) || !std::isfinite(domain.radius))
    throw Error(ErrorCode::input, fmt::format("the radius of the domain must be positive, not {}", domain.radius));
  return domain;
}

}  // namespace smurf
