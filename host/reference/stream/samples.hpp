// Dense samples of a stream surface in (u, τ), and which of the cells between them a ray, or a ball, may meet.
//
// A cell is the bicubic patch that has the samples' positions, tangents and mixed derivatives at its corners. Lines are
// put between lines, and times between times, until the line in the middle of a cell lies on the patch to a small part
// of the extent, or there are as many as are allowed. What remains is measured, and the boxes of cells are grown by a
// multiple of it. Patches are where to begin: what is found on them is then looked for on the surface itself.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "reference/flow/boxes.hpp"
#include "reference/stream/map.hpp"

namespace smurf {

// Control points in the Bernstein basis, u fastest.
using StreamNet = std::array<glm::dvec3, 16>;

struct StreamCellPlace {
  std::uint32_t stretch = 0;
  double u0 = 0, u1 = 0, t0 = 0, t1 = 0;
  double off = 0;  // how far the surface may be from the patch
};

struct NetPoint {
  glm::dvec3 x, a, b, aa, ab, bb;  // by the parameters of the cell, which are from 0 to 1
};
NetPoint evaluate(const StreamNet& net, double a, double b);

class StreamSamples {
 public:
  explicit StreamSamples(const ReferenceStreamMap& map);

  double extent() const { return extent_; }
  std::size_t size() const { return cells_.size(); }
  StreamCellPlace place(std::size_t cell) const;
  StreamNet net(std::size_t cell) const;
  const BoxTree& boxes() const { return boxes_; }
  std::size_t bytes() const;

  // The surface closes on itself: c(u) is one point at both ends, or every line comes back to its seed.
  bool is_closed_in_u() const { return closed_u_; }
  bool is_closed_in_time() const { return closed_time_; }

 private:
  struct Bundle {  // a line with its derivatives by u, at times and half way between them
    double u = 0;
    std::vector<glm::dvec3> x, v, s, sv;
    double from = 0, until = 0;
    bool is_alive(double first, double last) const { return until >= first && from <= last; }
  };
  struct Strip {             // between a line and the next
    std::vector<float> off;  // of each cell
    bool settled = false;
    double from = 0, until = 0;  // of the line in its middle
  };
  struct Part {
    std::vector<Bundle> lines;
    std::vector<Strip> strips;
  };
  struct Cell {
    std::uint32_t part, line, time;
  };

  std::vector<double> with_middles() const;
  Bundle sample(std::size_t part, double u) const;
  StreamNet net_of(std::size_t part, std::size_t line, std::size_t time) const;
  void trace_all();
  bool refine_times();
  bool refine_lines();
  void measure_extent();
  void close();
  void list_cells();

  const ReferenceStreamMap& map_;
  double extent_ = 0;
  std::vector<double> times_;
  std::vector<Part> parts_;  // of each stretch
  std::vector<Cell> cells_;
  BoxTree boxes_{std::vector<BoxTree::Box>{}};
  bool closed_u_ = false, closed_time_ = false;
};

}  // namespace smurf
