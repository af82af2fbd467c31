// Comparison of reconstructions on every device: a device's answers have the errors of the reconstruction, which the
// reference knows, and not its own.
#include <gtest/gtest.h>

#include <string>

#include "harness/devices.hpp"
#include "smurf/compare.hpp"

namespace smurf::test {
namespace {

TEST(Comparison, ErrorsAreThoseOfTheReconstructionOnEveryDevice) {
  const Surface gyroid =
      implicit("sin(6*x)*cos(6*y)+sin(6*y)*cos(6*z)+sin(6*z)*cos(6*x)", {glm::dvec3(-1), glm::dvec3(1), 0});
  const CompareOptions options{.resolutions = {16, 32}, .rays = 150};
  const Comparison truth = compare(reference_device(), gyroid, options);
  for (TestDevice& device : one_of_each()) {
    const Comparison comparison = compare(device.device, gyroid, options);
    ASSERT_EQ(comparison.rows.size(), truth.rows.size());
    EXPECT_EQ(comparison.points, truth.points);
    for (std::size_t i = 0; i < truth.rows.size(); i++) {
      const ComparisonRow &row = comparison.rows[i], &expected = truth.rows[i];
      SCOPED_TRACE(device.label + ", " + std::string(name_of(row.reconstruction)) + " at " +
                   std::to_string(row.resolution));
      EXPECT_EQ(row.lost, expected.lost);
      EXPECT_EQ(row.missed + row.invented + row.undecided, expected.missed + expected.invented + expected.undecided);
      // The least of these errors is 2e-6, a distance; the rounding of device floats is a hundredth of that.
      EXPECT_NEAR(row.location.rms, expected.location.rms, 0.02 * expected.location.rms);
      EXPECT_NEAR(row.normal.rms, expected.normal.rms, 0.02 * expected.normal.rms);
      EXPECT_NEAR(row.mean.rms, expected.mean.rms, 0.02 * expected.mean.rms);
      EXPECT_NEAR(row.gauss.rms, expected.gauss.rms, 0.02 * expected.gauss.rms);
    }
  }
}

}  // namespace
}  // namespace smurf::test
