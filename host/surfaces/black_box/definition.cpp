#include "surfaces/black_box/definition.hpp"

#include <fmt/format.h>

#include <cmath>

#include "fields/user_source.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr double samples_on_diagonal = 512, most_samples = 65536;

void require(bool fits, const std::string& message) {
  if (!fits) throw Error(ErrorCode::input, message);
}

BlackBoxOptions checked(BlackBoxOptions options, double diagonal) {
  const auto plain = [](double number) { return std::isfinite(number) && number >= 0; };
  require(std::isfinite(options.level), fmt::format("the level must be finite, not {}", options.level));
  require(diagonal > 0, "the domain of a black box must have an extent, it is a point");
  require(plain(options.step),
          fmt::format("the step along rays must be positive (0 for 1/{} of the domain's diagonal), not {}",
                      samples_on_diagonal, options.step));
  if (options.step == 0) options.step = diagonal / samples_on_diagonal;
  require(options.step >= diagonal / most_samples,
          fmt::format("the step along rays must be at least 1/{} of the domain's diagonal, {:g}, not {}", most_samples,
                      diagonal / most_samples, options.step));
  require(plain(options.lipschitz),
          fmt::format("the bound on the gradient must be positive (0 for none), not {}", options.lipschitz));
  const int order = options.difference_order;
  require(order == 2 || order == 4 || order == 6,
          fmt::format("the order of differences must be 2, 4 or 6, not {}", order));
  require(plain(options.difference_step) && options.difference_step <= diagonal,
          fmt::format("the step of differences must be positive (0 for one that is derived) and at most the domain's "
                      "diagonal, {:g}, not {}",
                      diagonal, options.difference_step));
  return options;
}

}  // namespace

BlackBoxSurface::BlackBoxSurface(const BlackBox& the_function, const Domain& the_domain,
                                 const BlackBoxOptions& the_options)
    : SurfaceDefinition(SurfaceKind::black_box),
      function(the_function),
      domain(require_domain(the_domain)),
      options(checked(the_options, glm::length(the_domain.upper - the_domain.lower))) {
  require_user_source(function.source, fmt::format("the source of the black box \"{}\"", function.name), "black_box",
                      "FN real black_box(real x, real y, real z)");
}

double BlackBoxSurface::difference_step(int derivative, int bits) const {
  if (options.difference_step > 0) return options.difference_step;
  return diagonal() / 8 * std::exp2(-double(bits) / (options.difference_order + derivative));
}

std::uint32_t BlackBoxSurface::properties() const {
  return Property::value | Property::normal | Property::gauss | Property::mean | Property::principal |
         Property::directions | Property::normal_curvature | Property::distance | Property::inside;
}

std::vector<Fact> BlackBoxSurface::facts() const {
  std::vector<Fact> facts{{"field", "black box"},
                          {"source", fmt::format("{}, {} bytes", function.name, function.source.size())},
                          {"reference", function.value ? "given" : "none: only devices can answer"}};
  if (options.level != 0) facts.push_back({"level", fmt::format("{}", options.level)});
  facts.push_back({"step", fmt::format("{:g}", options.step)});
  facts.push_back({"gradient", options.lipschitz > 0
                                   ? fmt::format("at most {:g}, by the user's word", options.lipschitz)
                                   : "no bound is known"});
  facts.push_back({"proof", "none: roots between samples may be missed"});
  facts.push_back({"differences", fmt::format("order {}, steps {:g} (first), {:g} (second)", options.difference_order,
                                              difference_step(1, 24), difference_step(2, 24))});
  if (domain.radius > 0) facts.push_back({"ball", fmt::format("within {:g} of the origin", domain.radius)});
  return facts;
}

Surface implicit(const BlackBox& function, const Domain& domain, const BlackBoxOptions& options) {
  return Surface(std::make_shared<const BlackBoxSurface>(function, domain, options));
}

}  // namespace smurf
