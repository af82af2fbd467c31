#include "flows/grid/definition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fields/placement.hpp"
#include "flows/grid/vectors.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::input, "vectors on a grid: " + message); }

void check_size(const VectorGrid& grid) {
  const glm::ivec3& size = grid.size;
  if (size.x < 2 || size.y < 2 || size.z < 2)
    fail(fmt::format("{} x {} x {} nodes; each axis must have at least 2", size.x, size.y, size.z));
  const double count = double(size.x) * double(size.y) * double(size.z);
  if (count != double(grid.vectors.size()))
    fail(fmt::format("{} x {} x {} are {:.0f} nodes, but there are {} vectors; there must be as many", size.x, size.y,
                     size.z, count, grid.vectors.size()));
}

}  // namespace

GridFlow::GridFlow(VectorGrid the_grid, VectorReconstruction the_reconstruction)
    : VectorFieldDefinition(FlowKind::grid), grid(std::move(the_grid)), reconstruction(the_reconstruction) {
  for (const glm::vec3& v : grid.vectors) {
    if (is_usable(v)) greatest_speed_ = std::max(greatest_speed_, glm::length(glm::dvec3(v)));
    else non_finite_++;
  }
}

Bounds GridFlow::bounds() const {
  Bounds bounds{glm::dvec3(std::numeric_limits<double>::infinity()),
                glm::dvec3(-std::numeric_limits<double>::infinity())};
  for (int corner = 0; corner < 8; corner++) {
    const glm::dvec3 index((corner & 1) ? grid.size.x - 1 : 0, (corner & 2) ? grid.size.y - 1 : 0,
                           (corner & 4) ? grid.size.z - 1 : 0);
    const glm::dvec3 point = grid.placement.origin + grid.placement.axes * index;
    bounds.lower = glm::min(bounds.lower, point);
    bounds.upper = glm::max(bounds.upper, point);
  }
  return bounds;
}

double GridFlow::greatest_bend(const Bounds& box) const {
  if (reconstruction != VectorReconstruction::tricubic) return std::numeric_limits<double>::infinity();
  std::call_once(bends_made_, [this] { bends_ = std::make_unique<const GridBends>(grid); });
  return bends_->within(box);
}

std::vector<Fact> GridFlow::facts() const {
  const glm::dmat3& axes = grid.placement.axes;
  std::vector<Fact> facts{
      {"reconstruction", reconstruction == VectorReconstruction::tricubic ? "tricubic" : "trilinear"},
      {"size", fmt::format("{} x {} x {}", grid.size.x, grid.size.y, grid.size.z)},
      {"spacing", fmt::format("{:g} {:g} {:g}", glm::length(axes[0]), glm::length(axes[1]), glm::length(axes[2]))},
      {"nodes", fmt::format("{}", grid.vectors.size())},
      {"greatest speed", fmt::format("{:g}", greatest_speed_)},
  };
  if (non_finite_ > 0) {
    facts.push_back(
        {"not finite",
         fmt::format("{} vectors are NaN, infinite or beyond {:g}: the field is undefined in the cells made of them",
                     non_finite_, greatest_component)});
  }
  return facts;
}

VectorField grid_flow(VectorGrid grid, VectorReconstruction reconstruction) {
  check_size(grid);
  require_placement(grid.placement, "vectors on a grid");
  return VectorField(std::make_shared<const GridFlow>(std::move(grid), reconstruction));
}

}  // namespace smurf
