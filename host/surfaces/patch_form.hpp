// What devices hold of surfaces made of pieces s(u, v): leaves, a hierarchy of boxes over them, and the pieces
// (kernels/patch/layout.inc).
//
// Coordinates are relative to the middle of the surface and in a unit, a power of two, in which it is 1 to 2 in size:
// floats then err by parts of the surface's size, wherever it lies.
//
// Device memory: about 125 bytes a leaf, 144 a piece, and the control points.
#pragma once

#include <bit>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "bvh/hierarchy.hpp"
#include "device/executor.hpp"
#include "patches/leaves.hpp"
#include "patches/topology.hpp"
#include "smurf/interrogator.hpp"

namespace smurf {

// Words to which numbers are written.
class Words {
 public:
  explicit Words(std::vector<std::uint32_t>& words) : words_(words) {}
  // Room for `count` more; returns where it begins.
  std::size_t add(std::size_t count) {
    const std::size_t at = words_.size();
    words_.resize(at + count);
    return at;
  }
  void put(std::size_t at, float value) { words_[at] = std::bit_cast<std::uint32_t>(value); }
  void put(std::size_t at, std::int32_t value) { words_[at] = std::uint32_t(value); }
  void put(std::size_t at, const glm::dvec3& v) {
    for (int axis = 0; axis < 3; axis++) put(at + std::size_t(axis), float(v[axis]));
  }

 private:
  std::vector<std::uint32_t>& words_;
};

// From the surface's own coordinates to those of its device form.
struct PatchFrame {
  glm::dvec3 centre{0.0};
  double unit = 1;
  glm::dvec3 operator()(const glm::dvec3& p) const { return (p - centre) * unit; }
};

class PatchForm {
 public:
  explicit PatchForm(const Bounds& bounds);

  const PatchFrame& frame() const { return frame_; }
  // What is assembled: the words of pieces, and of control points. After add_pieces a kind puts what it has beside.
  std::vector<std::uint32_t> pieces, points;
  // The records of all pieces, with their borders, and the poles. What a piece is made of is put there afterwards.
  // `more` are boxes of the surface's parameters without a shape, for leaves that are open.
  void add_pieces(const PieceSource& source, const PatchTopology& topology, const std::vector<PatchLeaf>& leaves,
                  std::span<const ParameterBox> more = {});
  // The control points of a Bézier piece, and the linear map to the parameters of its patch; `start`: where that
  // begins. `rational`: with weights.
  void put_bezier(std::size_t number, const BezierPiece& piece, const glm::dvec2& start, bool rational);

  double off = 0;  // how far pieces are from what they stand for, in each component
  // Uploads what was assembled, and the leaves in the order of their hierarchy. `more` tells by
  // how much the remainder of a leaf has to be greater (kernels/patch/layout.inc); `bounds` are those of the surface;
  // parts begin at word `parts` of the pieces.
  void upload(Executor& executor, const std::vector<PatchLeaf>& leaves, const Bounds& bounds,
              const std::function<double(const PatchLeaf&)>& more, std::size_t parts, std::size_t part_count);

  std::map<std::string, std::string> defines() const;  // of the hierarchy
  BufferGroup buffers() const;
  std::size_t bytes() const;

 private:
  using WordBuffer = TypedBuffer<std::uint32_t>;
  void put_sides_of_poles(const PatchTopology& topology);
  Bvh upload_leaves(Executor& executor, const std::vector<PatchLeaf>& leaves, const Bounds& bounds,
                    const std::function<double(const PatchLeaf&)>& more);
  double error_of(const PatchLeaf& leaf, double world) const;
  void put_leaf(Words& words, std::size_t at, const PatchLeaf& leaf, double world, double more) const;

  PatchFrame frame_;
  std::size_t poles_ = 0;
  std::size_t stack_ = 0;
  WordBuffer uniforms_, nodes_, leaves_, pieces_, points_;
};

}  // namespace smurf
