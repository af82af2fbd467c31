// Steps on level sets (expressions, grids, black boxes) on every device: where they arrive, against circles in closed
// form, by what is true of every step, and against the reference; where they cannot.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "checks.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/refusal.hpp"
#include "truth/analytic.hpp"

KERNELS(walk);

namespace smurf::test {
namespace {

Domain cube(double half) { return {glm::dvec3(-half), glm::dvec3(half)}; }

Surface sphere(double half = 1.5) { return implicit("x^2+y^2+z^2-1", cube(half)); }
double from_sphere(const glm::dvec3& p) { return std::abs(glm::length(p) - 1); }

WalkStarts on_sphere(std::size_t count) {
  WalkStarts starts;
  for (const glm::vec3& v : random_directions(count, 5)) starts.points.push_back(glm::normalize(v));
  starts.directions = random_directions(count);
  return starts;
}

// The point on the great circle from p in the direction d, and the direction there.
std::pair<glm::dvec3, glm::dvec3> on_great_circle(const glm::dvec3& p, const glm::dvec3& d, double angle) {
  const glm::dvec3 n = glm::normalize(p), t = glm::normalize(d - n * glm::dot(d, n));
  return {std::cos(angle) * n + std::sin(angle) * t, -std::sin(angle) * n + std::cos(angle) * t};
}

std::vector<TestDevice> all_devices() {
  std::vector<TestDevice> devices = test_devices();
  devices.push_back({"reference", "reference", 0, true, reference_device()});
  return devices;
}

TEST(WalkOnSphere, NeighborsAreOnTheGreatCircleAtTheChord) {
  for (TestDevice& device : all_devices()) {
    SCOPED_TRACE(device.label);
    const WalkStarts starts = on_sphere(device.slow ? 99 : 999);
    const Interrogator query(device.device, sphere());
    for (const float distance : {0.01f, 0.1f, 0.7f, 1.9f}) {
      const Neighbors next = query.neighbors(starts.points, starts.directions, distance);
      ASSERT_EQ(next.size(), starts.points.size());
      const double angle = 2 * std::asin(double(distance) / 2);
      // Where the circle is nearly as wide as the sphere, a little of the chord is a lot along it.
      const double allowed = 1e-5 * distance / std::cos(angle / 2) + 4 * rounding;
      for (std::size_t i = 0; i < next.size(); i++) {
        ASSERT_EQ(next.status[i], WalkStatus::reached) << i << " " << distance;
        const auto [location, direction] = on_great_circle(starts.points[i], starts.directions[i], angle);
        ASSERT_LE(glm::distance(glm::dvec3(next.locations[i]), location), allowed) << i << " " << distance;
        ASSERT_NEAR(next.chords[i], distance, 1e-5 * distance + 4 * rounding) << i;
        ASSERT_LE(glm::distance(glm::dvec3(next.directions[i]), direction), allowed + 1e-5) << i << " " << distance;
        ASSERT_LE(glm::distance(next.normals[i], next.locations[i]), 1e-5) << i;
      }
    }
  }
}

TEST(WalkOnSphere, ChordsBeyondTheSphereAreUnreachable) {
  for (TestDevice& device : all_devices()) {
    SCOPED_TRACE(device.label);
    const WalkStarts starts = on_sphere(20);
    const Interrogator query(device.device, sphere());
    for (const float distance : {2.001f, 2.5f, 40.0f}) {
      const Neighbors next = query.neighbors(starts.points, starts.directions, distance);
      for (std::size_t i = 0; i < next.size(); i++) {
        EXPECT_EQ(next.status[i], WalkStatus::unreachable) << i << " " << distance;
        EXPECT_EQ(next.chords[i], 0.0f);
        EXPECT_LE(glm::distance(next.locations[i], starts.points[i]), 4 * rounding);
      }
    }
  }
}

TEST(WalkOnSphere, EndsWhereTheDomainDoes) {
  for (TestDevice& device : all_devices()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, implicit("x^2+y^2+z^2-1", {glm::dvec3(-2), glm::dvec3(2, 2, 0.5)}));
    const std::vector<glm::vec3> points{{1, 0, 0}, {0, 1, 0}}, up{{0, 0, 1}, {0, 0, 1}};
    const Paths paths = query.walk(points, up, 0.2f, 10);
    ASSERT_EQ(paths.size(), 2u);
    for (std::size_t i = 0; i < paths.size(); i++) {
      // Steps of the angle 0.2003 up to the latitude 30°: two, and a third that leaves.
      ASSERT_EQ(paths.offsets[i + 1] - paths.offsets[i], 4u);
      const std::size_t last = paths.offsets[i + 1] - 1;
      EXPECT_EQ(paths.status[last - 3], WalkStatus::start);
      EXPECT_EQ(paths.status[last - 1], WalkStatus::reached);
      EXPECT_EQ(paths.status[last], WalkStatus::boundary);
      EXPECT_EQ(paths.steps[last], 3u);
      EXPECT_NEAR(paths.locations[last].z, 0.5, 1e-4);
      EXPECT_LE(from_sphere(paths.locations[last]), 1e-4);
    }
  }
}

TEST(WalkOnSphere, BadPointsSaySo) {
  for (TestDevice& device : all_devices()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, sphere());
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<glm::vec3> points{{1, 0, 0}, {1.2f, 0, 0}, {nan, 0, 0}, {1, 0, 0}, {1.002f, 0, 0}, {1, 0, 0}};
    const std::vector<glm::vec3> directions{{2, 0, 0}, {0, 1, 0}, {0, 1, 0}, {0, 0, 0}, {0, 1, 0}, {0, 1, nan}};
    const Neighbors next = query.neighbors(points, directions, 0.1f);
    using enum WalkStatus;
    const std::vector<WalkStatus> expected{no_direction, off_surface, invalid, no_direction, reached, invalid};
    EXPECT_TRUE(std::ranges::equal(next.status, expected));
    // Moved onto the surface first.
    EXPECT_NEAR(glm::length(next.locations[4]), 1, 1e-6);
    EXPECT_EQ(query.neighbors(points, directions, 0.1f, {.tolerance = 0.001f}).status[4], off_surface);
    EXPECT_EQ(query.neighbors(points, directions, 0.1f, {.tolerance = 0.3f}).status[1], reached);
    EXPECT_EQ(query.neighbors(points, directions, 0.1f, {.tolerance = 0}).status[4], off_surface);

    WalkOptions strict{.bad_points = BadPoints::error};
    EXPECT_REFUSED(query.neighbors(points, directions, 0.1f, strict), "cannot walk from point 0: its direction");
    EXPECT_REFUSED(query.neighbors(std::span(points).subspan(1), std::span(directions).subspan(1), 0.1f, strict),
                   "point 0: (1.2, 0, 0) is farther than");
    const std::vector<float> distances{0.1f, 0.1f, 0.1f, 0.1f, -1.0f, 0.1f};
    EXPECT_EQ(query.neighbors(points, directions, distances).status[4], invalid);
  }
}

