// Expressions sampled to volumes.
#include <fmt/format.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "numerics/parallel.hpp"
#include "smurf/error.hpp"
#include "smurf/surface.hpp"
#include "smurf/values.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

SampledField sample_field(const Surface& surface, const glm::ivec3& size, int padding) {
  const std::optional<AnalyticField> field = surface.model().analytic_field();
  if (!field) {
    throw Error(ErrorCode::input,
                fmt::format("only what an expression gives can be sampled: an implicit surface, or an isosurface whose "
                            "field is of kind \"expression\"; this {} is none",
                            surface.kind()));
  }
  const Domain& domain = field->domain;
  if (size.x < 2 || size.y < 2 || size.z < 2 || padding < 0) {
    throw Error(ErrorCode::input,
                fmt::format("a field is sampled at 2 nodes along each axis at least, and an apron of 0 "
                            "at least, not at {} x {} x {} with {}",
                            size.x, size.y, size.z, padding));
  }
  const glm::dvec3 extent = domain.upper - domain.lower, wide = glm::dvec3(size) + 2.0 * padding;
  for (int axis = 0; axis < 3; axis++) {
    if (!(extent[axis] > 0)) {
      throw Error(ErrorCode::input,
                  fmt::format("the domain has no extent along {}, so that it cannot be sampled", "xyz"[axis]));
    }
  }
  constexpr double greatest_count = std::numeric_limits<std::int32_t>::max();  // of a volume
  if (wide.x * wide.y * wide.z > greatest_count) {
    throw Error(ErrorCode::input, fmt::format("{} x {} x {} nodes are more than a volume can have, {:.0f}", wide.x,
                                              wide.y, wide.z, greatest_count));
  }

  const glm::dvec3 step = extent / glm::dvec3(size - 1);
  GridPlacement placement = spacing(step.x, step.y, step.z);
  placement.origin = domain.lower - double(padding) * step;
  const glm::ivec3 nodes = size + 2 * padding;
  const std::size_t row = std::size_t(nodes.x), slice = row * std::size_t(nodes.y);
  const auto samples = std::make_shared<Values<float>>(slice * std::size_t(nodes.z));
  parallel_for(std::size_t(nodes.z), [&](std::size_t k) {
    for (std::size_t j = 0; j < std::size_t(nodes.y); j++) {
      for (std::size_t i = 0; i < row; i++) {
        const glm::dvec3 index{double(i), double(j), double(k)};
        (*samples)[i + row * j + slice * k] = float(field->value(placement.origin + step * index));
      }
    }
  });
  Volume volume(std::shared_ptr<const void>(samples, samples->data()), SampleType::float32, nodes, placement);
  return {std::move(volume), field->level, domain};
}

}  // namespace smurf
