// Roots of rays in double precision: near silhouettes, along surfaces, at seams and poles, against closed forms.
#include "patches/ray_roots.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "harness/files/shared_data.hpp"
#include "io/patch_file.hpp"
#include "unit/patches/surfaces.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;
using test::turn;
using test::Uniform;
using Kind = expression::LineRoot::Kind;
using Long = long double;

constexpr double infinity = std::numeric_limits<double>::infinity();

template <class Source>
class Surface {
 public:
  explicit Surface(Source given)
      : source_(std::move(given)),
        extent_(test::extent_of(source_)),
        topology_(join_pieces(source_, extent_)),
        roots_(source_, topology_, make_leaves(source_, topology_, extent_), extent_) {}

  std::vector<PatchRoot> find(const dvec3& origin, const dvec3& direction, double low = -infinity,
                              double high = infinity) const {
    std::vector<PatchRoot> roots;
    roots_.find(origin, direction, low, high, roots);
    for (const PatchRoot& r : roots) {
      EXPECT_LE(r.root.low, r.root.high);
      if (r.root.kind != Kind::one) continue;
      // The place is that of the parameters.
      const double t = 0.5 * (r.root.low + r.root.high);
      const dvec3 place = source_.at(r.piece, r.u, r.v).position;
      EXPECT_LT(glm::distance(origin + t * direction, place), 1e-9 * extent_);
    }
    return roots;
  }
  double extent() const { return extent_; }

 private:
  Source source_;
  double extent_;
  PatchTopology topology_;
  RayRoots roots_;
};

struct Line {
  dvec3 origin, direction;
};

// Not inline: GCC 12 takes the unrounded number where it is used as a long double.
[[gnu::noinline]] dvec3 rounded(const dvec3& v) { return dvec3(glm::vec3(v)); }

Line random_line(Uniform& uniform, double size) {
  const auto place = [&] { return dvec3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)) * size; };
  const dvec3 from = rounded(place() + dvec3(0, 0, 3 * size)), to = place();
  return {from, rounded(glm::normalize(to - from))};
}

// Of a t² + 2 b t + c.
std::vector<Long> quadratic_roots(Long a, Long b, Long c) {
  const Long root = b * b - a * c;
  if (root < 0) return {};
  return {(-b - std::sqrt(root)) / a, (-b + std::sqrt(root)) / a};
}

void expect_roots(const std::vector<PatchRoot>& found, const std::vector<Long>& expected, const std::string& what) {
  ASSERT_EQ(found.size(), expected.size()) << what;
  for (std::size_t i = 0; i < found.size(); i++) {
    const auto& root = found[i].root;
    EXPECT_EQ(root.kind, Kind::one) << what;
    // The closed form itself, and its constants, are rounded.
    EXPECT_LE(root.low - 1e-14, double(expected[i])) << what;
    EXPECT_GE(root.high + 1e-14, double(expected[i])) << what;
    if (i > 0) {
      EXPECT_LT(found[i - 1].root.high, root.low) << what;
    }
  }
}

std::string say(double off) {
  return "off " + std::to_string(std::log10(std::abs(off))) + (off > 0 ? " inside" : " outside");
}

// Distances from a silhouette, of the extent: inside and outside.
std::vector<double> offs() {
  std::vector<double> all;
  for (int k = 6; k <= 24; k++) {
    for (const double sign : {1.0, -1.0}) all.push_back(sign * std::pow(10, -0.5 * k));
  }
  return all;
}

TEST(RayRoots, OfASphereAtItsSilhouette) {
  Uniform uniform(1);
  for (const double off : offs()) {
    const Line line = random_line(uniform, 1);
    const glm::vec<3, Long> o(line.origin), d(line.direction);
    const Long a = glm::dot(d, d), b = glm::dot(o, d), away = std::sqrt(glm::dot(o, o) - b * b / a);
    const auto r = double(away * (1 + Long(off)));
    const Surface sphere(
        ExpressionSource({"r*cos(u)*sin(v)", "r*sin(u)*sin(v)", "r*cos(v)"}, {{0, 0}, {turn, turn / 2}}, {{"r", r}}));
    const auto found = sphere.find(line.origin, line.direction);
    expect_roots(found, quadratic_roots(a, b, glm::dot(o, o) - Long(r) * Long(r)), say(off));
  }
}

