// Facets cut into cells, each with bounds in space that are made from samples and their differences, widened
// generously: places to start Newton's iteration from, and to leave out. A tree of boxes is over them.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "reference/parametric/facets.hpp"

namespace smurf {

struct ReferenceCell {
  std::uint32_t facet = 0;
  glm::dvec2 lower{0.0}, upper{0.0};
  int defined = 0;  // of nine samples; bounds are those of what is defined
  glm::dvec3 centre{0.0};
  double radius = 0;
  // Within `thickness` of the plane at right angles to `normal` through the centre, where the normals turn away from it
  // by `spread` at most; where there is no such direction, 0 with a spread of pi.
  glm::dvec3 normal{0.0};
  double spread = 0, thickness = 0;
  // How far the surface is from bilinear, by what bends along u and along v, and the lengths of the cell along them.
  glm::dvec2 bend{0.0}, length{0.0};

  glm::dvec2 middle() const { return 0.5 * (lower + upper); }
};

ReferenceCell reference_cell(const ReferenceFacet& facet, std::uint32_t number, const glm::dvec2& lower,
                             const glm::dvec2& upper);

class ReferenceCells {
 public:
  explicit ReferenceCells(const std::vector<std::unique_ptr<ReferenceFacet>>& facets);

  const std::vector<ReferenceCell>& all() const { return cells_; }
  glm::dvec3 lower() const { return nodes_.front().lower; }
  glm::dvec3 upper() const { return nodes_.front().upper; }

  // Cells whose boxes the line o + t·d meets for t in [low, high].
  void along(const glm::dvec3& origin, const glm::dvec3& direction, double low, double high,
             const std::function<void(const ReferenceCell&)>& visit) const;
  // Cells that may be nearer to the point than `reach`, nearer boxes first; visit() gives the new reach.
  void around(const glm::dvec3& point, double reach, const std::function<double(const ReferenceCell&)>& visit) const;
  std::size_t bytes() const { return cells_.size() * sizeof(ReferenceCell) + nodes_.size() * sizeof(Node); }

 private:
  struct Node {
    glm::dvec3 lower{0.0}, upper{0.0};
    std::uint32_t first = 0, count = 0;  // cells of a leaf
    std::uint32_t right = 0;             // of an inner node; its left child follows it
  };
  std::uint32_t build(std::uint32_t first, std::uint32_t count);

  std::vector<ReferenceCell> cells_;
  std::vector<Node> nodes_;
};

}  // namespace smurf
