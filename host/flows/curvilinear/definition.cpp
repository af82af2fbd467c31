#include "flows/curvilinear/definition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fields/curvilinear_cells.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr std::size_t most_nodes = std::size_t(1) << 28;  // devices number the words of nodes in 32 bits
constexpr double usual_tolerance = 1e-6;                  // of the extent
constexpr double seam_tolerance = 1e-6;                   // of the extent

template <class Vector>
bool finite(const Vector& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

std::string shown(const glm::ivec3& size) { return fmt::format("{} x {} x {}", size.x, size.y, size.z); }

[[noreturn]] void refuse(const std::string& message) { throw Error(ErrorCode::input, message); }

void check_size(const glm::ivec3& size, const std::string& what) {
  if (size.x < 2 || size.y < 2 || size.z < 2)
    refuse(fmt::format("{} must have at least 2 nodes along each axis, not {}", what, shown(size)));
}

void check_length(std::size_t length, const glm::ivec3& size, std::string_view list, const std::string& what) {
  if (length != node_count(size))
    refuse(fmt::format("{} of {} nodes must have {} {}, not {}", what, shown(size), node_count(size), list, length));
}

void check_block(const CurvilinearBlock& block, const std::string& what) {
  check_size(block.size, what);
  check_length(block.points.size(), block.size, "points", what);
  check_length(block.vectors.size(), block.size, "vectors", what);
  if (!block.blanked.empty()) check_length(block.blanked.size(), block.size, "marks of blanked nodes", what);
  for (std::size_t node = 0; node < block.points.size(); node++) {
    const glm::dvec3& point = block.points[node];
    if (!finite(point))
      refuse(fmt::format("node {} of {} must stand at a finite point, not ({}, {}, {})", node, what, point.x, point.y,
                         point.z));
  }
}

// Of the nodes that are not blanked; of all where all are.
Bounds bounds_of(const std::vector<CurvilinearBlock>& blocks) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Bounds valid{glm::dvec3(infinity), glm::dvec3(-infinity)}, all = valid;
  for (const CurvilinearBlock& block : blocks)
    for (std::size_t node = 0; node < block.points.size(); node++) {
      const glm::dvec3& point = block.points[node];
      all.lower = glm::min(all.lower, point);
      all.upper = glm::max(all.upper, point);
      if (!block.blanked.empty() && block.blanked[node] != 0) continue;
      valid.lower = glm::min(valid.lower, point);
      valid.upper = glm::max(valid.upper, point);
    }
  return valid.lower.x <= valid.upper.x ? valid : all;
}

double extent_of(const Bounds& bounds) {
  const glm::dvec3 sides = bounds.upper - bounds.lower;
  return std::max({sides.x, sides.y, sides.z});
}

// Cells about blanked nodes, and vectors of nodes that are not blanked that are not finite.
struct Gaps {
  std::size_t blanked_cells = 0, non_finite = 0;
};

Gaps gaps_of(const CurvilinearBlock& block) {
  Gaps gaps;
  const glm::ivec3& size = block.size;
  const auto blanked = [&](std::size_t node) { return !block.blanked.empty() && block.blanked[node] != 0; };
  for (std::size_t node = 0; node < block.vectors.size(); node++)
    gaps.non_finite += !blanked(node) && !finite(block.vectors[node]);
  if (block.blanked.empty()) return gaps;
  for (int k = 0; k + 1 < size.z; k++)
    for (int j = 0; j + 1 < size.y; j++)
      for (int i = 0; i + 1 < size.x; i++) {
        bool any = false;
        for (int corner = 0; corner < 8; corner++)
          any = any || blanked(node_at(size, i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)));
        gaps.blanked_cells += any;
      }
  return gaps;
}

}  // namespace

CurvilinearFlow::CurvilinearFlow(std::string_view kind, std::vector<CurvilinearBlock> the_blocks,
                                 VectorReconstruction the_reconstruction, double the_tolerance)
    : VectorFieldDefinition(FlowKind::curvilinear),
      blocks(std::move(the_blocks)),
      reconstruction(the_reconstruction),
      tolerance(the_tolerance > 0 ? the_tolerance : usual_tolerance * extent_of(bounds_of(blocks))),
      kind_(kind),
      bounds_(bounds_of(blocks)) {
  for (const CurvilinearBlock& block : blocks)
    for (std::size_t node = 0; node < block.vectors.size(); node++) {
      const glm::vec3& vector = block.vectors[node];
      const bool counts = finite(vector) && (block.blanked.empty() || block.blanked[node] == 0);
      if (counts) greatest_speed_ = std::max(greatest_speed_, glm::length(glm::dvec3(vector)));
    }
}