// In a plane across its axis a torus is two circles.
TEST(RayRoots, OfATorusAtItsSilhouettes) {
  Uniform uniform(2);
  for (const double off : offs()) {
    for (const bool inner : {false, true}) {
      const double angle = uniform(0, turn);
      const dvec3 direction = rounded({std::cos(angle), std::sin(angle), 0});
      const dvec3 origin =
          rounded({-3 * std::sin(angle) - 7 * std::cos(angle), 3 * std::cos(angle), uniform(-0.9, 0.9)});
      const glm::vec<3, Long> o(origin.x, origin.y, 0), d(direction);
      const Long a = glm::dot(d, d), b = glm::dot(o, d), away = std::sqrt(glm::dot(o, o) - b * b / a);
      const Long half = std::sqrt(1 - Long(origin.z) * Long(origin.z));
      const auto r = double(inner ? away * (1 + Long(off)) + half : away * (1 + Long(off)) - half);
      const Surface torus(
          ExpressionSource({"(r+cos(v))*cos(u)", "(r+cos(v))*sin(u)", "sin(v)"}, {{0, 0}, {turn, turn}}, {{"r", r}}));
      auto expected = quadratic_roots(a, b, glm::dot(o, o) - (Long(r) + half) * (Long(r) + half));
      for (const Long t : quadratic_roots(a, b, glm::dot(o, o) - (Long(r) - half) * (Long(r) - half)))
        expected.push_back(t);
      std::ranges::sort(expected);
      expect_roots(torus.find(origin, direction), expected, say(off) + (inner ? ", inner" : ", outer"));
    }
  }
}

// z = c - x² - y².
BezierSource bump(double c) {
  const double square[3] = {1, -1, 1};
  std::vector<glm::dvec4> points;
  for (int j = 0; j < 3; j++) {
    for (int i = 0; i < 3; i++) points.emplace_back(i - 1, j - 1, c - square[i] - square[j], 1);
  }
  return BezierSource(std::vector<Patch>{bezier_patch(2, 2, points)});
}

TEST(RayRoots, OfABumpAtItsSilhouette) {
  Uniform uniform(3);
  for (const double off : offs()) {
    const dvec3 middle{uniform(-0.3, 0.3), uniform(-0.3, 0.3), 0.5};
    const dvec3 direction = rounded({uniform(-1, 1), uniform(0.2, 1), uniform(-0.2, 0.2)});
    const dvec3 origin = rounded(middle - 2.0 * direction);
    const glm::vec<3, Long> o(origin), d(direction);
    // (x² + y²) + z - c along the ray.
    const Long a = d.x * d.x + d.y * d.y, b = o.x * d.x + o.y * d.y + d.z / 2, c = o.x * o.x + o.y * o.y + o.z;
    const auto height = double(c - b * b / a + Long(off));
    expect_roots(Surface(bump(height)).find(origin, direction), quadratic_roots(a, b, c - Long(height)), say(off));
  }
}

void expect_touching(const std::vector<PatchRoot>& found, double t, const char* what) {
  ASSERT_EQ(found.size(), 1u) << what;
  EXPECT_EQ(found[0].root.kind, Kind::touching) << what;
  EXPECT_LE(found[0].root.low, t) << what;
  EXPECT_GE(found[0].root.high, t) << what;
  EXPECT_LT(found[0].root.high - found[0].root.low, 1e-6) << what;
}

TEST(RayRoots, OfTangentsAreOneEnclosure) {
  const Surface sphere(test::sphere());
  expect_touching(sphere.find({-2, 1, 0}, {1, 0, 0}), 2, "sphere");
  expect_touching(sphere.find({1, -2, 0}, {0, 1, 0}), 2, "sphere, across its seam");
  expect_touching(sphere.find({1, 0, -2}, {0, 0, 1}), 2, "sphere, along its seam");
  expect_touching(sphere.find({-1.5, -2, 1}, {0.75, 1, 0}), 2, "sphere, at its pole");
  expect_touching(Surface(bump(1)).find({-2, 0, 1}, {1, 0, 0}), 2, "bump");
  expect_touching(Surface(bump(1)).find({-2, -1, 1}, {1, 0.5, 0}), 2, "bump");
}

