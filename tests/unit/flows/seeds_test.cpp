// Seed curves: places and derivatives against closed forms, tables of seeds, and what is wrong with either in one line.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "flows/seeds/seed_curve.hpp"
#include "harness/refusal.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;
using test::refusal;

void expect_near(const glm::dvec3& value, const glm::dvec3& truth, double tolerance, const std::string& what) {
  for (int k = 0; k < 3; k++) EXPECT_NEAR(value[k], truth[k], tolerance) << what << "[" << k << "]";
}

class Seeds : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(SMURF_TEST_OUTPUT) / "seeds" / testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  fs::path put(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  // A file of seeds is refused in one line that names it and holds every one of `words`.
  void expect_refused(const std::string& name, const std::string& text, const std::vector<std::string>& words) const {
    SCOPED_TRACE(text);
    const fs::path file = put(name, text);
    const std::string message = refusal(ErrorCode::input, [&] { load_seeds(file); });
    EXPECT_NE(message.find(name), std::string::npos) << message;
    for (const std::string& word : words) EXPECT_NE(message.find(word), std::string::npos) << word << ": " << message;
  }

 private:
  fs::path folder_;
};

TEST_F(Seeds, PolylineHasItsSegmentsDirections) {
  const auto line = polyline_seeds({{0, 0, 0}, {2, 0, 0}, {2, 4, 0}, {2, 8, 0}});
  EXPECT_EQ(line->range(), glm::dvec2(0, 3));
  // The third point is no corner: the direction and the speed are the same on both sides.
  EXPECT_EQ(line->corners(), std::vector<double>{1});
  expect_near(line->at(0.25).position, {0.5, 0, 0}, 0, "position");
  expect_near(line->at(0.25).first, {2, 0, 0}, 0, "first");
  expect_near(line->at(1).position, {2, 0, 0}, 0, "corner");
  expect_near(line->at(1).first, {1, 2, 0}, 0, "mean of both sides");
  expect_near(line->at(1.5).first, {0, 4, 0}, 0, "first");
  expect_near(line->at(0).first, {2, 0, 0}, 0, "first at the beginning");
  expect_near(line->at(3).first, {0, 4, 0}, 0, "first at the end");
  expect_near(line->at(3).position, {2, 8, 0}, 0, "end");
  expect_near(line->at(9).position, {2, 8, 0}, 0, "clamped");
  expect_near(line->at(1.5).second, {0, 0, 0}, 0, "second");
}

// The natural spline through (0, 0), (1, 1), (2, 0) is y = (3 u - u³) / 2 in [0, 1], mirrored about u = 1.
TEST_F(Seeds, SplineIsTheNaturalOne) {
  const auto spline = spline_seeds({{0, 0, 1}, {1, 1, 1}, {2, 0, 1}});
  EXPECT_EQ(spline->range(), glm::dvec2(0, 2));
  EXPECT_TRUE(spline->corners().empty());
  for (const double u : {0.0, 0.1, 0.5, 0.99, 1.0, 1.3, 2.0}) {
    const double w = u <= 1 ? u : 2 - u, side = u <= 1 ? 1 : -1;
    const SeedPoint p = spline->at(u);
    const std::string at = fmt::format("u = {}", u);
    // A dozen operations on numbers of about 1.
    expect_near(p.position, {u, (3 * w - w * w * w) / 2, 1}, 1e-14, "position at " + at);
    expect_near(p.first, {1, side * (3 - 3 * w * w) / 2, 0}, 1e-14, "first at " + at);
    expect_near(p.second, {0, -3 * w, 0}, 1e-14, "second at " + at);
  }
}

// On many points: goes through them, and c, c' and c'' are continuous at each; derivatives agree with differences.
TEST_F(Seeds, SplineIsSmooth) {
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 40; i++) points.emplace_back(std::sin(i), std::cos(2.3 * i), 0.1 * i * std::sin(3 * i));
  const auto spline = spline_seeds(points);
  const double h = 1e-5;
  for (std::size_t i = 0; i < points.size(); i++) expect_near(spline->at(double(i)).position, points[i], 1e-12, "knot");
  for (std::size_t i = 1; i + 1 < points.size(); i++) {
    const SeedPoint before = spline->at(double(i) - 1e-9), behind = spline->at(double(i) + 1e-9);
    // 2e-9 of u times third derivatives of about 100.
    expect_near(before.first, behind.first, 1e-6, "c'");
    expect_near(before.second, behind.second, 1e-6, "c''");
  }
  for (double u = 0.055; u < 38.9; u += 0.37) {  // never a knot, where c''' jumps
    const SeedPoint here = spline->at(u), less = spline->at(u - h), more = spline->at(u + h);
    // Central differences: h² times third derivatives, and the rounding of positions over h and of slopes over h.
    expect_near((more.position - less.position) / (2 * h), here.first, 1e-7, "c'");
    expect_near((more.first - less.first) / (2 * h), here.second, 1e-7, "c''");
  }
  const auto straight = spline_seeds({{1, 2, 3}, {3, 2, 1}});
  expect_near(straight->at(0.25).position, {1.5, 2, 2.5}, 1e-15, "two points");
  expect_near(straight->at(0.25).first, {2, 0, -2}, 1e-15, "two points");
}

