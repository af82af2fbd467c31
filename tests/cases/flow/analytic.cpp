// Streamlines of expressions on every device and by the reference, against closed forms: positions and their variation,
// the integrators' orders, error control, invariants, samples.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "smurf/flow.hpp"
#include "truth/flow/flows.hpp"

namespace smurf::test {

KERNELS(trace_lines, sample_flow);

namespace {

using glm::dvec3;

constexpr double extent = 8;          // of the domains of known_flows()
constexpr double rounding = 0x1p-24;  // of a float
const dvec3 tangent(0.6, -0.8, 0.5), second_tangent(0.4, 0.3, -1.1);

std::vector<TestDevice> all_devices() {
  std::vector<TestDevice> devices = test_devices();
  devices.push_back({"reference", "reference", 0, false, reference_device()});
  return devices;
}

FlowSeeds seeds_of(const FlowTruth& truth) {
  FlowSeeds seeds{truth.seeds};
  seeds.tangents.assign(truth.seeds.size(), tangent);
  seeds.second_tangents.assign(truth.seeds.size(), second_tangent);
  return seeds;
}

// How much a flow enlarges an error on the way to a time, and what it makes of the variation's: the greatest of the
// derivatives by x, y and z on the way, and of the second ones.
double growth_of(const FlowTruth& truth, double time) {
  double most = 1;
  for (const dvec3& seed : truth.seeds) {
    for (int i = 1; i <= 16; i++) {
      double sum = 0;
      for (int axis = 0; axis < 3; axis++) {
        dvec3 unit(0.0);
        unit[axis] = 1;
        const FlowPosition at = truth.at(seed, unit, dvec3(0), time * i / 16);
        sum += glm::dot(at.first, at.first);
      }
      most = std::max(most, std::sqrt(sum));
    }
  }
  return most;
}

struct Errors {
  double position = 0, first = 0, second = 0;
  double size = 1;  // of positions
};

// The greatest, of all that is kept.
Errors errors_of(const Streamlines& lines, const FlowTruth& truth) {
  Errors errors;
  for (std::size_t i = 0; i < lines.size(); i++) {
    for (std::size_t k = lines.offsets[i]; k < lines.offsets[i + 1]; k++) {
      const FlowPosition known = truth.at(truth.seeds[i], tangent, second_tangent, lines.times[k]);
      // The time is rounded as well.
      const double late = 2 * rounding * std::abs(lines.times[k]);
      const auto off = [](const glm::vec3& a, const dvec3& b) { return glm::length(dvec3(a) - b); };
      errors.position = std::max(
          errors.position, off(lines.positions[k], known.position) - late * glm::length(truth.value(known.position)));
      errors.size = std::max(errors.size, glm::length(known.position));
      if (!lines.first.empty())
        errors.first = std::max(errors.first, off(lines.first[k], known.first) / (1 + glm::length(known.first)));
      if (!lines.second.empty())
        errors.second = std::max(errors.second, off(lines.second[k], known.second) / (1 + glm::length(known.second)));
    }
  }
  return errors;
}

TEST(FlowsWithClosedForms, PositionsAndVariation) {
  for (const FlowTruth& truth : known_flows()) {
    const double growth = std::max(growth_of(truth, truth.time), growth_of(truth, -truth.time));
    for (TestDevice& device : all_devices()) {
      const Tracer tracer(device.device, truth.field());
      for (const double time : {truth.time, -truth.time}) {
        for (const double interval : {0.0, std::abs(time) / 7}) {
          constexpr double tolerance = 1e-6;
          const Streamlines lines = tracer.trace(
              seeds_of(truth), {.time = time, .tolerance = tolerance, .interval = interval, .variation = 2});
          ASSERT_EQ(lines.size(), truth.seeds.size());
          for (std::size_t i = 0; i < lines.size(); i++) {
            EXPECT_EQ(lines.end[i], FlowStatus::time) << truth.name << " on " << device.label;
            EXPECT_EQ(lines.times[lines.offsets[i]], 0.0f);
            EXPECT_EQ(lines.times[lines.offsets[i + 1] - 1], float(time));
            if (interval > 0) {
              EXPECT_EQ(lines.offsets[i + 1] - lines.offsets[i], 8u) << truth.name << device.label;
            }
          }
          const Errors errors = errors_of(lines, truth);
          // Each step errs by the tolerance at most, and by a few roundings; the flow enlarges what is there. The dense
          // output between steps is of order 4, and errs by as much again.
          const double steps = double(lines.steps) / double(lines.size());
          const double bound = growth * steps * (2 * tolerance + 4 * rounding * errors.size);
          EXPECT_LT(errors.position, bound) << truth.name << " on " << device.label << ", " << steps << " steps";
          // Of the variation the tolerance is relative, a part of the extent; second derivatives have none of their
          // own, and in nonlinear flows sum up products of first ones.
          EXPECT_LT(errors.first, growth * bound) << truth.name << " on " << device.label;
          EXPECT_LT(errors.second, growth * growth * growth * bound) << truth.name << " on " << device.label;
        }
      }
    }
  }
}

// Of a rotation with radius 1, in a domain so large that nothing but the tolerance limits steps.
FlowTruth turning() {
  FlowTruth truth = linear_flows()[0];
  truth.domain = {dvec3(-200), dvec3(200)};
  truth.seeds = {dvec3(1, 0, 0)};
  return truth;
}

TEST(FlowsWithClosedForms, OrderOfTheClassicMethod) {
  const FlowTruth truth = turning();
  for (TestDevice& device : test_devices()) {
    const Tracer tracer(device.device, truth.field());
    const auto error = [&](double step) {
      return errors_of(tracer.trace({truth.seeds}, {.time = 8, .integrator = Integrator::rk4, .step = step}), truth)
          .position;
    };
    // 8 h⁴ / 120, which is 4e-3 and 3e-4: far above the rounding of floats.
    const double coarse = error(0.5), fine = error(0.25);
    EXPECT_NEAR(std::log2(coarse / fine), 4, 0.3) << device.label << ": " << coarse << ", " << fine;
    EXPECT_NEAR(coarse, 8 * 0.0625 / 120, 2e-3) << device.label;
  }
}

TEST(FlowsWithClosedForms, OrderAndErrorControlOfDormandAndPrince) {
  const FlowTruth truth = turning();
  for (TestDevice& device : test_devices()) {
    const Tracer tracer(device.device, truth.field());
    std::vector<std::pair<double, double>> found;  // steps, error
    for (const double tolerance : {1e-2, 1e-3, 1e-4, 1e-5}) {
      const Streamlines lines = tracer.trace({truth.seeds}, {.time = 60, .tolerance = tolerance, .ends_only = true});
      ASSERT_EQ(lines.positions.size(), 2u);
      found.emplace_back(double(lines.steps), errors_of(lines, truth).position);
      // Steps that err by the tolerance each, in a flow that keeps errors.
      EXPECT_LT(found.back().second, double(lines.steps) * tolerance) << device.label;
    }
    for (std::size_t i = 1; i < found.size(); i++)
      EXPECT_LT(found[i].second, 0.5 * found[i - 1].second) << device.label << " at " << found[i].first << " steps";
    // The error over the whole time falls with the fifth power of the steps' length.
    const double order =
        std::log(found.front().second / found.back().second) / std::log(found.back().first / found.front().first);
    EXPECT_GT(order, 4.5) << device.label;
    EXPECT_LT(order, 6.5) << device.label;
  }
}

TEST(FlowsWithClosedForms, InvariantsStay) {
  for (const FlowInvariant& flow : invariant_flows()) {
    for (TestDevice& device : all_devices()) {
      const Tracer tracer(device.device, flow.field());
      const Streamlines lines =
          tracer.trace({flow.seeds}, {.time = flow.time, .tolerance = 1e-6, .interval = flow.time / 50});
      for (std::size_t i = 0; i < lines.size(); i++) {
        ASSERT_GT(lines.offsets[i + 1] - lines.offsets[i], 20u) << flow.name << " on " << device.label;
        for (std::size_t k = lines.offsets[i]; k < lines.offsets[i + 1]; k++) {
          // Some hundred steps of 1e-6, by gradients of up to 2, near a stagnation point enlarged a few times.
          EXPECT_NEAR(flow.constant(dvec3(lines.positions[k])), flow.constant(flow.seeds[i]), 1e-4)
              << flow.name << " on " << device.label;
        }
      }
    }
  }
}

TEST(FlowsWithClosedForms, AbcFlowAsTheReference) {
  const AbcFlow abc;
  const VectorField field = expression_flow(abc.vector, abc.domain);
  FlowSeeds seeds;
  for (int i = 0; i < 50; i++) {
    seeds.positions.emplace_back(std::sin(1.7 * i), 2 * std::cos(2.3 * i), std::sin(0.6 * i + 1));
    seeds.tangents.push_back(tangent);
    seeds.second_tangents.push_back(second_tangent);
  }
  const TraceOptions options{.time = 2, .tolerance = 1e-6, .interval = 0.5, .variation = 2};
  const Streamlines known = Tracer(reference_device(), field).trace(seeds, options);
  for (TestDevice& device : test_devices()) {
    const Streamlines lines = Tracer(device.device, field).trace(seeds, options);
    ASSERT_EQ(lines.positions.size(), known.positions.size()) << device.label;
    for (std::size_t k = 0; k < known.positions.size(); k++) {
      EXPECT_EQ(lines.times[k], known.times[k]);
      const double size = 1 + glm::length(known.first[k]) / glm::length(tangent);
      // Steps of 1e-6, some twenty; the flow enlarges what is there as it does tangents.
      EXPECT_LT(glm::length(lines.positions[k] - known.positions[k]), 5e-5 * size) << device.label;
      EXPECT_LT(glm::length(lines.first[k] - known.first[k]), 5e-5 * size * size) << device.label;
      EXPECT_LT(glm::length(lines.second[k] - known.second[k]), 5e-5 * size * size * size) << device.label;
    }
  }
}

TEST(FlowsWithClosedForms, Samples) {
  // v = (sin(x y), z² x, exp(y) - z) and its derivatives, by hand.
  const VectorField field = expression_flow({"sin(x*y)", "z^2*x", "exp(y) - z"}, {dvec3(-2), dvec3(2)});
  std::vector<glm::vec3> points{{3, 0, 0}, {2, 2, -2}};
  for (int i = 0; i < 40; i++)
    points.emplace_back(2 * std::sin(1.3 * i), 2 * std::cos(0.7 * i), 2 * std::sin(2.9 * i + 1));
  for (TestDevice& device : all_devices()) {
    const FlowSamples samples = Tracer(device.device, field).sample(points, 2);
    EXPECT_EQ(samples.status[0], FlowStatus::domain) << device.label;
    EXPECT_TRUE(std::isnan(samples.value[0].x)) << device.label;
    for (std::size_t i = 1; i < points.size(); i++) {
      const dvec3 p(points[i]);
      ASSERT_EQ(samples.status[i], FlowStatus::inside) << device.label;
      EXPECT_EQ(samples.cell[i], -1);
      const double c = std::cos(p.x * p.y), s = std::sin(p.x * p.y);
      const auto same = [&](const glm::vec3& found, const dvec3& known) {
        // A dozen operations on numbers of up to 8.
        EXPECT_LT(glm::length(dvec3(found) - known), 1e-5) << device.label << " at " << p.x << " " << p.y << " " << p.z;
      };
      same(samples.value[i], {s, p.z * p.z * p.x, std::exp(p.y) - p.z});
      same(samples.jacobian[i][0], {p.y * c, p.z * p.z, 0});
      same(samples.jacobian[i][1], {p.x * c, 0, std::exp(p.y)});
      same(samples.jacobian[i][2], {0, 2 * p.z * p.x, -1});
      const std::array<dvec3, 6> hessian{{{-p.y * p.y * s, 0, 0},
                                          {-p.x * p.x * s, 0, std::exp(p.y)},
                                          {0, 2 * p.x, 0},
                                          {c - p.x * p.y * s, 0, 0},
                                          {0, 2 * p.z, 0},
                                          {0, 0, 0}}};
      for (std::size_t k = 0; k < 6; k++) same(samples.hessian[i][k], hessian[k]);
    }
  }
}

}  // namespace
}  // namespace smurf::test
