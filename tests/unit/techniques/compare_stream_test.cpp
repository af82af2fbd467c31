// Stream surfaces by other options, and the comparison of ways to their curvature: what is shared, what is refused, and
// errors that are known.
#include "smurf/compare.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <initializer_list>
#include <string>

#include "harness/refusal.hpp"
#include "smurf/stream.hpp"
#include "smurf/stream_export.hpp"
#include "surfaces/stream/definition.hpp"

namespace smurf {
namespace {

using test::refusal;

const Domain box{glm::dvec3(-3), glm::dvec3(3), 0};

// x = u, y = τ, z = ½ τ u²: as simple as a surface with curvature can be, and smooth.
Surface graph(const StreamOptions& options = {}) {
  return stream_surface(expression_flow({"0*x", "1+0*x", "x^2/2"}, box), seed_expression({"u", "0", "0"}, {-1, 1}),
                        options);
}

const StreamSurface& model(const Surface& surface) { return dynamic_cast<const StreamSurface&>(surface.model()); }

TEST(StreamOptionsOf, HaveTheDefaultToleranceAndTheSeedsRange) {
  const Surface surface = graph({.time = {-0.5, 2}});
  EXPECT_EQ(options_of(surface).time, glm::dvec2(-0.5, 2));
  EXPECT_DOUBLE_EQ(options_of(surface).tolerance, 6e-5);
  EXPECT_EQ(seed_range(surface), glm::dvec2(-1, 1));
}

TEST(StreamOptionsOf, WhatIsTracedIsSharedWhereItIsTheSame) {
  const Surface surface = graph();
  StreamOptions other = options_of(surface);
  other.derivatives = StreamDerivatives::neighbours;
  other.polish = true;
  const Surface same = with_options(surface, other);
  EXPECT_EQ(options_of(same).derivatives, StreamDerivatives::neighbours);
  EXPECT_TRUE(options_of(same).polish);
  EXPECT_EQ(&model(same).mesh(), &model(surface).mesh());
  EXPECT_EQ(&model(same).field(), &model(surface).field());
  for (const double factor : {2.0, 1.0}) {
    other.tolerance = factor * options_of(surface).tolerance;
    other.time.y = factor == 1 ? 0.75 : 1.0;
    EXPECT_NE(&model(with_options(surface, other)).mesh(), &model(surface).mesh());
  }
  other.time = {1, 0};
  EXPECT_REFUSED(with_options(surface, other), "time");
}

TEST(StreamOptionsOf, OtherKindsAreRefused) {
  const Surface ball = implicit("x^2+y^2+z^2-1", box);
  const Device device = open_device("reference");
  for (const auto& action :
       std::initializer_list<std::function<void()>>{[&] { options_of(ball); }, [&] { with_options(ball, {}); },
                                                    [&] { seed_range(ball); }, [&] { compare_stream(device, ball); }})
    EXPECT_NE(refusal(ErrorCode::usage, action).find("implicit"), std::string::npos);
  refusal(ErrorCode::usage, [&] { stream_polygons(ball); });
  refusal(ErrorCode::usage, [&] { measured_polygons(device, ball); });
}

TEST(CompareStream, NeedsSomethingToCompare) {
  const Device device = open_device("reference");
  EXPECT_NE(refusal(ErrorCode::usage, [&] { compare_stream(device, graph(), {.rays = 0}); }).find("ray"),
            std::string::npos);
  EXPECT_NE(refusal(ErrorCode::usage, [&] { compare_stream(device, graph(), {.places = 0}); }).find("place"),
            std::string::npos);
}

}  // namespace
}  // namespace smurf
