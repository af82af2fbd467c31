// A streamline, integrated as exactly as doubles allow.
//
// Steps are those of Dop853Step with error control. A step that leaves the piece of the field that it began in ends on
// the piece's border, which is found by bisection; the next begins in the piece beyond. A step sees the smooth field of
// one piece only, so the kinks of a trilinear field cost no order. Accuracy reached, of the domain's extent: 1e-11 in
// expressions over a few turnovers; 1e-10 in grids, where a line clips a corner of a cell by less than about 1e-3 of
// its size the clipping may be missed, which costs less than 1e-9.
#pragma once

#include <glm/glm.hpp>
#include <limits>
#include <vector>

#include "reference/flow/flow.hpp"

namespace smurf {

struct LineRequest {
  double time = 1;      // negative: back
  double interval = 0;  // between points, in time; 0: a point each step
  // In the place of `interval`: times of points without sign, ascending, of which the first is 0 and the last the end.
  const std::vector<double>* times = nullptr;
  double tolerance = 1e-13;  // of the error of a step, as a part of the extent
  double stagnation = 0;     // speed below which the line ends
  double length = std::numeric_limits<double>::infinity();
  long most_steps = std::numeric_limits<long>::max();
  // Goes on from the border of the domain in the last piece, as far as a cell: for neighbours of a line.
  bool beyond = false;
};

struct LinePoint {
  double time;  // from the seed; of the sign of the request's
  glm::dvec3 position;
};

struct ReferenceLine {
  std::vector<LinePoint> points;  // the seed first
  FlowStatus end = FlowStatus::inside;
  std::vector<double> steps;  // their lengths in time, without sign
};

ReferenceLine trace_line(const ReferenceFlow& flow, const glm::dvec3& seed, const LineRequest& request);

// With the steps given, and no ends; in the piece that `piece_at` lies in. The points are at the times given, which
// ascend without sign, and as many as are reached with finite values. Neighbours that take the same steps have errors
// that are smooth in the seed, which differences need.
std::vector<LinePoint> repeat_line(const ReferenceFlow& flow, const glm::dvec3& piece_at, const glm::dvec3& seed,
                                   double direction, const std::vector<double>& steps,
                                   const std::vector<double>& times);

}  // namespace smurf
