// Polynomial expressions as device source: their restriction to a stretch of a ray, in Bernstein form with a bound on its rounding.
//
// On the stretch every coordinate is linear, so that every node of the graph is a polynomial whose degree is known beforehand. Nodes are
// kept in scaled Bernstein form (coefficients times the binomials), in which a product is a convolution and all steps are sums of
// products without cancellation that was not in the expression (Farouki, Rajan 1988). Beside each node stand the size of its
// coefficients as they came out and a running bound on their error, both for the lane's own stretch.
#pragma once

#include <string>

#include "expression/graph.hpp"

namespace smurf::expression {

// The body of a function of the coordinates at the stretch's ends, real from_x, to_x, from_y, ..., and of bounds on their errors,
// real error_x, ...: statements that end with `piece.polynomial.b[0..degree]` and `piece.error` assigned, for f - level.
// f must be a polynomial of that degree (polynomial_degree), at least 1.
std::string polynomial_source(const Graph& graph, NodeId f, int degree);

}  // namespace smurf::expression
