// What the public API asks of a vector field on a device. Two implementations: batches on an executor
// (host/flows/tracing.cpp), and the double-precision reference (host/reference/flow/queries.cpp).
#pragma once

#include <memory>
#include <optional>

#include "flows/definition.hpp"

namespace smurf {

class Executor;

class FlowQueries {
 public:
  virtual ~FlowQueries() = default;
  // Options are valid, and have their defaults put in; lists of seeds fit each other.
  virtual Streamlines trace(const FlowSeeds& seeds, const TraceOptions& options) = 0;
  virtual FlowSamples sample(std::span<const glm::vec3> points, int derivatives) = 0;
  virtual std::size_t device_bytes() const = 0;

  std::optional<double> greatest_speed = {};  // on a lattice over the domain, once it is known
};

// The executor must outlive what is returned.
std::unique_ptr<FlowQueries> trace_on_device(Executor& executor,
                                             const std::shared_ptr<const VectorFieldDefinition>& definition,
                                             const PrepareOptions& options);
std::unique_ptr<FlowQueries> trace_by_reference(const VectorFieldDefinition& definition);

}  // namespace smurf
