// Where a ray meets a stream surface.
//
// Each cell whose box the ray meets is halved until a part lies off the ray by its control points, or is crossed by a
// ray of this direction once at most (all products of differences of its control points across the ray have one sign);
// Newton's method finds the crossing of the patch there, and from it that of the surface, with the true map. Parts that
// are neither hold a fold of the surface as seen along the ray: the fold is found on the true surface, and two
// crossings beside it, one double crossing, or none. A ray that runs along a cell has one enclosure for all of it.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "reference/stream/map.hpp"
#include "reference/stream/samples.hpp"
#include "reference/surface.hpp"

namespace smurf {

struct StreamCrossing {
  double t = 0, u = 0, time = 0;
  double uncertainty = 0;
  double slope = 1;  // |cos| of the angle of ray and normal
  HitStatus status = HitStatus::sampled;
  std::uint32_t stretch = 0;
};

class StreamCrossings {
 public:
  StreamCrossings(const ReferenceStreamMap& map, const StreamSamples& samples) : map_(map), samples_(samples) {}

  // In order of t.
  std::vector<StreamCrossing> find(const ReferenceRay& ray) const;

 private:
  struct Line;  // the ray, and a frame across it
  struct Piece;
  void cross_cell(const Line& line, std::size_t cell, std::vector<StreamCrossing>& found) const;
  std::optional<StreamCrossing> polish(const Line& line, const StreamCellPlace& place, const StreamNet& net, double a,
                                       double b, bool exact) const;
  void unfold(const Line& line, const StreamCellPlace& place, const StreamNet& net, const Piece& piece,
              std::vector<StreamCrossing>& found) const;
  void run_along(const Line& line, const StreamCellPlace& place, const std::vector<Piece>& open,
                 std::vector<StreamCrossing>& found) const;
  bool accept(const Line& line, StreamCrossing& crossing, double x_u, double x_t, double end) const;
  void merge(const Line& line, std::vector<StreamCrossing>& found) const;
  double apart(const Line& line, const StreamCrossing& a, const StreamCrossing& b) const;

  const ReferenceStreamMap& map_;
  const StreamSamples& samples_;
};

}  // namespace smurf
