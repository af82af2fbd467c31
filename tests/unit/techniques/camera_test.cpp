// Cameras by the names of sides, and fitted to what they see.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "harness/command_line.hpp"
#include "harness/refusal.hpp"
#include "smurf/camera.hpp"
#include "smurf/render.hpp"

namespace smurf {
namespace {

using test::Outcome;

const Bounds box{{-1, -2, -3}, {1, 2, 3}};

void expect_near(const glm::dvec3& a, const glm::dvec3& b) {
  EXPECT_LT(glm::distance(a, b), 1e-9) << a.x << ' ' << a.y << ' ' << a.z << " is not " << b.x << ' ' << b.y << ' '
                                       << b.z;
}

glm::dvec3 towards_eye(const Camera& camera) { return glm::normalize(camera.eye - camera.look_at); }

TEST(Views, stand_on_the_side_that_they_name) {
  const auto from = [](const char* name, const glm::dvec3& up) {
    return camera_from(view_named(name), up, box, 64, 64);
  };
  const glm::dvec3 z(0, 0, 1), y(0, 1, 0);
  expect_near(towards_eye(from("usual", z)), glm::normalize(glm::dvec3(0.2, -1, 0.4)));
  expect_near(towards_eye(from("front", z)), {0, -1, 0});
  expect_near(towards_eye(from("back", z)), {0, 1, 0});
  expect_near(towards_eye(from("right", z)), {1, 0, 0});
  expect_near(towards_eye(from("left", z)), {-1, 0, 0});
  expect_near(towards_eye(from("top", z)), {0, 0, 1});
  expect_near(from("top", z).up, {0, 1, 0});
  expect_near(towards_eye(from("bottom", z)), {0, 0, -1});
  expect_near(from("bottom", z).up, {0, -1, 0});
  expect_near(towards_eye(from("iso", z)), glm::normalize(glm::dvec3(1, -1, 1)));
  // The view turns with up: what is above is seen from above, whatever up is.
  expect_near(towards_eye(from("usual", y)), glm::normalize(glm::dvec3(0.2, 0.4, 1)));
  expect_near(towards_eye(from("usual", -z)), glm::normalize(glm::dvec3(-0.2, -1, -0.4)));
  expect_near(towards_eye(from("right", y)), {1, 0, 0});
  for (const glm::dvec3& up : {z, -z, y, -y, glm::dvec3(1, 0, 0), glm::dvec3(0.3, -2, 0.1)}) {
    EXPECT_GT(glm::dot(towards_eye(from("usual", up)), up), 0);
    EXPECT_FALSE(replacement_of_up(from("usual", up)).has_value());
  }
  EXPECT_NE(test::refusal(ErrorCode::usage, [] { view_named("behind"); }).find("back"), std::string::npos);
  EXPECT_REFUSED(camera_from(View::front, glm::dvec3(0), box, 8, 8), "zero");
}

// How far points reach from the middle of the picture, 1 at its border.
glm::dvec2 reach_of(const Camera& camera, const std::vector<glm::vec3>& points) {
  const Projection projection(camera);
  const glm::dvec2 size(camera.width, camera.height);
  glm::dvec2 reach(0);
  for (const glm::vec3& point : points) {
    const glm::dvec3 seen = projection.in_view(glm::dvec3(point));
    EXPECT_GT(seen.z, 0);
    reach = glm::max(reach, glm::abs(2.0 * projection.pixel(seen) / size - 1.0));
  }
  return reach;
}

TEST(FittedCamera, points_fill_the_picture) {
  const std::vector<glm::vec3> points{{5, 0, 0}, {6, 1, 0.3}, {5, 2, -1}, {4, 1, 0}, {5.5, 0.5, 2}};
  for (const glm::ivec2 size : {glm::ivec2(64, 64), {200, 50}, {50, 200}}) {
    for (const View view : {View::usual, View::top, View::iso}) {
      Camera camera = camera_from(view, {0, 0, 1}, box, size.x, size.y);
      camera.field_of_view = 30;
      const glm::dvec2 moved = reach_of(fitted_to(camera, points), points);
      EXPECT_NEAR(std::max(moved.x, moved.y), 0.95, 1e-4);
      camera.look_at = {5, 1, 0};
      camera.eye = camera.look_at + 3.0 * glm::dvec3(0.2, -1, 0.4);
      camera.up = {0, 0, 1};
      const Camera nearer = fitted_to(camera, points, Fit::eye);
      const glm::dvec2 reach = reach_of(nearer, points);
      EXPECT_NEAR(std::max(reach.x, reach.y), 0.95, 1e-4);
      expect_near(nearer.look_at, camera.look_at);
      expect_near(towards_eye(nearer), towards_eye(camera));
      camera.orthographic_height = 100;
      const glm::dvec2 parallel = reach_of(fitted_to(camera, points), points);
      EXPECT_NEAR(std::max(parallel.x, parallel.y), 0.95, 1e-4);
    }
  }
  const Camera camera = camera_from(View::usual, {0, 0, 1}, box, 64, 64);
  expect_near(fitted_to(camera, {}).eye, camera.eye);
  expect_near(fitted_to(camera, std::vector<glm::vec3>{{1, 1, 1}}).eye, camera.eye);
}

// Share of the picture's rows and columns that see the surface.
glm::dvec2 share_seen(const Interrogator& query, const Camera& camera) {
  const HitList hits = query.cast(camera.rays());
  std::vector<bool> rows(std::size_t(camera.height)), columns(std::size_t(camera.width));
  for (const std::uint32_t ray : hits.rays()) {
    rows[ray / columns.size()] = true;
    columns[ray % columns.size()] = true;
  }
  return {double(std::count(columns.begin(), columns.end(), true)) / camera.width,
          double(std::count(rows.begin(), rows.end(), true)) / camera.height};
}

TEST(FittedCamera, the_surface_fills_the_picture_and_not_its_domain) {
  const Device device = open_device("reference");
  const Domain wide{.lower = glm::dvec3(-4, -4, -4), .upper = glm::dvec3(4, 4, 4)};
  const Surface surface = implicit("(x-2)^2+(y+1)^2+4*z^2-1", wide);
  const Interrogator query(device, surface);
  for (const View view : {View::usual, View::front, View::top, View::iso}) {
    const Camera camera = fitted_camera(query, camera_from(view, {0, 0, 1}, surface.bounds(), 72, 48));
    const glm::dvec2 share = share_seen(query, camera);
    EXPECT_GT(std::max(share.x, share.y), 0.9);
    EXPECT_LT(std::max(share.x, share.y), 1);
  }
  // Nothing is seen: the camera stays.
  Camera away = camera_from(View::usual, {0, 0, 1}, surface.bounds(), 16, 16);
  away.look_at = away.eye + (away.eye - away.look_at);
  expect_near(fitted_camera(query, away).eye, away.eye);
}

TEST(FittedCamera, up_along_the_view_is_replaced) {
  Camera camera;
  camera.eye = {0, 0, 5};
  expect_near(replacement_of_up(camera).value(), {0, 1, 0});
  camera.eye = {5, 0, 0};
  EXPECT_FALSE(replacement_of_up(camera).has_value());
  camera.up = {-2, 0, 0};
  expect_near(replacement_of_up(camera).value(), {0, 0, 1});
}

class CameraOptions : public test::CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    write("ball.json", R"({"kind":"implicit","equation":"x^2+y^2+z^2-1","domain":[[-3,-3,-3],[3,3,3]]})");
  }
  std::string render(const std::string& options) const {
    return "render " + in("ball.json") + " --device reference --size 24x24 " + options + " -o " + in("image.png");
  }
};

TEST_F(CameraOptions, an_up_along_the_view_is_replaced_with_a_word) {
  const Outcome outcome = run(render("--eye 0,0,6 --look-at 0,0,0 --up 0,0,1"));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "smurf: warning: up 0,0,1 is parallel to the view; 0,1,0 is up in its place\n");
  EXPECT_EQ(run(render("--view top --up 0,1,0")).err, "");
}

TEST_F(CameraOptions, unknown_sides_and_sides_beside_an_eye_are_refused) {
  expect_refused(render("--view behind"), {"behind", "front", "iso"});
  expect_refused(render("--view front --eye 1,2,3"), {"--view", "--eye"});
}

}  // namespace
}  // namespace smurf
