// Surfaces of functions that are known by their values alone: f(x, y, z) = level in a domain, f a user's own source
// (smurf/black_box.hpp).
#pragma once

#include "smurf/black_box.hpp"
#include "surfaces/implicit/definition.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

class BlackBoxSurface : public SurfaceDefinition {
 public:
  BlackBoxSurface(const BlackBox& function, const Domain& domain, const BlackBoxOptions& options);
  std::string_view kind() const override { return "implicit"; }
  Bounds bounds() const override { return {domain.lower, domain.upper}; }
  std::uint32_t properties() const override;
  std::vector<Fact> facts() const override;
  std::optional<InsideOfLevel> inside_of_level() const override { return InsideOfLevel{options.level, false}; }

  double diagonal() const { return glm::length(domain.upper - domain.lower); }
  // Of central differences for derivatives of order 1 or 2, where values are rounded to parts of 2^-bits.
  double difference_step(int derivative, int bits) const;

  const BlackBox function;
  const Domain domain;
  const BlackBoxOptions options;  // with the step that is taken
};

}  // namespace smurf
