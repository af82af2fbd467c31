// VTK's vtkStreamTracer as a peer, and as another opinion in tests.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "smurf/flow.hpp"

namespace smurf::bench {

struct VtkLines {
  std::vector<std::size_t> offsets;  // compressed rows, one for each line
  std::vector<glm::dvec3> positions;
  std::vector<double> times;
  std::vector<std::size_t> seeds;  // of each line: VTK leaves out seeds that lie outside
  std::size_t steps() const { return positions.size() - seeds.size(); }
};

// Lines of a grid's trilinear field, forward from their seeds.
class VtkStreamTracer {
 public:
  explicit VtkStreamTracer(const VectorGrid& grid);
  explicit VtkStreamTracer(const CurvilinearBlock& block);
  ~VtkStreamTracer();
  VtkStreamTracer(const VtkStreamTracer&) = delete;
  VtkStreamTracer& operator=(const VtkStreamTracer&) = delete;

  // The classic Runge-Kutta method, with steps of `step` in length, as far as `length`.
  VtkLines rk4(std::span<const glm::dvec3> seeds, double step, double length) const;
  // Runge-Kutta 4(5) with error control, from steps of `step` in length on.
  VtkLines adaptive(std::span<const glm::dvec3> seeds, double step, double length, double error) const;

 private:
  struct State;
  VtkLines trace(std::span<const glm::dvec3> seeds, double step, double length, double error) const;
  std::unique_ptr<State> state_;
};

}  // namespace smurf::bench
