// Stream surfaces that cannot be: each is refused in one line, by the call that can tell first.
#include "smurf/stream.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "harness/devices.hpp"
#include "harness/files/test_files.hpp"
#include "harness/refusal.hpp"
#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf::test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

VectorField rotation() { return expression_flow({"-y", "x", "0.3"}, {glm::dvec3(-3), glm::dvec3(3)}); }
SeedLine segment() { return seed_expression({"u", "0", "0"}, {0.2, 1.2}); }

TEST(StreamInput, TimesMustBeAFiniteRange) {
  for (const glm::dvec2 time : {glm::dvec2(0, 0), glm::dvec2(2, 1), glm::dvec2(0, nan), glm::dvec2(-HUGE_VAL, 1),
                                glm::dvec2(0, 1e300), glm::dvec2(1, 1 + 1e-12)})
    EXPECT_REFUSED(stream_surface(rotation(), segment(), {.time = time}), "time");
}

TEST(StreamInput, TolerancesMustNotBeNegative) {
  for (const double tolerance : {-1e-5, nan, HUGE_VAL})
    EXPECT_REFUSED(stream_surface(rotation(), segment(), {.tolerance = tolerance}), "tolerance");
}

TEST(StreamInput, SeedsMustBeCurves) {
  EXPECT_REFUSED(seed_points({}), "two");
  EXPECT_REFUSED(seed_points({{1, 0, 0}}), "two");
  EXPECT_REFUSED(seed_points({{1, 0, 0}, {1, 0, 0}}), "same");
  EXPECT_REFUSED(seed_points({{1, 0, 0}, {nan, 0, 0}}), "finite");
  EXPECT_REFUSED(seed_expression({"1", "2", "3"}, {0, 1}), "point");
}

// What only the field tells, by who traces first: bounds, and the reference's own samples.
class StreamSeedInput : public testing::TestWithParam<bool> {
 protected:
  void expect_refused(const VectorField& field, const SeedLine& seed, const std::string& part) const {
    const Surface surface = stream_surface(field, seed);
    if (GetParam()) {
      EXPECT_REFUSED(Interrogator(open_device("reference"), surface), part);
    } else {
      EXPECT_REFUSED(surface.bounds(), part);
    }
  }
};

TEST_P(StreamSeedInput, OutsideThroughout) {
  expect_refused(rotation(), seed_points({{5, 0, 0}, {6, 0, 0}}), "no place of the curve");
}

TEST_P(StreamSeedInput, AlongTheFlowThroughout) {
  expect_refused(rotation(), seed_points({{0, 0, 0}, {0, 0, 1}}), "along the flow throughout");
  expect_refused(rotation(), seed_expression({"cos(u)", "sin(u)", "0.3*u"}, {0, 2}), "along the flow throughout");
}

TEST_P(StreamSeedInput, WhereNothingMoves) {
  expect_refused(expression_flow({"0*x", "0*y", "0*z"}, {glm::dvec3(-3), glm::dvec3(3)}), segment(), "zero");
}

INSTANTIATE_TEST_SUITE_P(Who, StreamSeedInput, testing::Bool(),
                         [](const testing::TestParamInfo<bool>& who) { return who.param ? "Reference" : "Bounds"; });

// Not an error: the part that is inside has a surface, and what is missing is told.
TEST(StreamInput, SeedsMayBePartlyOutside) {
  const VectorField field = expression_flow({"0", "1", "0"}, {glm::dvec3(-3), glm::dvec3(3)});
  const Surface surface = stream_surface(field, seed_points({{1, 0, 0}, {5, 0, 0}}));
  RayBatch rays(2);
  rays.set(0, {{2, 0.3f, -1}, {0, 0, 1}});
  rays.set(1, {{4, 0.3f, -1}, {0, 0, 1}});
  for (const TestDevice& on : one_of_each()) {
    const HitList hits = Interrogator(on.device, surface).cast(rays, {.hits = Hits::all});
    ASSERT_EQ(hits.size(), 1u) << on.label;
    EXPECT_EQ(hits.rays()[0], 0u) << on.label;
  }
  std::string told;
  for (const Fact& fact : surface.model().facts()) told += fact.value + "\n";
  EXPECT_NE(told.find("leave the field before the time has passed"), std::string::npos) << told;
}

// The members that are wrong, and what the message must tell.
TEST(StreamInput, DescriptionsSayWhatIsWrong) {
  const std::string field = R"("field":{"kind":"expression","vector":["-y","x","0.3"],"domain":[[-3,-3,-3],[3,3,3]]})";
  const std::string seed = R"("seed":{"position":["u","0","0"],"u":[0.2,1.2]})", time = R"("time":[0,1])";
  const auto expect = [&](const std::string& members, const std::string& part) {
    SCOPED_TRACE(members);
    EXPECT_REFUSED(load_surface(put("bad.json", R"({"kind":"stream",)" + members + "}")), part);
  };
  expect(seed + "," + time, "field");
  expect(field + "," + time, "seed");
  expect(field + R"(,"seed":{"points":[[1,0,0]]},)" + time, "two");
  for (const char* bad : {"0", "-1e-3"})
    expect(fmt::format(R"({},{},{},"tolerance":{})", field, seed, time, bad), "tolerance");
  expect(field + "," + seed + "," + time + R"(,"method":"implict")", "method");
  expect(field + "," + seed + "," + time + R"(,"derivatives":"intergrated")", "derivatives");
  for (const char* bad : {"[0,0]", "[2,1]", R"([0,"1/0"])", "[0]", R"("1")"})
    expect(fmt::format(R"({},{},"time":{})", field, seed, bad), "time");
}

// ABC flow stretches; nothing near 1e-12 can be had of it.
TEST(StreamInput, ATolerancePastMemoryIsSaidToBe) {
  const VectorField field =
      expression_flow({"sqrt(3)*sin(z)+cos(y)", "sqrt(2)*sin(x)+sqrt(3)*cos(z)", "sin(y)+sqrt(2)*cos(x)"},
                      {glm::dvec3(-20), glm::dvec3(20)});
  const Surface surface =
      stream_surface(field, seed_expression({"pi+u", "pi", "pi"}, {-2, 2}), {.time = {0, 3}, .tolerance = 1e-12});
  const std::string message = refusal(ErrorCode::memory, [&] { surface.bounds(); });
  EXPECT_NE(message.find("tolerance"), std::string::npos) << message;
  EXPECT_NE(message.find("memory"), std::string::npos) << message;
}

}  // namespace
}  // namespace smurf::test
