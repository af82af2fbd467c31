// A ray against boxes of parameters, in double precision: excluded, certain, halved, or left open. The test is that of
// kernels/patch/leaf.inc; patches/ray_roots.hpp makes roots of the surface of what is found here.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "patches/leaves.hpp"
#include "patches/piece_source.hpp"
#include "patches/topology.hpp"

namespace smurf {

// Next to the surface's centre, which is 0.
struct BoxRay {
  glm::dvec3 origin{0.0}, direction{0.0}, centre{0.0};
  double start = 0;  // t as given, less t from the origin here
  double error = 0;  // of places on it and on the surface, beside what leaves tell
};
BoxRay box_ray(const glm::dvec3& origin, const glm::dvec3& direction, const glm::dvec3& centre, double extent);

// Cuts [low, high] to the box; false where nothing is left.
bool clip_to_box(const SpaceBox& box, const glm::dvec3& origin, const glm::dvec3& direction, double& low, double& high);

// How far apart sides may be that are one edge.
double gap_of(const PatchTopology& topology, double extent);

constexpr std::uint32_t no_vertex = 0xffffffffu;

constexpr int open_edge = -2;

struct BoxRoot {
  std::uint32_t piece = 0;
  glm::dvec2 at{0.0}, alone{0.0};  // within so much of u and v it is the only one in its piece
  double t = 0, t_error = 0;
  double reach = 0;         // by how much t may differ from that of the same root in another piece
  int side = 0;             // 1 or -1: how the surface is crossed; 0 where it is not known
  bool is_outside = false;  // beyond the border of its piece, by rounding or a gap
  // At a border in u, in v: 2·number of the edge, and 1 more where the surface turns over; open_edge where no other
  // side is that edge as a whole; -1 where it is at none. Then which side of its piece it is, and how far along it.
  std::array<int, 2> edges{-1, -1};
  std::array<int, 2> sides{};
  std::array<double, 2> along{};
  std::uint32_t vertex = no_vertex;
  bool is_pole = false;
  glm::dvec3 place{0.0};
  double size = 0;  // of a pole: within it nothing is told apart
};

struct OpenBox {
  double low = 0, high = 0;
  std::uint32_t piece = 0;
  glm::dvec2 at{0.0}, half{0.0};
  bool is_undecided = false;  // by its size or for want of bounds, not by rounding
};

class RayBoxes {
 public:
  // Roots with t from the ray's origin in [low, high] are found; some beside it are told, too.
  RayBoxes(const PieceSource& source, const PatchTopology& topology, double extent, const BoxRay& ray, double low,
           double high);
  void add(const PatchLeaf& leaf);
  void search();

  const std::vector<BoxRoot>& roots() const { return roots_; }
  const std::vector<OpenBox>& open() const { return open_; }
  // Whether a root lies away from all boxes that stayed open.
  bool is_apart(const BoxRoot& root) const;

 private:
  struct Box {
    std::uint32_t piece = 0;
    glm::dvec2 centre{0.0}, half{0.0};
    int bounds = -1;  // number in bounds_, or one of the codes below
    int depth = 0;
    const PatchLeaf* leaf = nullptr;  // where it is a whole one, whose numbers are known
  };
  static constexpr int bounds_asked = -1, bounds_none = -2;
  struct Plane {
    glm::dvec3 m{0.0}, a{0.0}, b{0.0}, e{0.0};
    double error = 0;
    glm::dvec3 flat{0.0};  // the normal of a flat piece
    double lengths() const { return glm::length(a) + glm::length(b) + glm::length(e); }
  };
  struct Meeting {
    glm::dvec3 row_x{0.0}, row_y{0.0}, foot{0.0};
    double determinant = 0, t = 0, x = 0, y = 0, off = 0, q = 0;
    bool is_met = false, is_certain = false;
  };
  enum class Verdict { none, root, open };

  void look(Box box, std::vector<Box>& next);
  void look_without_bounds(const Box& box, int side, std::vector<Box>& next);
  void refine_open();
  Plane plane_of(const Box& box) const;
  Meeting meet(const Plane& plane, const glm::dvec2& slack) const;
  std::optional<OpenBox> enclosure(const Box& box, const Plane& plane, const Meeting& k) const;
  Verdict newton(const Box& box, const Plane& plane, const Meeting& k, const glm::dvec2& slack);
  void add_root(const Box& box, const glm::dvec2& at, const glm::dvec2& off, BoxRoot root);
  void add_pole(const Box& box, int side, const glm::dvec3& place, double size);
  void halve(const Box& box, int direction, bool ask, std::vector<Box>& next) const;
  glm::dvec3 flat_normal(std::uint32_t piece);
  int best_direction(const Box& box, const Plane& plane) const;
  // Which collapsed side the box touches, or -1.
  int collapsed_side(const Box& box) const;
  // By which part of the box roots may lie beyond it: where pieces meet with a gap.
  glm::dvec2 slack_of(const Box& box, const Plane& plane) const;

  const PieceSource& source_;
  const PatchTopology& topology_;
  const double extent_;
  const BoxRay ray_;
  const double low_, high_, gap_;
  std::vector<PieceBounds> bounds_;
  std::map<std::uint32_t, glm::dvec3> flat_;
  std::vector<Box> waiting_;
  std::vector<std::pair<OpenBox, Box>> kept_;  // to be told more closely before they go to open_
  std::vector<BoxRoot> roots_;
  std::vector<OpenBox> open_;
  struct Alone {
    std::uint32_t piece;
    ParameterBox box;
  };
  std::vector<Alone> alone_;  // boxes with one root at most, which is told or not there
};

}  // namespace smurf
