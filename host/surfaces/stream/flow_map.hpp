// What a stream surface needs on a device to integrate x(u, τ) in its own kernels (kernels/stream/map.inc): the field's
// buffers among its own, the seed curve as polynomials, and numbers.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "device/executor.hpp"
#include "flows/resident_flow.hpp"
#include "smurf/interrogator.hpp"
#include "surfaces/stream/definition.hpp"

namespace smurf {

// A seed curve c(u) in pieces, each a polynomial of degree 5 that takes c, c' and c'' at both ends (quintic Hermite
// interpolation). Pieces end where c' jumps, and are halved while the curve leaves them, or their first two derivatives
// do, by more than floats can tell, or until there are too many.
struct SeedTable {
  std::vector<double> begin;                            // of each piece in u, floats; and where the last one ends
  std::vector<std::array<glm::dvec3, 6>> coefficients;  // of powers of (u - begin) / width
  double error = 0, slope_error = 0;                    // that were measured; of c', relative to the greatest |c'|
  bool closed = false;                                  // c(u) ends where it begins

  std::size_t size() const { return coefficients.size(); }
  SeedPoint at(double u) const;
};
// Throws Error (input) as SeedCurve::at does.
SeedTable make_seed_table(const SeedCurve& seed, double extent);

// Buffers "stream", "seed" and those of the field, whose names have "flow_" before them; modules "stream_flow",
// "integrator" and those of the field. The surface's own modules and buffers stand beside them.
class StreamMap {
 public:
  StreamMap(const StreamSurface& surface, Executor& executor, const PrepareOptions& options);

  // Adds modules and defines to a surface's.
  void add_to(std::map<std::string, std::string>& modules, std::map<std::string, std::string>& defines) const;
  void add_to(BufferGroup& buffers) const;
  std::size_t bytes() const { return uniforms_.bytes() + seed_.bytes() + flow_->bytes(); }
  const SeedTable& seed() const { return table_; }
  const ResidentFlow& flow() const { return *flow_; }
  double tolerance() const { return tolerance_; }  // of one step, in units of space

 private:
  std::unique_ptr<ResidentFlow> flow_;
  std::vector<std::string> flow_names_;
  SeedTable table_;
  double tolerance_ = 0;
  bool smooth_ = false, neighbours_ = false;
  TypedBuffer<std::uint32_t> uniforms_, seed_;
};

}  // namespace smurf