TEST_F(Seeds, ExpressionsHaveExactDerivatives) {
  const auto helix = expression_seeds({"r*cos(u)", "r*sin(u)", "u^2"}, {0, 6}, {{"r", 2}});
  for (const double u : {0.0, 1.0, 2.5, 6.0}) {
    const SeedPoint p = helix->at(u);
    // A few roundings of numbers up to 36.
    expect_near(p.position, {2 * std::cos(u), 2 * std::sin(u), u * u}, 1e-14, "position");
    expect_near(p.first, {-2 * std::sin(u), 2 * std::cos(u), 2 * u}, 1e-14, "first");
    expect_near(p.second, {-2 * std::cos(u), -2 * std::sin(u), 2}, 1e-14, "second");
  }
  // A curve may have a place and no tangent; only who wants tangents need mind.
  const auto root = expression_seeds({"u", "sqrt(u)", "0"}, {0, 1}, {});
  EXPECT_EQ(root->at(0).position, glm::dvec3(0.0));
  EXPECT_FALSE(std::isfinite(root->at(0).first.y));
}

TEST_F(Seeds, SampleSpreadsEvenlyInU) {
  const auto line = polyline_seeds({{0, 0, 0}, {1, 0, 0}, {1, 3, 0}});
  const FlowSeeds five = line->sample(5);
  ASSERT_EQ(five.positions.size(), 5u);
  ASSERT_EQ(five.tangents.size(), 5u);
  ASSERT_EQ(five.second_tangents.size(), 5u);
  const glm::dvec3 truth[] = {{0, 0, 0}, {0.5, 0, 0}, {1, 0, 0}, {1, 1.5, 0}, {1, 3, 0}};
  for (std::size_t i = 0; i < 5; i++) expect_near(five.positions[i], truth[i], 0, "seed");
  expect_near(five.tangents[2], {0.5, 1.5, 0}, 0, "corner");
  EXPECT_EQ(line->sample(1).positions, std::vector<glm::dvec3>{glm::dvec3(1, 0, 0)});
  // Both ends are hit, whatever the rounding of the steps between them.
  const FlowSeeds many = expression_seeds({"u", "0", "0"}, {0.1, 0.7}, {})->sample(12345);
  EXPECT_EQ(many.positions.front().x, 0.1);
  EXPECT_EQ(many.positions.back().x, 0.7);
}

