// A vector field's buffers on one device and the source that answers for it.
//
// The source module "flow" defines what kernels/flow/field.inc lists.
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "device/executor.hpp"
#include "flows/definition.hpp"

namespace smurf {

class ResidentFlow {
 public:
  virtual ~ResidentFlow() = default;
  // Source modules by the name under which kernels include them; always "flow".
  virtual const std::map<std::string, std::string>& modules() const = 0;
  virtual const std::map<std::string, std::string>& defines() const = 0;
  // Always the same names, in the same order.
  virtual BufferGroup buffers() const = 0;
  virtual std::size_t bytes() const = 0;

  // A kernel that asks this field.
  Program program(KernelId kernel) const { return {kernel, modules(), defines(), {{"flow", names_of(buffers())}}}; }
};

// The words of kernels/flow/domain.inc.
void put_flow_domain(const Domain& domain, std::span<std::uint32_t> words);

}  // namespace smurf
