// VTK's vtkStreamTracer and vtkStreamSurface as peers, the first also as another opinion in tests.
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

struct VtkTriangles {
  std::vector<glm::dvec3> points;
  std::vector<glm::uvec3> triangles;
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

  // A surface between lines from the polyline of seeds, of Runge-Kutta steps of `step` in length, as far as `length`.
  // `adaptive`: seeds are added where neighbours go apart (on the chord between them).
  VtkTriangles surface(std::span<const glm::dvec3> seeds, double step, double length, bool adaptive) const;

 private:
  struct State;
  VtkLines trace(std::span<const glm::dvec3> seeds, double step, double length, double error) const;
  std::unique_ptr<State> state_;
};

}  // namespace smurf::bench