TEST(WalkOnSphere, QuestionsThatDoNotGoTogetherAreRefused) {
  const Interrogator query(reference_device(), sphere());
  const std::vector<glm::vec3> points{{1, 0, 0}}, directions{{0, 1, 0}};
  const auto refused = [&](auto&& action, std::string_view part) {
    const std::string message = refusal(ErrorCode::usage, action);
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  for (const float distance : {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN(), INFINITY})
    refused([&] { query.neighbors(points, directions, distance); }, "must be positive and finite");
  refused([&] { query.neighbors(points, {}, 0.1f); }, "one direction per point: 1 points, 0 directions");
  refused([&] { query.neighbors(points, directions, std::vector<float>(2, 1.0f)); }, "1 points, 2 distances");
  refused([&] { query.walk(points, directions, 0.1f, 0); }, "steps");
  refused([&] { query.neighbors(points, directions, 0.1f, {.tolerance = NAN}); }, "tolerance");
  EXPECT_EQ(query.neighbors({}, {}, 0.1f).size(), 0u);
  EXPECT_EQ(query.walk({}, {}, 0.1f, 3).size(), 0u);
}

TEST(WalkOverCreases, GoesOnAndSaysSo) {
  for (TestDevice& device : one_of_each()) {
    SCOPED_TRACE(device.label);
    // A cube: from the middle of the top over an edge, to the chord 1 from (0, 0.3, 1).
    const Interrogator query(device.device, implicit("max(max(abs(x),abs(y)),abs(z))-1", cube(1.5)));
    const std::vector<glm::vec3> points{{0.5f, 0.3f, 1}, {-0.6f, 0.25f, 1}}, directions{{1, 0, 0}, {1, 0, 0}};
    const Neighbors next = query.neighbors(points, directions, 1);
    EXPECT_EQ(next.status[0], WalkStatus::crease);
    const glm::vec3 over(1, 0.3f, 1 - std::sqrt(0.75f));
    EXPECT_LE(glm::distance(next.locations[0], over), 2e-5f);
    EXPECT_LE(glm::distance(next.directions[0], glm::vec3(0, 0, -1)), 1e-5f);
    EXPECT_EQ(next.status[1], WalkStatus::reached);
    EXPECT_LE(glm::distance(next.locations[1], glm::vec3(0.4f, 0.25f, 1)), 2e-5f);
  }
}

TEST(WalkOnTwoSheets, StaysOnItsOwn) {
  for (TestDevice& device : one_of_each()) {
    SCOPED_TRACE(device.label);
    // Two spheres of radius 1 whose gap is 0.02; the second is nearer to where the tangent leads.
    const Interrogator query(
        device.device, implicit("min((x-1.01)^2+y^2+z^2-1,(x+1.01)^2+y^2+z^2-1)", {glm::dvec3(-3), glm::dvec3(3)}));
    std::vector<glm::vec3> points, directions;
    for (int i = 0; i < 40; i++) {
      const float angle = 2.2f + 0.02f * float(i);
      points.emplace_back(1.01f + std::cos(angle), std::sin(angle), 0);
      directions.emplace_back(-1, 0, 0.001f * float(i));
    }
    const Neighbors next = query.neighbors(points, directions, 1.2f);
    for (std::size_t i = 0; i < next.size(); i++) {
      ASSERT_EQ(next.status[i], WalkStatus::reached) << i;
      EXPECT_NEAR(glm::distance(glm::dvec3(next.locations[i]), glm::dvec3(1.01, 0, 0)), 1, 2e-5) << i;
    }
  }
}

struct Field {
  std::string name;
  Surface surface;
  double from_exact;  // how far the surface may be from the sphere, for grids
};

std::vector<Field> spheres() {
  const auto field = sphere_field(glm::dvec3(0), 1);
  const glm::ivec3 size(33, 37, 41);
  GridPlacement placement;
  placement.axes = glm::dmat3(glm::dvec3(0.08, 0, 0), glm::dvec3(0, 0.07, 0), glm::dvec3(0, 0, 0.065));
  const Volume volume = sample(*field, {.size = size, .placement = centered(placement, size)});
  const Volume turned =
      sample(*field, {.size = glm::ivec3(40), .placement = centered(sheared_placement(0.08, 4), glm::ivec3(40))});
  const auto of = [&](const Volume& v, Reconstruction r) { return isosurface(v, 0, {.reconstruction = r}); };
  const BlackBox box{"FN real black_box(real x, real y, real z) { return x*x + y*y + z*z - 1.0f; }",
                     [](const glm::dvec3& p) { return glm::dot(p, p) - 1; }, "ball"};
  return {{"tricubic", of(volume, Reconstruction::tricubic), 3e-4},
          {"tricubic, sheared", of(turned, Reconstruction::tricubic), 3e-4},
          {"catmull-rom", of(volume, Reconstruction::catmull_rom), 2e-3},
          {"trilinear", of(volume, Reconstruction::trilinear), 3e-3},
          {"black box", implicit(box, cube(1.5)), 0}};
}

TEST(WalkOnFields, StepsAreRightAndAgreeWithTheReference) {
  const std::vector<Field> fields = spheres();
  for (const Field& field : fields) {
    SCOPED_TRACE(field.name);
    const Interrogator reference(reference_device(), field.surface);
    const WalkStarts starts = random_starts(reference, {glm::dvec3(-1.2), glm::dvec3(1.2)}, 150);
    ASSERT_GT(starts.points.size(), 100u);
    const auto normals = reference.probe(starts.points, std::uint32_t(Property::normal)).normal;
    for (const float distance : {0.05f, 0.6f}) {
      SCOPED_TRACE(distance);
      const Neighbors right = reference.neighbors(starts.points, starts.directions, distance);
      for (TestDevice& device : one_of_each()) {
        SCOPED_TRACE(device.label);
        const Interrogator query(device.device, field.surface);
        const Neighbors next = query.neighbors(starts.points, starts.directions, distance);
        // Devices measure black boxes by differences, normals' roundings of which turn the plane.
        const WalkTolerances tolerances{.plane = field.name == "black box" ? 3e-4 : 2e-5};
        const std::size_t reached = expect_steps(
            next, starts, normals, distance,
            [&](const glm::dvec3& q) { return std::max(from_sphere(q) - field.from_exact, 0.0); }, tolerances);
        EXPECT_EQ(reached, next.size());
        // Trilinear fields bend at faces of cells: there executors may call a bend a crease or not.
        const std::size_t other = count_other(next, right, 3e-4 * distance + 8 * rounding);
        EXPECT_LE(other, field.name == "trilinear" ? next.size() / 50 : 0u);
      }
    }
  }
}

TEST(WalkFromHits, CarriesOnFromHitLists) {
  for (TestDevice& device : one_of_each()) {
    SCOPED_TRACE(device.label);
    const Interrogator query(device.device, sphere());
    const HitList hits = query.cast(RayBatch(std::vector<Ray>{{{-3, 0.1f, 0}, {1, 0, 0}}, {{0, 0.2f, 3}, {0, 0, -1}}}),
                                    {.hits = Hits::all});
    ASSERT_EQ(hits.size(), 4u);
    const Neighbors next = hits.neighbors(std::vector<glm::vec3>(4, {0, 1, 0.1f}), 0.25f);
    for (std::size_t i = 0; i < next.size(); i++) {
      EXPECT_EQ(next.status[i], WalkStatus::reached);
      EXPECT_NEAR(glm::distance(next.locations[i], hits.locations()[i]), 0.25, 1e-5);
    }
    EXPECT_EQ(refusal(ErrorCode::usage, [&] { hits.neighbors({}, 0.25f); }),
              "walking needs one direction per hit: 4 hits, 0 directions");
  }
}

}  // namespace
}  // namespace smurf::test
