// The roots of an expression on stretches of a line, proved in double precision: interval arithmetic with outward
// rounding all the way.
//
// A stretch is modelled by a polynomial of third degree with bounds on what it leaves out (series.hpp). Bisection of
// the polynomial leaves parts that are proved to hold no root or exactly one, and parts where it stays within those
// bounds, which are modelled again, and more closely, on their own. What rounding leaves undecided in the end, such as
// double roots, is told with its enclosure.
//
// Only where the function is proved to be defined and continuous a root counts as proved; poles and jumps are none.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "expression/graph.hpp"

namespace smurf::expression {

struct LineRoot {
  enum class Kind {
    one,        // exactly one root, proved
    touching,   // undecided, between certain signs
    undecided,  // and a sign beside it is not certain, or the function may be undefined or jump
  };
  double low, high;  // enclosure in t
  Kind kind;
};

class LineRoots {
 public:
  // Of f = level. Keeps what it needs of the graph.
  LineRoots(const Graph& graph, NodeId f, double level);

  // Adds the roots for t in [low, high], in order. The numbers given are taken as exact. May be called by threads at
  // once.
  void find(const glm::dvec3& origin, const glm::dvec3& direction, double low, double high,
            std::vector<LineRoot>& roots) const;

 private:
  Program program_;
  double level_;
};

}  // namespace smurf::expression
