// The reference for flows against closed forms, invariants and an integrator of another kind; why lines end, and where;
// what is kept of them; derivatives.
#include "reference/flow/flow.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "flows/kinds.hpp"
#include "flows/queries.hpp"
#include "reference/flow/dop853.hpp"
#include "reference/flow/extrapolation.hpp"
#include "reference/flow/line.hpp"
#include "reference/flow/variation.hpp"
#include "truth/flow/flows.hpp"

namespace smurf::test {
namespace {

using glm::dvec3;

std::shared_ptr<const ReferenceFlow> reference_of(const VectorField& field) { return refer(field.model()); }

Domain cube(double half) { return {dvec3(-half), dvec3(half)}; }

// The end of a line, traced without anything else to end it.
ReferenceLine whole_line(const ReferenceFlow& flow, const dvec3& seed, double time) {
  const ReferenceLine line = trace_line(flow, seed, {.time = time});
  EXPECT_EQ(line.end, FlowStatus::time);
  return line;
}

TEST(ReferenceFlow, StepsHaveTheirOrder) {
  const FlowTruth truth = nonlinear_flows()[1];
  const auto flow = reference_of(truth.field());
  const dvec3 seed = truth.seeds[1];
  const auto f = [&](const Dop853Step::State& y, Dop853Step::State& slope) {
    slope = Dop853Step::State(flow->value(0, dvec3(y), dvec3(0)), 0);
    return true;
  };
  const auto errors = [&](double h) {
    Dop853Step step;
    Dop853Step::State slope;
    f({seed, 0}, slope);
    step.take(f, {seed, 0}, slope, h);
    step.densify(f);
    const auto off = [&](const dvec3& at, double t) {
      return glm::length(at - truth.at(seed, dvec3(0), dvec3(0), t).position);
    };
    double dense = 0;
    for (const double theta : {0.3, 0.5, 0.8}) dense = std::max(dense, off(dvec3(step.at(theta)), theta * h));
    return std::pair(off(dvec3(step.end()), h), dense);
  };
  const auto [end, dense] = errors(1.0);
  const auto [half_end, half_dense] = errors(0.5);
  // One step errs by h⁹, and between its ends by h⁸.
  EXPECT_NEAR(std::log2(end / half_end), 9, 0.7) << end << " " << half_end;
  EXPECT_NEAR(std::log2(dense / half_dense), 8, 0.7) << dense << " " << half_dense;
}

TEST(ReferenceFlow, PositionsAreThoseOfClosedForms) {
  for (const FlowTruth& truth : known_flows()) {
    const auto flow = reference_of(truth.field());
    for (const dvec3& seed : truth.seeds) {
      for (const double time : {truth.time, -truth.time}) {
        const ReferenceLine line = whole_line(*flow, seed, time);
        for (const LinePoint& point : line.points) {
          const dvec3 known = truth.at(seed, dvec3(0), dvec3(0), point.time).position;
          // 1e-13 of the extent, 8, a step; errors grow with the flow, by up to e here.
          EXPECT_LT(glm::length(point.position - known), 2e-11) << truth.name << " at " << point.time;
        }
      }
    }
  }
}

TEST(ReferenceFlow, VariationIsThatOfClosedForms) {
  const dvec3 tangent(0.6, -0.8, 0.5), second(0.4, 0.3, -1.1);
  for (const FlowTruth& truth : known_flows()) {
    const auto flow = reference_of(truth.field());
    for (const dvec3& seed : truth.seeds) {
      for (const double time : {truth.time, -truth.time}) {
        const LineRequest request{.time = time, .interval = std::abs(time) / 5};
        const ReferenceLine line = trace_line(*flow, seed, request);
        ASSERT_EQ(line.points.size(), 6u);
        const LineVariation variation = vary_line(*flow, line, request, tangent, second, 2);
        for (std::size_t i = 0; i < line.points.size(); i++) {
          const FlowPosition known = truth.at(seed, tangent, second, line.points[i].time);
          // Differences of doubles: 1e-15 of the extent over a step of 1e-2, and over its square.
          EXPECT_LT(glm::length(variation.first[i] - known.first), 1e-10 * (1 + glm::length(known.first)))
              << truth.name << " at " << line.points[i].time;
          EXPECT_LT(glm::length(variation.second[i] - known.second), 1e-8 * (1 + glm::length(known.second)))
              << truth.name << " at " << line.points[i].time;
        }
      }
    }
  }
}

TEST(ReferenceFlow, InvariantsStay) {
  for (const FlowInvariant& flow : invariant_flows()) {
    const auto reference = reference_of(flow.field());
    for (const dvec3& seed : flow.seeds) {
      const ReferenceLine line = trace_line(*reference, seed, {.time = flow.time, .interval = 0.1});
      ASSERT_GE(line.points.size(), 40u) << flow.name;
      for (const LinePoint& point : line.points)
        EXPECT_NEAR(flow.constant(point.position), flow.constant(seed), 1e-10) << flow.name;
    }
  }
}

TEST(ReferenceFlow, AbcFlowByAnotherIntegrator) {
  const AbcFlow abc;
  const auto flow = reference_of(expression_flow(abc.vector, abc.domain));
  for (const dvec3& seed : {dvec3(0.1, 0.2, 0.3), dvec3(1, -2, 0.5), dvec3(-1.5, 0.7, 2)}) {
    for (const double time : {3.0, -3.0}) {
      const dvec3 coarse = extrapolated_line(AbcFlow::value, seed, time, 24),
                  fine = extrapolated_line(AbcFlow::value, seed, time, 48);
      ASSERT_LT(glm::length(coarse - fine), 1e-11);  // what the other one is worth
      EXPECT_LT(glm::length(whole_line(*flow, seed, time).points.back().position - fine), 1e-10);
    }
  }
}

TEST(ReferenceFlow, EndsAtTheBorder) {
  // Straight to a side.
  const auto shear = reference_of(expression_flow({"1", "0.25", "0"}, cube(1)));
  ReferenceLine line = trace_line(*shear, dvec3(-0.5, 0, 0.2), {.time = 10});
  EXPECT_EQ(line.end, FlowStatus::domain);
  EXPECT_NEAR(line.points.back().time, 1.5, 1e-12);
  EXPECT_LT(glm::length(line.points.back().position - dvec3(1, 0.375, 0.2)), 1e-12);
  // Out of a ball.
  Domain ball = cube(1);
  ball.radius = 0.75;
  line = trace_line(*reference_of(expression_flow({"1", "0", "0"}, ball)), dvec3(0, 0.25, 0), {.time = 10});
  EXPECT_EQ(line.end, FlowStatus::domain);
  EXPECT_NEAR(line.points.back().time, std::sqrt(0.5), 1e-12);
  // A turn that only just leaves, between two ends of steps.
  const auto rotation = reference_of(expression_flow({"-y", "x", "0"}, cube(1)));
  line = trace_line(*rotation, dvec3(0, -1.0001, 0), {.time = 6});
  EXPECT_EQ(line.end, FlowStatus::domain);
  EXPECT_EQ(line.points.size(), 1u);
  line = trace_line(*rotation, dvec3(1.0001 * std::cos(0.5), 1.0001 * std::sin(0.5), 0), {.time = 6});
  EXPECT_EQ(line.end, FlowStatus::domain);
  EXPECT_NEAR(line.points.back().time, std::asin(1 / 1.0001) - 0.5, 1e-10);
  line = trace_line(*rotation, dvec3(0.9999, 0, 0), {.time = 6});
  EXPECT_EQ(line.end, FlowStatus::time);
}

TEST(ReferenceFlow, EndsWhereNothingIsDefined) {
  const auto flow = reference_of(expression_flow({"-1", "sqrt(x)", "0"}, cube(1)));
  const ReferenceLine line = trace_line(*flow, dvec3(0.5, 0, 0), {.time = 10});
  EXPECT_EQ(line.end, FlowStatus::undefined);
  EXPECT_NEAR(line.points.back().time, 0.5, 1e-9);
  // y' = sqrt(x): up to 2/3 0.5^1.5. The root's slope is infinite at the end, where steps are shortest.
  EXPECT_NEAR(line.points.back().position.y, 2.0 / 3 * std::pow(0.5, 1.5), 1e-9);
  EXPECT_EQ(trace_line(*flow, dvec3(-0.5, 0, 0), {.time = 1}).end, FlowStatus::undefined);
  EXPECT_EQ(trace_line(*flow, dvec3(-0.5, 0, 0), {.time = 1}).points.size(), 1u);
}

TEST(ReferenceFlow, EndsAtSpeedsLengthsAndSteps) {
  const auto sink = reference_of(expression_flow({"-x", "-y", "-z"}, cube(2)));
  const dvec3 seed(1, 0.5, -0.25);
  ReferenceLine line = trace_line(*sink, seed, {.time = 100, .stagnation = 1e-3});
  EXPECT_EQ(line.end, FlowStatus::stagnation);
  EXPECT_NEAR(line.points.back().time, std::log(glm::length(seed) / 1e-3), 1e-8);
  // Arc length.
  const auto helix = reference_of(expression_flow({"-y", "x", "0.3"}, cube(4)));
  line = trace_line(*helix, dvec3(1, 0, 0), {.time = 100, .length = 5});
  EXPECT_EQ(line.end, FlowStatus::length);
  EXPECT_NEAR(line.points.back().time, 5 / std::sqrt(1.09), 1e-11);
  // Steps.
  line = trace_line(*helix, dvec3(1, 0, 0), {.time = 10, .most_steps = 3});
  EXPECT_EQ(line.end, FlowStatus::steps);
  EXPECT_EQ(line.steps.size(), 3u);
  // A field that is 0.
  EXPECT_EQ(trace_line(*reference_of(expression_flow({"0", "0", "0"}, cube(1))), dvec3(0.0), {}).end,
            FlowStatus::stagnation);
}

TEST(ReferenceFlow, WhatIsKept) {
  const VectorField field = expression_flow({"-y", "x", "0.3"}, cube(3));
  const auto queries = trace_by_reference(field.model());
  const FlowSeeds seeds{{dvec3(1, 0, 0), dvec3(0, 0, 2.9), dvec3(9, 0, 0)}};
  TraceOptions options{.time = 1, .both = true, .interval = 0.25, .stagnation = 1e-6};
  Streamlines lines = queries->trace(seeds, options);
  ASSERT_EQ(lines.size(), 3u);
  // -1, -0.75, ..., 1: the seed once.
  ASSERT_EQ(lines.offsets[1], 9u);
  for (std::size_t i = 0; i < 9; i++) {
    const double t = -1 + 0.25 * double(i);
    EXPECT_FLOAT_EQ(lines.times[i], float(t));
    EXPECT_LT(glm::length(dvec3(lines.positions[i]) - dvec3(std::cos(t), std::sin(t), 0.3 * t)), 2e-7);
  }
  EXPECT_EQ(lines.end[0], FlowStatus::time);
  EXPECT_EQ(lines.beginning[0], FlowStatus::time);
  // The second leaves at z = 3, a third after its seed.
  EXPECT_EQ(lines.end[1], FlowStatus::domain);
  EXPECT_EQ(lines.beginning[1], FlowStatus::time);
  EXPECT_EQ(lines.offsets[2] - lines.offsets[1], 7u);
  EXPECT_NEAR(lines.times[lines.offsets[2] - 1], 1.0 / 3, 1e-6);
  // The third is outside.
  EXPECT_EQ(lines.end[2], FlowStatus::domain);
  EXPECT_EQ(lines.offsets[3] - lines.offsets[2], 1u);
  EXPECT_EQ(lines.positions[lines.offsets[2]], glm::vec3(9, 0, 0));

  options.both = false;
  options.integrator = Integrator::rk4;
  options.interval = 0;
  options.step = 0.125;
  lines = queries->trace({{dvec3(1, 0, 0)}}, options);
  ASSERT_EQ(lines.positions.size(), 9u);
  EXPECT_FLOAT_EQ(lines.times[3], 0.375f);
  options.most_steps = 3;
  lines = queries->trace({{dvec3(1, 0, 0)}}, options);
  EXPECT_EQ(lines.positions.size(), 4u);
  EXPECT_EQ(lines.end[0], FlowStatus::steps);
  options.most_steps = 1000;
  options.ends_only = true;
  lines = queries->trace({{dvec3(1, 0, 0)}}, options);
  EXPECT_EQ(lines.positions.size(), 2u);
}

TEST(ReferenceFlow, DerivativesByDifferences) {
  // By hand: v = (sin(x y), z² x, exp(y) - z).
  const auto flow = reference_of(expression_flow({"sin(x*y)", "z^2*x", "exp(y) - z"}, cube(2)));
  for (const dvec3& p : {dvec3(0.3, -0.7, 1.1), dvec3(-1.9, 1.5, 0.2), dvec3(2, 2, -2)}) {
    const ReferenceFlow::Value at = flow->at(p, 0);
    ASSERT_EQ(at.place.status, FlowStatus::inside);
    const double c = std::cos(p.x * p.y), s = std::sin(p.x * p.y);
    const glm::dmat3 jacobian(p.y * c, p.z * p.z, 0, p.x * c, 0, std::exp(p.y), 0, 2 * p.z * p.x, -1);
    const glm::dmat3 found = flow->jacobian(at.place, p);
    for (int column = 0; column < 3; column++)
      EXPECT_LT(glm::length(found[column] - jacobian[column]), 1e-10) << column;
    const std::array<dvec3, 6> hessian{{{-p.y * p.y * s, 0, 0},
                                        {-p.x * p.x * s, 0, std::exp(p.y)},
                                        {0, 2 * p.x, 0},
                                        {c - p.x * p.y * s, 0, 0},
                                        {0, 2 * p.z, 0},
                                        {0, 0, 0}}};
    const std::array<dvec3, 6> second = flow->hessian(at.place, p);
    for (std::size_t k = 0; k < 6; k++) EXPECT_LT(glm::length(second[k] - hessian[k]), 2e-8) << k;
  }
}

}  // namespace
}  // namespace smurf::test
