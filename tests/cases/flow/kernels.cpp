// First light; replaced by the cases of this folder.
#include <gtest/gtest.h>

#include "harness/devices.hpp"
#include "harness/kernel_cover.hpp"
#include "smurf/flow.hpp"

namespace smurf::test {

KERNELS(trace_lines, sample_flow);

TEST(Flows, RotationOnEveryDevice) {
  const VectorField field = expression_flow({"-y", "x", "0.3"}, {glm::dvec3(-3), glm::dvec3(3)});
  for (TestDevice& device : test_devices()) {
    for (const Integrator integrator : {Integrator::rk4, Integrator::dormand_prince}) {
      const Tracer tracer(device.device, field);
      FlowSeeds seeds;
      for (int i = 0; i < 37; i++) {
        seeds.positions.emplace_back(0.2 + 0.05 * i, 0.0, 0.0);
        seeds.tangents.emplace_back(1.0, 0.0, 0.0);
      }
      const Streamlines lines =
          tracer.trace(seeds, {.time = 6.0, .integrator = integrator, .step = 0.05, .variation = 2});
      ASSERT_EQ(lines.size(), seeds.positions.size());
      double worst = 0;
      for (std::size_t i = 0; i < lines.size(); i++) {
        EXPECT_EQ(lines.end[i], FlowStatus::time) << name_of(lines.end[i]);
        for (std::size_t k = lines.offsets[i]; k < lines.offsets[i + 1]; k++) {
          const double t = lines.times[k], r = seeds.positions[i].x;
          worst = std::max(worst, glm::length(glm::dvec3(lines.positions[k]) -
                                              glm::dvec3(r * std::cos(t), r * std::sin(t), 0.3 * t)));
          worst = std::max(worst, glm::length(glm::dvec3(lines.first[k]) - glm::dvec3(std::cos(t), std::sin(t), 0)));
        }
      }
      std::printf("%s %d: worst %g, %zu positions, %zu steps\n", device.label.c_str(), int(integrator), worst,
                  lines.positions.size(), std::size_t(lines.steps));
      EXPECT_LT(worst, 2e-5);
    }
  }
}

}  // namespace smurf::test
