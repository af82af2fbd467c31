// Pictures of lines that are made here: where lines are drawn, what hides what, colours, and what is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "harness/refusal.hpp"
#include "smurf/lines.hpp"

namespace smurf {
namespace {

using test::refusal;

constexpr int size = 101;  // odd: the middle of the picture is a pixel

struct Lines {
  Streamlines lines;
  Values<glm::vec3> velocities;

  Lines() { lines.offsets.push_back(0); }
  // `count` rows of the curve p(t), with its velocity v(t), for t from 0 to `time`.
  void add(int count, double time, const std::function<glm::dvec3(double)>& p,
           const std::function<glm::dvec3(double)>& v) {
    for (int i = 0; i < count; i++) {
      const double t = time * i / (count - 1);
      lines.positions.emplace_back(p(t));
      velocities.emplace_back(v(t));
      lines.times.push_back(float(t));
    }
    lines.offsets.push_back(lines.positions.size());
    lines.end.push_back(FlowStatus::time);
    lines.beginning.push_back(FlowStatus::inside);
  }
  // From a to b at an even speed.
  void add_straight(const glm::dvec3& a, const glm::dvec3& b, double speed) {
    const glm::dvec3 v = speed * glm::normalize(b - a);
    add(
        2, glm::length(b - a) / speed, [=](double t) { return a + t * v; }, [=](double) { return v; });
  }
};

// Looks along y; x is to the right, z up, and a unit is 25 pixels.
LineRenderOptions options(LineShade shade = LineShade::none) {
  LineRenderOptions options;
  options.camera = {.eye = {0, -10, 0}, .orthographic_height = size / 25.0, .width = size, .height = size};
  options.shade = shade;
  options.radius = 0.1;
  options.legend = false;
  return options;
}

glm::ivec3 pixel(const Image& image, int x, int y) {
  const std::size_t at = (std::size_t(y) * std::size_t(image.width) + std::size_t(x)) * 4;
  return {image.rgba[at], image.rgba[at + 1], image.rgba[at + 2]};
}

int distance(const glm::ivec3& a, const glm::ivec3& b) {
  return std::abs(a.x - b.x) + std::abs(a.y - b.y) + std::abs(a.z - b.z);
}

// Pixels that a picture and one without lines have in common are background.
class LinePicture : public testing::Test {
 protected:
  bool covered(const Image& image, int x, int y) const {
    return distance(pixel(image, x, y), pixel(empty_, x, y)) > 30;
  }
  Image empty_ = render(Lines().lines, {}, options());
};

TEST_F(LinePicture, LinesLieWhereTheCameraSeesThem) {
  Lines flat;
  flat.add_straight({-1, 0, 1}, {1, 0, 1}, 1);
  const Image image = render(flat.lines, flat.velocities, options());
  // z = 1 is 25 pixels above the middle, and the tube 5 pixels wide.
  for (int x = 50 - 25; x <= 50 + 25; x++) {
    EXPECT_TRUE(covered(image, x, 25)) << x;
    EXPECT_FALSE(covered(image, x, 25 - 5)) << x;
    EXPECT_FALSE(covered(image, x, 25 + 5)) << x;
  }
  EXPECT_FALSE(covered(image, 50 - 30, 25));
  EXPECT_FALSE(covered(image, 50 + 30, 25));
  // Light comes from above.
  EXPECT_GT(pixel(image, 50, 24).y, pixel(image, 50, 26).y);
}

// Two rows of a quarter of a circle: the cubic between them leaves the circle by less than 1e-3 of the radius
// (1 - cos of the angle left over, Goldapp 1991), a hundredth of a pixel; its chord is 0.29 of the radius away.
TEST_F(LinePicture, RowsAreJoinedByCubics) {
  Lines arc;
  const double quarter = M_PI / 2;
  arc.add(
      2, quarter, [](double t) { return 1.5 * glm::dvec3(std::cos(t), 0, std::sin(t)); },
      [](double t) { return 1.5 * glm::dvec3(-std::sin(t), 0, std::cos(t)); });
  const Image curved = render(arc.lines, arc.velocities, options());
  const Image straight = render(arc.lines, {}, options());
  const int on_circle = int(std::lround(1.5 * 25 * std::sqrt(0.5))), on_chord = int(std::lround(0.75 * 25));
  EXPECT_TRUE(covered(curved, 50 + on_circle, 50 - on_circle));
  EXPECT_FALSE(covered(curved, 50 + on_chord, 50 - on_chord));
  EXPECT_TRUE(covered(straight, 50 + on_chord, 50 - on_chord));
  EXPECT_FALSE(covered(straight, 50 + on_circle, 50 - on_circle));
  // A velocity that is not known is that of differences.
  arc.velocities[1].x = std::numeric_limits<float>::quiet_NaN();
  arc.velocities[0] = arc.velocities[1];
  EXPECT_EQ(render(arc.lines, arc.velocities, options()).rgba, straight.rgba);
}

TEST_F(LinePicture, NearLinesHideFarOnesInAnyOrder) {
  const auto draw = [](bool near_first) {
    Lines cross;
    const double fast = 3, slow = 1;  // the near one is fast
    if (near_first) cross.add_straight({0, -1, -1}, {0, -1, 1}, fast);
    cross.add_straight({-1, 1, 0}, {1, 1, 0}, slow);
    if (!near_first) cross.add_straight({0, -1, -1}, {0, -1, 1}, fast);
    return render(cross.lines, cross.velocities, options(LineShade::speed));
  };
  const Image one = draw(true);
  EXPECT_EQ(one.rgba, draw(false).rgba);
  // Yellow is fast and violet slow.
  const glm::ivec3 middle = pixel(one, 50, 50), far = pixel(one, 50 - 20, 50);
  EXPECT_GT(middle.y, middle.z + 40);
  EXPECT_GT(far.z, far.y + 5);  // faded by half, for it is the farthest
}

TEST_F(LinePicture, ColoursFollowWhatIsAskedFor) {
  Lines line;
  line.add_straight({-1, 0, 0}, {1, 0, 0}, 1);
  const Image by_time = render(line.lines, line.velocities, options(LineShade::time));
  EXPECT_GT(pixel(by_time, 50 - 22, 50).z, pixel(by_time, 50 - 22, 50).y);  // violet to
  EXPECT_GT(pixel(by_time, 50 + 22, 50).y, pixel(by_time, 50 + 22, 50).z);  // yellow
  LineRenderOptions ranged = options(LineShade::speed);
  ranged.range = ValueRange{1, 2};
  const Image slow = render(line.lines, line.velocities, ranged);
  ranged.range = ValueRange{0, 1};
  const Image fast = render(line.lines, line.velocities, ranged);
  EXPECT_GT(pixel(slow, 50, 50).z, pixel(slow, 50, 50).y);
  EXPECT_GT(pixel(fast, 50, 50).y, pixel(fast, 50, 50).z);
}

// A perspective camera, and its box: the twelve edges are drawn, thinly, and nothing is where they are not.
TEST_F(LinePicture, TheBoxIsDrawn) {
  LineRenderOptions boxed = options();
  boxed.camera.orthographic_height = 0;
  boxed.camera.field_of_view = 20;
  boxed.box = Bounds{glm::dvec3(-1), glm::dvec3(1)};
  const Image image = render(Lines().lines, {}, boxed);
  const Projection projection(boxed.camera);
  const auto seen = [&](const glm::dvec3& p) {
    const glm::dvec2 at = projection.pixel(projection.in_view(p));
    bool dark = false;
    for (int dx = -1; dx <= 1; dx++) dark = dark || covered(image, int(at.x) + dx, int(at.y));
    return dark;
  };
  for (const double y : {-1.0, 1.0}) {
    for (const double x : {-1.0, 1.0}) EXPECT_TRUE(seen({x, y, 0.3})) << x << " " << y;
  }
  EXPECT_FALSE(covered(image, 50, 50));
  // The projection is the inverse of the camera's rays.
  const RayBatch rays = boxed.camera.rays();
  const Ray ray = rays[std::size_t(size) * 20 + 30];
  const glm::dvec2 at = projection.pixel(projection.in_view(glm::dvec3(ray.origin) + 7.0 * glm::dvec3(ray.direction)));
  EXPECT_NEAR(at.x, 30.5, 1e-3);  // directions are floats: 6e-8 of some 290 pixels a unit, a few times
  EXPECT_NEAR(at.y, 20.5, 1e-3);
}

TEST_F(LinePicture, RefusesWhatCannotBeMeant) {
  Lines line;
  line.add_straight({-1, 0, 0}, {1, 0, 0}, 1);
  const auto message = [&](const std::function<void(LineRenderOptions&)>& spoil, ErrorCode code = ErrorCode::usage) {
    LineRenderOptions bad = options();
    spoil(bad);
    return refusal(code, [&] { render(line.lines, line.velocities, bad); });
  };
  EXPECT_NE(message([](auto& o) { o.samples = 0; }).find("samples"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.radius = -1; }).find("radius"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.range = ValueRange{1, 1}; }).find("range"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.camera.width = 1 << 20; }).find("samples"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.camera.look_at = o.camera.eye; }, ErrorCode::input).find("camera"),
            std::string::npos);
  EXPECT_NE(refusal(ErrorCode::usage,
                    [&] { render(line.lines, std::span<const glm::vec3>(line.velocities).first(1), options()); })
                .find("1 velocities"),
            std::string::npos);
  EXPECT_NE(refusal(ErrorCode::usage, [] { line_shade_named("phong"); }).find("speed, time, none"), std::string::npos);
}

}  // namespace
}  // namespace smurf
