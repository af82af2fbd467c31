// One line against cells of a parametric surface. Lengths are along the direction, which has length 1 here.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "reference/parametric/borders.hpp"
#include "reference/parametric/cells.hpp"
#include "reference/parametric/facets.hpp"

namespace smurf {

// A contact that is longer, relative to the extent, is a line within the surface.
constexpr double longest_contact = 1e-2;

struct LineRoot {
  std::uint32_t facet = 0;
  double u = 0, v = 0;
  double t = 0;              // length from the search's origin
  double low = 0, high = 0;  // what the root stands for, in t; both t for a single one
  glm::dvec3 place{0.0};
  double slope = 0;
  double rounding = 0;  // of the place
  glm::dvec2 parameter_rounding{0.0};
  bool is_single() const { return low == high; }
};

class LineSearch {
 public:
  LineSearch(const std::vector<std::unique_ptr<ReferenceFacet>>& facets, const ReferenceBorders& borders, double extent,
             const glm::dvec3& origin, const glm::dvec3& direction, double low, double high, double rounding);

  // Adds the roots that are found from a cell; they need not lie in it.
  void look_into(const ReferenceCell& cell, bool flat);
  std::vector<LineRoot>& roots() { return roots_; }
  double tolerance() const { return tolerance_; }

 private:
  struct Start {
    glm::dvec2 at{0.0}, size{0.0};  // size: of the cell, which steps are measured by
    int pole = -1;                  // the side next to it that is a pole
  };
  enum class Outcome { root, left, none };

  void look(const ReferenceCell& cell, int depth);
  void look_along(const ReferenceCell& cell);
  bool passes(const ReferenceCell& cell) const;
  bool within_stretch(const ReferenceCell& cell) const;
  Outcome iterate(std::uint32_t facet, const Start& start);
  Start start_in(const ReferenceCell& cell, const glm::dvec2& at) const;
  glm::dvec2 around_pole(std::uint32_t facet, const Start& start, const glm::dvec2& at, const ReferenceJet& jet,
                         glm::dvec2 move) const;
  bool look_towards_pole(const ReferenceCell& cell, const Start& start);
  glm::dvec2 within_turn(std::uint32_t facet, int axis, const glm::dvec2& at) const;
  void take(std::uint32_t facet, const glm::dvec2& at, const ReferenceJet& jet);
  // Where the line touches the surface, or lies within it: everything along it that is not off by more than rounding.
  void take_contact(std::uint32_t facet, const glm::dvec2& at, double t);
  double follow(std::uint32_t facet, glm::dvec2 at, double t, double step) const;
  std::optional<glm::dvec2> project(std::uint32_t facet, const glm::dvec2& from, double t) const;
  bool in_domain(std::uint32_t facet, const glm::dvec2& at, const ReferenceJet& jet) const;
  glm::dvec2 across(const glm::dvec3& p) const { return {glm::dot(e1_, p), glm::dot(e2_, p)}; }

  const std::vector<std::unique_ptr<ReferenceFacet>>& facets_;
  const ReferenceBorders& borders_;
  double extent_;
  glm::dvec3 origin_, direction_, e1_, e2_;
  double low_, high_, tolerance_, noise_;
  std::vector<LineRoot> roots_;
};

}  // namespace smurf