std::vector<Fact> CurvilinearFlow::facts() const {
  std::string sizes, seams;
  std::size_t nodes = 0, cells = 0, inverted = 0, degenerate = 0, blanked = 0, non_finite = 0;
  const double seam_gap = seam_tolerance * extent_of(bounds_);
  for (std::size_t number = 0; number < blocks.size(); number++) {
    const CurvilinearBlock& block = blocks[number];
    sizes += (number > 0 ? ", " : "") + shown(block.size);
    nodes += node_count(block.size);
    cells += cell_count(block.size);
    const CellExamination examined = examine_cells(block.size, block.points);
    inverted += examined.inverted;
    degenerate += examined.degenerate;
    const Gaps gaps = gaps_of(block);
    blanked += gaps.blanked_cells;
    non_finite += gaps.non_finite;
    const std::array<bool, 3> closed = find_seams(block.size, block.points, seam_gap);
    for (std::size_t axis = 0; axis < 3; axis++)
      if (closed[axis]) seams += fmt::format("{}block {} along {}", seams.empty() ? "" : ", ", number, "ijk"[axis]);
  }
  std::vector<Fact> facts{
      {"field", std::string(kind_)},
      {"reconstruction", reconstruction == VectorReconstruction::tricubic ? "tricubic" : "trilinear"},
      {"blocks", fmt::format("{}: {}", blocks.size(), sizes)},
      {"nodes", fmt::format("{}", nodes)},
      {"cells", fmt::format("{}", cells)},
      {"inverted cells", fmt::format("{}", inverted)},
      {"degenerate cells", fmt::format("{}", degenerate)},
      {"blanked cells", fmt::format("{}", blanked)},
      {"seams", seams.empty() ? "none" : seams},
      {"greatest speed", fmt::format("{:g}", greatest_speed_)},
      {"tolerance", fmt::format("{:g}", tolerance)},
  };
  if (non_finite > 0)
    facts.push_back({"not finite",
                     fmt::format("{} vectors are NaN or infinite: the field is undefined in their cells", non_finite)});
  return facts;
}

VectorField curvilinear_flow(std::vector<CurvilinearBlock> blocks, VectorReconstruction reconstruction,
                             double tolerance) {
  if (blocks.empty()) refuse("a curvilinear field must have at least one block");
  if (!(tolerance >= 0) || !std::isfinite(tolerance))
    refuse(fmt::format("the tolerance of places in cells must be a positive number, or 0, not {}", tolerance));
  std::size_t nodes = 0;
  for (std::size_t number = 0; number < blocks.size(); number++) {
    check_block(blocks[number], fmt::format("block {}", number));
    nodes += node_count(blocks[number].size);
  }
  if (nodes > most_nodes)
    refuse(fmt::format("a curvilinear field may have {} nodes in all its blocks, not {}", most_nodes, nodes));
  if (!(extent_of(bounds_of(blocks)) > 0)) refuse("the nodes of a curvilinear field must not all stand at one point");
  return VectorField(
      std::make_shared<const CurvilinearFlow>("curvilinear", std::move(blocks), reconstruction, tolerance));
}

VectorField rectilinear_flow(const std::array<std::vector<double>, 3>& axes, Values<glm::vec3> vectors,
                             VectorReconstruction reconstruction) {
  const std::string what = "a rectilinear field";
  std::size_t nodes = 1;
  for (std::size_t axis = 0; axis < 3; axis++) {
    const std::vector<double>& places = axes[axis];
    if (places.size() < 2)
      refuse(fmt::format("{} must have at least 2 nodes along {}, not {}", what, "xyz"[axis], places.size()));
    for (std::size_t i = 0; i < places.size(); i++) {
      if (!std::isfinite(places[i]))
        refuse(fmt::format("node {} of {} along {} must be finite, not {}", i, what, "xyz"[axis], places[i]));
      if (i > 0 && !(places[i] > places[i - 1]))
        refuse(fmt::format("the nodes of {} along {} must increase, but {} follows {}", what, "xyz"[axis], places[i],
                           places[i - 1]));
    }
    if (places.size() > most_nodes / nodes)
      refuse(fmt::format("{} may have {} nodes, not {} x {} x {}", what, most_nodes, axes[0].size(), axes[1].size(),
                         axes[2].size()));
    nodes *= places.size();
  }
  CurvilinearBlock block;
  block.size = glm::ivec3(int(axes[0].size()), int(axes[1].size()), int(axes[2].size()));
  check_length(vectors.size(), block.size, "vectors", what);
  block.points.reserve(nodes);
  for (const double z : axes[2])
    for (const double y : axes[1])
      for (const double x : axes[0]) block.points.push_back({x, y, z});
  block.vectors = std::move(vectors);
  std::vector<CurvilinearBlock> blocks;
  blocks.push_back(std::move(block));
  return VectorField(std::make_shared<const CurvilinearFlow>("rectilinear", std::move(blocks), reconstruction, 0));
}

}  // namespace smurf