TEST_F(Seeds, FilesOfSeeds) {
  const FlowSeeds table = load_seeds(put("s.csv", "dz,x,y,z,dx,dy\n3,0.1,2,3,1,2\n6,4,5,6,4,5\n"));
  ASSERT_EQ(table.positions.size(), 2u);
  EXPECT_EQ(table.positions[0], glm::dvec3(0.1, 2, 3));  // read as double
  EXPECT_EQ(table.tangents[1], glm::dvec3(4, 5, 6));
  EXPECT_TRUE(table.second_tangents.empty());
  EXPECT_TRUE(load_seeds(put("s.csv", "x,y,z\n1,2,3\n")).tangents.empty());

  const FlowSeeds bare = load_seeds(put("s.json", R"j({"points": [[0, 0, 0], [1, 0, 0], [1, 5, 0]]})j"));
  EXPECT_EQ(bare.positions, (std::vector<glm::dvec3>{{0, 0, 0}, {1, 0, 0}, {1, 5, 0}}));
  EXPECT_EQ(load_seeds(put("s.json", R"j({"points": [[0, 0, 0], [1, 0, 0]], "count": 7})j")).positions.size(), 7u);
  EXPECT_EQ(load_seeds(put("s.json", R"j({"points": [[0, 0, 0], [1, 0, 0]], "spline": true})j")).positions.size(),
            100u);
  const FlowSeeds curve =
      load_seeds(put("s.json", R"j({"position": ["a*cos(u)", "a*sin(u)", 1], "u": [0, "2*pi"], "parameters": {"a": 2},
                         "count": 3}
)j"));
  ASSERT_EQ(curve.positions.size(), 3u);
  expect_near(curve.positions[1], {-2, 0, 1}, 1e-15, "half way round");
  const FlowSeeds of_surface = load_seeds(
      put("s.json", R"j({"kind": "stream", "time": [0, 5], "field": {}, "seed": {"position": ["u", 0, 0], "u": [0, 1]}}
)j"));
  EXPECT_EQ(of_surface.positions.size(), 100u);
}

TEST_F(Seeds, RefusesBadTables) {
  expect_refused("s.csv", "x,y,z\n", {"no point"});
  expect_refused("s.csv", "", {"empty", "x,y,z"});
  expect_refused("s.csv", "x,y\n1,2\n", {"no column \"z\""});
  expect_refused("s.csv", "x,y,z,dx,dy\n1,2,3,4,5\n", {"dx,dy,dz"});
  expect_refused("s.csv", "x,y,z\n1,2,3\n1,nan,3\n", {"row 2", "not finite"});
  expect_refused("s.csv", "x,y,z\n1,2,3\n1,1e400,3\n", {"row 2", "not finite"});
  expect_refused("s.csv", "x,y,z,dx,dy,dz\n1,2,3,inf,0,0\n", {"row 1", "tangent", "not finite"});
  expect_refused("s.csv", "x,y,z\n1,two,3\n", {"line 2", "two"});
  expect_refused("s.txt", "x,y,z\n1,2,3\n", {".csv", ".json"});
  EXPECT_NE(refusal(ErrorCode::input, [] { load_seeds("missing.csv"); }).find("missing.csv"), std::string::npos);
  EXPECT_NE(refusal(ErrorCode::input, [] { load_seeds("missing.json"); }).find("missing.json"), std::string::npos);
}

TEST_F(Seeds, RefusesBadCurves) {
  const auto refused = [&](const std::string& text, const std::vector<std::string>& words) {
    expect_refused("s.json", text, words);
  };
  refused("[1]", {"points", "position"});
  refused("{", {"JSON"});
  refused("{}", {"points", "position"});
  refused(R"j({"points": []})j", {"points", "none"});
  refused(R"j({"points": [[0, 0, 0]]})j", {"points", "is one", "CSV"});
  refused(R"j({"points": [[0, 0, 0], [0, 0]]})j", {"points[1]", "three numbers"});
  refused(R"j({"points": [[0, 0, 0], [1, 0, 0], [1, 0, 0]]})j", {"points 1 and 2 are the same"});
  refused(R"j({"points": [[0, 0, 0], [1, 0, "x"]]})j", {"points[1]"});
  refused(R"j({"points": 3})j", {"points", "list"});
  refused(R"j({"points": [[0, 0, 0], [1, 0, 0]], "spline": 1})j", {"spline", "true or false"});
  refused(R"j({"points": [[0, 0, 0], [1, 0, 0]], "splin": true})j", {"splin", "known here"});
  refused(R"j({"points": [[0, 0, 0], [1, 0, 0]], "count": 0})j", {"count", "whole number"});
  refused(R"j({"points": [[0, 0, 0], [1, 0, 0]], "count": 2.5})j", {"count", "2.5"});
  refused(R"j({"points": [[0, 0, 0], [1, 0, 0]], "count": "3"})j", {"count"});
  refused(R"j({"position": ["u", "0", "0"]})j", {"\"u\"", "missing"});
  refused(R"j({"position": ["u", "0"], "u": [0, 1]})j", {"position", "three"});
  refused(R"j({"position": ["u", "x", "0"], "u": [0, 1]})j", {"position[1]", "\"x\""});
  refused(R"j({"position": ["u", "2*", "0"], "u": [0, 1]})j", {"position[1]", "2*"});
  refused(R"j({"position": ["u", true, "0"], "u": [0, 1]})j", {"position[1]", "true"});
  refused(R"j({"position": ["u", "log(u)", "0"], "u": [-1, 1]})j", {"position[1]", "undefined at u = -1"});
  refused(R"j({"position": ["1", "2", "3"], "u": [0, 1]})j", {"position", "the point (1, 2, 3)"});
  refused(R"j({"position": ["u", "0", "0"], "u": [1, 0]})j", {"\"u\"", "reversed"});
  refused(R"j({"position": ["u", "0", "0"], "u": [1, 1]})j", {"\"u\"", "empty"});
  refused(R"j({"position": ["u", "0", "0"], "u": [0, "1/0"]})j", {"u[1]", "finite"});
  refused(R"j({"position": ["b*u", "0", "0"], "u": [0, 1]})j", {"position[0]", "b"});
  refused(R"j({"kind": "stream", "seed": {"position": ["u", "0", "0"]}})j", {"seed.u", "missing"});
  refused(R"j({"kind": "stream"})j", {"seed", "missing"});
}

}  // namespace
}  // namespace smurf