TEST(RayRoots, AlongSurfacesAreStretches) {
  const Surface tube(ExpressionSource({"cos(u)", "sin(u)", "v"}, {{0, 0}, {turn, 1}}));
  for (const Line& line : {Line{{0, 1, -2}, {0, 0, 1}}, Line{{1, 0, -2}, {0, 0, 1}}}) {
    const auto found = tube.find(line.origin, line.direction);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].root.kind, Kind::undecided);
    EXPECT_NEAR(found[0].root.low, 2, 1e-6);
    EXPECT_NEAR(found[0].root.high, 3, 1e-6);
  }
  EXPECT_EQ(tube.find({0, 1 + 1e-9, -2}, {0, 0, 1}).size(), 0u);
  EXPECT_EQ(tube.find({0, 1 - 1e-9, -2}, {0, 0, 1}).size(), 0u);
  const Surface flat(BezierSource(
      std::vector<Patch>{bezier_patch(1, 1, {{0, 0, 0, 1}, {1, 0, 0, 1}, {0, 1, 0, 1}, {1.25, 1, 0, 1}})}));
  EXPECT_EQ(flat.find({-1, 0.5, 0}, {1, 0.125, 0}).size(), 0u);
  EXPECT_EQ(flat.find({-1, 0.5, -1e-6}, {1, 0.125, 1e-6}).size(), 1u);
}

TEST(RayRoots, AtPolesAndSeamsAreOne) {
  const Surface sphere(test::sphere());
  expect_roots(sphere.find({0, 0, -2}, {0, 0, 1}), {1, 3}, "both poles");
  expect_roots(sphere.find({0, 0, -2}, {0, 0, 1}, 2, 5), {3}, "one of them");
  expect_roots(sphere.find({-2, 0, 0}, {1, 0, 0}), {1, 3}, "seam");
  expect_roots(sphere.find({-0.5, -0.75, -1}, {0.25, 0.375, 1}),
               {quadratic_roots(1.0625L + 0.140625L, -0.125L - 0.28125L - 1, 0.25L + 0.5625L)},
               "aslant through the pole's neighbourhood");
  for (int k = 4; k <= 15; k++) {
    const Long off = std::pow(10.0L, Long(-k)), x = double(off), z = std::sqrt(1 - x * x);
    expect_roots(sphere.find({double(x), 0, -2}, {0, 0, 1}), {2 - z, 2 + z}, "beside the poles");
    expect_roots(sphere.find({double(x), -double(x) / 2, -2}, {0, 0, 1}),
                 {2 - std::sqrt(1 - 1.25L * x * x), 2 + std::sqrt(1 - 1.25L * x * x)}, "beside the poles");
    expect_roots(sphere.find({-2, double(x), 0}, {1, 0, 0}), {2 - z, 2 + z}, "beside the seam");
  }
}

// Closed surfaces are crossed in pairs.
TEST(RayRoots, OfRandomChords) {
  const Surface sphere(test::sphere()), torus(test::torus());
  Uniform uniform(4);
  const auto begin = std::chrono::steady_clock::now();
  for (int n = 0; n < 4000; n++) {
    const Line line = random_line(uniform, 1);
    const glm::vec<3, Long> o(line.origin), d(line.direction);
    expect_roots(sphere.find(line.origin, line.direction),
                 quadratic_roots(glm::dot(d, d), glm::dot(o, d), glm::dot(o, o) - 1), "chord " + std::to_string(n));
    EXPECT_EQ(torus.find(3.0 * line.origin, line.direction).size() % 2, 0u);
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  RecordProperty("microseconds", int(seconds / 8000 * 1e6));
}

}  // namespace
}  // namespace smurf
