// All roots of a ray on the pieces of a surface s(u, v), in double precision: for the few rays that floats leave open.
//
// 1. Leaves that the ray may meet are found in a hierarchy of their boxes.
// 2. Boxes of parameters are excluded, certain (patches/leaves.hpp), or halved, all of one size before smaller ones.
//    What stays where the surface bends by less than rounding within a box may be a double root: its enclosure is told.
// 3. Roots that several boxes or pieces tell are one, by the rules of kernels/patch/finish.inc. Next to collapsed sides
//    boxes are halved down to a small part of the extent; what is left there is one root at the pole.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "expression/line_roots.hpp"
#include "patches/leaves.hpp"
#include "patches/piece_source.hpp"
#include "patches/topology.hpp"

namespace smurf {

struct PatchRoot {
  expression::LineRoot root;
  std::uint32_t piece = 0;
  double u = 0, v = 0;  // in the piece's own parameters
};

// Boxes in space by halves.
class LeafBoxes {
 public:
  // Boxes reach beyond their leaves by `margin`.
  LeafBoxes(const std::vector<PatchLeaf>& leaves, double margin);
  // Adds the numbers of leaves whose boxes the line passes at t in [low, high].
  void along(const glm::dvec3& origin, const glm::dvec3& direction, double low, double high,
             std::vector<std::uint32_t>& found) const;

 private:
  struct Node {
    SpaceBox box{};
    std::uint32_t first = 0, count = 0;  // of numbers_; count 0: the children are the next node and node `first`
  };
  std::uint32_t build(const std::vector<PatchLeaf>& leaves, double margin, std::uint32_t first, std::uint32_t count);

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> numbers_;
};

class RayRoots {
 public:
  // `extent` is the greatest side of the bounds of all. Keeps references to source and topology.
  RayRoots(const PieceSource& source, const PatchTopology& topology, std::vector<PatchLeaf> leaves, double extent);

  // Adds the roots for t in [low, high], in order. The numbers given are taken as exact. May be called by threads at
  // once.
  //   one        exactly one root, proved
  //   touching   a double root to rounding: none, one or several
  //   undecided  the ray lies in the surface over a stretch, or the surface is undefined there, or it took too long
  // A flat piece that lies along the ray has no roots.
  void find(const glm::dvec3& origin, const glm::dvec3& direction, double low, double high,
            std::vector<PatchRoot>& roots) const;

 private:
  const PieceSource& source_;
  const PatchTopology& topology_;
  std::vector<PatchLeaf> leaves_;
  double extent_;
  glm::dvec3 centre_{0.0};
  LeafBoxes boxes_;
};

}  // namespace smurf
