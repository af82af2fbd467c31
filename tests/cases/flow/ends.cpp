// Why and where streamlines end, on every device and by the reference; what is kept of them; seeds outside; the same
// bits again.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/refusal.hpp"
#include "smurf/flow.hpp"

namespace smurf::test {

KERNELS(trace_lines, sample_flow);

namespace {

using glm::dvec3;

Domain cube(double half) { return {dvec3(-half), dvec3(half)}; }

std::vector<TestDevice> all_devices() {
  std::vector<TestDevice> devices = test_devices();
  devices.push_back({"reference", "reference", 0, false, reference_device()});
  return devices;
}

constexpr Integrator integrators[] = {Integrator::rk4, Integrator::dormand_prince};

std::size_t last_of(const Streamlines& lines, std::size_t line) { return lines.offsets[line + 1] - 1; }
std::size_t rows_of(const Streamlines& lines, std::size_t line) {
  return lines.offsets[line + 1] - lines.offsets[line];
}

// Runs on every device with both integrators.
template <class Check>
void on_all(const VectorField& field, const Check& check) {
  for (TestDevice& device : all_devices()) {
    const Tracer tracer(device.device, field);
    for (const Integrator integrator : integrators) {
      SCOPED_TRACE(device.label + (integrator == Integrator::rk4 ? ", rk4" : ", dormand_prince"));
      check(tracer, integrator);
    }
  }
}

TEST(FlowEnds, Domain) {
  // x grows by 1 and y by 1/4 a unit of time: x = 1 is met first from the first seed, y = 1 from the second.
  on_all(expression_flow({"1", "0.25", "0"}, cube(1)), [](const Tracer& tracer, Integrator integrator) {
    const FlowSeeds seeds{{dvec3(-0.5, 0, 0.2), dvec3(0, 0.9, 0.2), dvec3(1, 0, 0)}};
    const Streamlines lines = tracer.trace(seeds, {.time = 10, .integrator = integrator});
    for (std::size_t i = 0; i < 3; i++) EXPECT_EQ(lines.end[i], FlowStatus::domain);
    // To the rounding of floats: the last step is halved until it is that short.
    EXPECT_NEAR(lines.times[last_of(lines, 0)], 1.5, 2e-6);
    EXPECT_LT(glm::length(lines.positions[last_of(lines, 0)] - glm::vec3(1, 0.375, 0.2)), 2e-6f);
    EXPECT_LT(glm::length(lines.positions[last_of(lines, 1)] - glm::vec3(0.4, 1, 0.2)), 2e-6f);
    EXPECT_LT(glm::length(lines.positions[last_of(lines, 2)] - glm::vec3(1, 0, 0)), 1e-6f);
    for (std::size_t k = 0; k < lines.positions.size(); k++) EXPECT_LE(lines.positions[k].x, 1.0f);
    // Back, the other way.
    const Streamlines back = tracer.trace(seeds, {.time = -10, .integrator = integrator});
    EXPECT_EQ(back.end[0], FlowStatus::domain);
    EXPECT_NEAR(back.times[last_of(back, 0)], -0.5, 2e-6);
    EXPECT_LT(glm::length(back.positions[last_of(back, 0)] - glm::vec3(-1, -0.125, 0.2)), 2e-6f);
  });
}

TEST(FlowEnds, Ball) {
  Domain ball = cube(1);
  ball.radius = 0.75;
  on_all(expression_flow({"1", "0", "0"}, ball), [](const Tracer& tracer, Integrator integrator) {
    const Streamlines lines =
        tracer.trace({{dvec3(0, 0.25, 0), dvec3(0.7, 0.7, 0)}}, {.time = 9, .integrator = integrator});
    EXPECT_EQ(lines.end[0], FlowStatus::domain);
    EXPECT_NEAR(lines.positions[last_of(lines, 0)].x, std::sqrt(0.5), 2e-6);
    EXPECT_EQ(lines.end[1], FlowStatus::domain);
    EXPECT_EQ(rows_of(lines, 1), 1u);
  });
}

TEST(FlowEnds, Undefined) {
  on_all(expression_flow({"-1", "sqrt(x)", "0"}, cube(1)), [](const Tracer& tracer, Integrator integrator) {
    const Streamlines lines =
        tracer.trace({{dvec3(0.5, 0, 0), dvec3(-0.5, 0, 0)}}, {.time = 10, .integrator = integrator});
    EXPECT_EQ(lines.end[0], FlowStatus::undefined);
    EXPECT_NEAR(lines.positions[last_of(lines, 0)].x, 0, 2e-6);
    EXPECT_EQ(lines.end[1], FlowStatus::undefined);
    EXPECT_EQ(rows_of(lines, 1), 1u);
  });
}

TEST(FlowEnds, Stagnation) {
  on_all(expression_flow({"-x", "-y", "-z"}, cube(2)), [](const Tracer& tracer, Integrator integrator) {
    const dvec3 seed(1, 0.5, -0.25);
    const double stagnation = 1e-3, known = std::log(glm::length(seed) / stagnation);
    const Streamlines lines =
        tracer.trace({{seed}}, {.time = 100, .integrator = integrator, .step = 0.05, .stagnation = stagnation});
    ASSERT_EQ(lines.end[0], FlowStatus::stagnation);
    // At the end of a step: not before the speed is that low, and no more than a step after it.
    const double time = lines.times[last_of(lines, 0)];
    EXPECT_GT(time, known - 1e-2);
    EXPECT_LT(glm::length(lines.positions[last_of(lines, 0)]), stagnation * (1 + 1e-5));
    if (integrator == Integrator::rk4) {
      EXPECT_LT(time, known + 0.05);
    }
    // By default: a millionth of the greatest speed.
    EXPECT_EQ(tracer.trace({{seed}}, {.time = 1000, .integrator = integrator, .step = 0.05}).end[0],
              FlowStatus::stagnation);
  });
}

TEST(FlowEnds, LengthStepsAndTime) {
  on_all(expression_flow({"-y", "x", "0.3"}, cube(4)), [](const Tracer& tracer, Integrator integrator) {
    const FlowSeeds seeds{{dvec3(1, 0, 0)}};
    const double speed = std::sqrt(1.09);
    Streamlines lines = tracer.trace(seeds, {.time = 8, .integrator = integrator, .length = 5});
    EXPECT_EQ(lines.end[0], FlowStatus::length);
    EXPECT_NEAR(lines.times[last_of(lines, 0)], 5 / speed, 2e-5);
    // Longer than the line gets in its time.
    lines = tracer.trace(seeds, {.time = 8, .integrator = integrator, .length = 50});
    EXPECT_EQ(lines.end[0], FlowStatus::time);
    lines = tracer.trace(seeds, {.time = 8, .integrator = integrator, .step = 0.25, .most_steps = 3});
    EXPECT_EQ(lines.end[0], FlowStatus::steps);
    EXPECT_EQ(rows_of(lines, 0), 4u);
    if (integrator == Integrator::rk4) {
      EXPECT_FLOAT_EQ(lines.times[3], 0.75f);
    }
    // As many as are needed.
    lines = tracer.trace(seeds, {.time = 0.75, .integrator = Integrator::rk4, .step = 0.25, .most_steps = 3});
    EXPECT_EQ(lines.end[0], FlowStatus::time);
  });
}

TEST(FlowEnds, BothWaysWithTheSeedOnce) {
  // It leaves at z = 3 after a third, and goes on the other way.
  on_all(expression_flow({"-y", "x", "0.3"}, cube(3)), [](const Tracer& tracer, Integrator integrator) {
    const FlowSeeds seeds{{dvec3(1, 0, 0), dvec3(0.5, 0, 2.9), dvec3(9, 0, 0)}, std::vector<dvec3>(3, dvec3(1, 0, 0))};
    const TraceOptions options{
        .time = 1, .both = true, .integrator = integrator, .step = 0.05, .interval = 0.25, .variation = 1};
    const Streamlines lines = tracer.trace(seeds, options);
    ASSERT_EQ(lines.size(), 3u);
    ASSERT_EQ(rows_of(lines, 0), 9u);
    for (std::size_t k = 0; k < 9; k++) {
      const double t = -1 + 0.25 * double(k);
      EXPECT_FLOAT_EQ(lines.times[k], float(t));
      EXPECT_LT(glm::length(dvec3(lines.positions[k]) - dvec3(std::cos(t), std::sin(t), 0.3 * t)), 3e-5);
      EXPECT_LT(glm::length(dvec3(lines.first[k]) - dvec3(std::cos(t), std::sin(t), 0)), 3e-5);
    }
    EXPECT_EQ(lines.positions[4], glm::vec3(1, 0, 0));
    EXPECT_EQ(lines.beginning[0], FlowStatus::time);
    EXPECT_EQ(lines.end[0], FlowStatus::time);
    EXPECT_EQ(lines.beginning[1], FlowStatus::time);
    EXPECT_EQ(lines.end[1], FlowStatus::domain);
    ASSERT_EQ(rows_of(lines, 1), 7u);
    EXPECT_NEAR(lines.times[last_of(lines, 1)], 1.0 / 3, 5e-6);
    EXPECT_EQ(lines.end[2], FlowStatus::domain);
    EXPECT_EQ(lines.beginning[2], FlowStatus::domain);
    EXPECT_EQ(rows_of(lines, 2), 1u);
    EXPECT_EQ(lines.positions[last_of(lines, 2)], glm::vec3(9, 0, 0));
    for (std::size_t i = 0; i < 3; i++)
      for (std::size_t k = lines.offsets[i] + 1; k < lines.offsets[i + 1]; k++)
        EXPECT_LT(lines.times[k - 1], lines.times[k]);
    // A time that is negative says no more than one that is positive.
    TraceOptions negative = options;
    negative.time = -1;
    const Streamlines same = tracer.trace(seeds, negative);
    EXPECT_EQ(same.times, lines.times);
    EXPECT_EQ(same.positions, lines.positions);
    EXPECT_EQ(same.end, lines.end);
  });
}

TEST(FlowEnds, EndsOnly) {
  on_all(expression_flow({"-y", "x", "0.3"}, cube(3)), [](const Tracer& tracer, Integrator integrator) {
    const FlowSeeds seeds{{dvec3(1, 0, 0), dvec3(0.5, 0, 2.9), dvec3(9, 0, 0)}};
    TraceOptions options{.time = 2, .integrator = integrator, .ends_only = true};
    Streamlines lines = tracer.trace(seeds, options);
    ASSERT_EQ(lines.positions.size(), 5u);
    EXPECT_EQ(lines.positions[0], glm::vec3(1, 0, 0));
    EXPECT_LT(glm::length(dvec3(lines.positions[1]) - dvec3(std::cos(2), std::sin(2), 0.6)), 3e-5);
    EXPECT_NEAR(lines.positions[3].z, 3, 2e-6);
    options.both = true;
    lines = tracer.trace(seeds, options);
    EXPECT_EQ(lines.times[lines.offsets[0]], -2.0f);
    EXPECT_EQ(lines.times[last_of(lines, 0)], 2.0f);
  });
}

TEST(FlowEnds, SeedsOutsideAndFieldsThatAreZero) {
  const VectorField zero = expression_flow({"0", "0*x", "0"}, cube(1));
  const VectorField half = expression_flow({"max(x, 0)", "0", "0"}, cube(1));
  const VectorField turn = expression_flow({"-y", "x", "0"}, cube(1));
  for (TestDevice& device : all_devices()) {
    SCOPED_TRACE(device.label);
    const FlowSeeds outside{{dvec3(2, 0, 0), dvec3(0, -3, 0)}};
    EXPECT_NE(refusal(ErrorCode::input, [&] { Tracer(device.device, turn).trace(outside); }).find("outside"),
              std::string::npos);
    EXPECT_NE(refusal(ErrorCode::input, [&] { Tracer(device.device, zero).trace({{dvec3(0)}}); }).find("zero"),
              std::string::npos);
    refusal(ErrorCode::input, [&] { Tracer(device.device, turn).trace({}); });
    refusal(ErrorCode::input, [&] { Tracer(device.device, turn).trace({{dvec3(NAN, 0, 0)}}); });
    refusal(ErrorCode::usage, [&] { Tracer(device.device, turn).trace({{dvec3(0.5, 0, 0)}}, {.variation = 1}); });
    // Zero at one seed only.
    const Streamlines lines = Tracer(device.device, half).trace({{dvec3(-0.5, 0, 0), dvec3(0.5, 0, 0)}}, {.time = 0.5});
    EXPECT_EQ(lines.end[0], FlowStatus::stagnation);
    EXPECT_EQ(rows_of(lines, 0), 1u);
    EXPECT_EQ(lines.end[1], FlowStatus::time);
    EXPECT_NEAR(lines.positions[last_of(lines, 1)].x, 0.5 * std::exp(0.5), 1e-5);
  }
}

template <class T>
bool same_bits(const T* a, const T* b, std::size_t count) {
  return std::memcmp(a, b, count * sizeof(T)) == 0;
}

TEST(FlowEnds, TheSameBitsForAnyBatch) {
  const VectorField field = expression_flow({"sin(y) + 0.3*z", "cos(x)*0.8", "0.2*x*y"}, cube(2));
  FlowSeeds seeds;
  for (int i = 0; i < 201; i++) {
    seeds.positions.emplace_back(1.9 * std::sin(1.7 * i), 1.9 * std::cos(2.3 * i), 1.5 * std::sin(0.6 * i + 1));
    seeds.tangents.emplace_back(1, 0.5, 0);
  }
  for (TestDevice& device : all_devices()) {
    SCOPED_TRACE(device.label);
    const Tracer tracer(device.device, field);
    for (const double interval : {0.0, 0.1}) {
      const TraceOptions options{.time = 8, .both = true, .interval = interval, .stagnation = 1e-6, .variation = 1};
      const Streamlines lines = tracer.trace(seeds, options), again = tracer.trace(seeds, options);
      ASSERT_EQ(lines.offsets, again.offsets);
      EXPECT_TRUE(same_bits(lines.positions.data(), again.positions.data(), lines.positions.size()));
      EXPECT_TRUE(same_bits(lines.times.data(), again.times.data(), lines.times.size()));
      EXPECT_TRUE(same_bits(lines.first.data(), again.first.data(), lines.first.size()));
      for (const std::size_t i : {0, 5, 77, 200}) {
        const Streamlines one = tracer.trace({{seeds.positions[i]}, {seeds.tangents[i]}}, options);
        ASSERT_EQ(rows_of(one, 0), rows_of(lines, i)) << i;
        const std::size_t from = lines.offsets[i];
        EXPECT_TRUE(same_bits(one.positions.data(), lines.positions.data() + from, one.positions.size())) << i;
        EXPECT_TRUE(same_bits(one.first.data(), lines.first.data() + from, one.first.size())) << i;
        EXPECT_EQ(one.end[0], lines.end[i]);
      }
    }
  }
}

}  // namespace
}  // namespace smurf::test
