// Stream surfaces as a user meets them: the verbs of `smurf` on every device, by both methods, and what is refused in
// one line.
//
// The flow of (-y, x, 0.3) makes a helicoid of the segment (u, 0, 0): (u cos τ, u sin τ, 0.3 τ), with normal
// (0.3 sin τ, -0.3 cos τ, u) / sqrt(0.09 + u²), Gauss curvature -0.09 / (0.09 + u²)² and mean curvature 0.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <glm/glm.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "harness/command_line.hpp"
#include "io/png.hpp"
#include "smurf/mesh.hpp"

namespace smurf {
namespace {

using test::Csv;
using test::Outcome;
using test::text_of;

constexpr double rise = 0.3;
// By default the surface is within 1e-5 of the extent, 6, of the true one; normals and curvature of the mesh are to
// 1e-3, relative.
constexpr double location_tolerance = 6e-5, property_tolerance = 1e-3;

glm::dvec3 location(double u, double tau) { return {u * std::cos(tau), u * std::sin(tau), rise * tau}; }
glm::dvec3 normal(double u, double tau) {
  return glm::dvec3(rise * std::sin(tau), -rise * std::cos(tau), u) / std::sqrt(rise * rise + u * u);
}
double gauss(double u) { return -rise * rise / std::pow(rise * rise + u * u, 2); }

class StreamCli : public test::CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    write("helicoid.json", description());
    write("back.json", description(R"j(, "method": "back-stream")j"));
  }
  // `more` members, the time and the seed.
  static std::string description(const std::string& more = "", const std::string& time = R"j([0, "2*pi"])j",
                                 const std::string& seed = R"j({"position": ["u", "0", "0"], "u": [0.2, 1.2]})j",
                                 const std::string& vector = R"j(["-y", "x", "0.3"])j") {
    return R"j({"kind": "stream", "field": {"kind": "expression", "vector": )j" + vector +
           R"j(, "domain": [[-3, -3, -3], [3, 3, 3]]}, "time": )j" + time + R"j(, "seed": )j" + seed + more + "}\n";
  }
  std::string on_device() const { return " --device " + device_ + " "; }
  void expect_description_refused(const std::string& text, const std::vector<std::string>& words) const {
    write("bad.json", text);
    write("ray.csv", "ox,oy,oz,dx,dy,dz\n0.5,0.5,-1,0,0,1\n");
    std::vector<std::string> all = words;
    all.push_back("bad.json");
    expect_refused("cast " + in("bad.json") + " --rays " + in("ray.csv") + on_device() + "-o " + in("none.csv"), all);
  }
  std::string device_ = "reference";
};

class StreamCliOnDevice : public StreamCli, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    StreamCli::SetUp();
    device_ = GetParam();
    if (!test::has_device(device_)) GTEST_SKIP() << "no device " << device_;
  }
  // Rays along z at (u, τ) = (0.5, 1) and (0.9, 4), and one that passes the surface by.
  // Hits found on a mesh are `isolated` or `sampled`; the back-stream method also tells `bracketed`.
  void expect_hits(const std::string& surface, const std::vector<std::string>& statuses) const {
    const double places[2][2] = {{0.5, 1}, {0.9, 4}};
    std::string rays = "ox,oy,oz,dx,dy,dz\n";
    for (const auto& [u, tau] : places) {
      const glm::dvec3 p = location(u, tau);
      rays += fmt::format("{},{},-1,0,0,2\n", p.x, p.y);
    }
    write("rays.csv", rays + "2,0,-1,0,0,1\n");
    const Outcome outcome = run("cast " + in(surface) + " --rays " + in("rays.csv") +
                                " --properties normal,gauss,mean,parameters" + on_device() + "-o " + in("hits.csv"));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    const Csv hits(file("hits.csv"));
    EXPECT_EQ(hits.header, "ray,t,status,x,y,z,nx,ny,nz,gauss,mean,u,v,uncertainty");
    ASSERT_EQ(hits.rows.size(), 2u);
    for (std::size_t row = 0; row < 2; row++) {
      const auto [u, tau] = places[row];
      const glm::dvec3 n = normal(u, tau);
      EXPECT_EQ(hits.text(row, "ray"), std::to_string(row));
      EXPECT_TRUE(std::ranges::count(statuses, hits.text(row, "status"))) << hits.text(row, "status");
      EXPECT_NEAR(hits.number(row, "t"), (rise * tau + 1) / 2, location_tolerance);
      EXPECT_NEAR(hits.number(row, "u"), u, 10 * location_tolerance);
      EXPECT_NEAR(hits.number(row, "v"), tau, 10 * location_tolerance);
      EXPECT_NEAR(hits.number(row, "nx"), n.x, property_tolerance);
      EXPECT_NEAR(hits.number(row, "ny"), n.y, property_tolerance);
      EXPECT_NEAR(hits.number(row, "nz"), n.z, property_tolerance);
      EXPECT_NEAR(hits.number(row, "gauss"), gauss(u), property_tolerance * std::abs(gauss(u)));
      EXPECT_NEAR(hits.number(row, "mean"), 0, property_tolerance * std::sqrt(-gauss(u)));
    }
  }
};

INSTANTIATE_TEST_SUITE_P(Devices, StreamCliOnDevice, testing::ValuesIn(test::devices_to_try), test::device_name);

TEST_P(StreamCliOnDevice, CastsOnTheMesh) { expect_hits("helicoid.json", {"isolated", "sampled"}); }

TEST_P(StreamCliOnDevice, CastsBackAlongTheStream) { expect_hits("back.json", {"isolated", "bracketed", "sampled"}); }

TEST_P(StreamCliOnDevice, ProbesPointsAndPlaces) {
  const glm::dvec3 beside = location(0.5, 1) + 0.01 * normal(0.5, 1);
  write("points.csv", fmt::format("x,y,z\n{},{},{}\n", beside.x, beside.y, beside.z));
  write("places.csv", "u,v\n0.5,1\n1.2,0\n");
  const std::string rest = " --properties gauss,parameters,normal" + on_device() + "-o ";
  const Outcome nearest =
      run("probe " + in("helicoid.json") + " --points " + in("points.csv") + rest + in("nearest.csv"));
  ASSERT_EQ(nearest.code, 0) << nearest.err;
  const Csv near(file("nearest.csv"));
  EXPECT_NEAR(near.number(0, "u"), 0.5, 1e-3);
  EXPECT_NEAR(near.number(0, "v"), 1, 1e-3);
  const Outcome placed = run("probe " + in("helicoid.json") + " --points " + in("places.csv") + rest + in("at.csv"));
  ASSERT_EQ(placed.code, 0) << placed.err;
  const Csv at(file("at.csv"));
  ASSERT_EQ(at.rows.size(), 2u);
  EXPECT_NEAR(at.number(0, "gauss"), gauss(0.5), property_tolerance * std::abs(gauss(0.5)));
  EXPECT_NEAR(at.number(1, "gauss"), gauss(1.2), property_tolerance * std::abs(gauss(1.2)));
  EXPECT_NEAR(at.number(1, "ny"), normal(1.2, 0).y, property_tolerance);
}

TEST_P(StreamCliOnDevice, InfoTellsWhatWasDone) {
  const Outcome outcome = run("info " + in("helicoid.json") + on_device());
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const char* word :
       {"stream", "explicit", "streamlines", "cells", "deviation", "gaps", "proved", "device memory"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " is not in: " << outcome.out;
}

// Vertices of binary PLY, and the mesh as the library's own reader sees it.
TEST_P(StreamCliOnDevice, ExportsPolygonsWithExactCurvature) {
  const Outcome outcome = run("export " + in("helicoid.json") + on_device() + "-o " + in("helicoid.ply"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const std::string text = text_of(file("helicoid.ply")), end = "end_header\n";
  const std::size_t header = text.find(end) + end.size();
  const Mesh mesh = load_mesh(file("helicoid.ply"));
  ASSERT_GT(mesh.face_count(), 10u);
  for (std::size_t i = 0; i < mesh.vertex_count(); i++) {
    float row[12];
    std::memcpy(row, text.data() + header + sizeof row * i, sizeof row);
    const glm::dvec3 p(row[0], row[1], row[2]), n(row[3], row[4], row[5]);
    const double u = row[6], tau = row[7];
    EXPECT_GE(u, 0.2f);
    EXPECT_LE(u, 1.2f);
    EXPECT_LT(glm::length(p - location(u, tau)), location_tolerance) << i;
    EXPECT_LT(glm::length(n - normal(u, tau)), property_tolerance) << i;
    EXPECT_NEAR(row[8], gauss(u), property_tolerance * std::abs(gauss(u))) << i;
    const double k = std::sqrt(-gauss(u));
    EXPECT_NEAR(row[9], 0, property_tolerance * k) << i;
    EXPECT_NEAR(row[10], k, property_tolerance * k) << i;
    EXPECT_NEAR(row[11], -k, property_tolerance * k) << i;
  }
  // A disc without a gap or a crack, turned as its normals say.
  const MeshTopology& topology = mesh.topology();
  EXPECT_TRUE(topology.manifold);
  EXPECT_EQ(topology.components, 1u);
  EXPECT_EQ(topology.euler_characteristic, 1);
  EXPECT_EQ(topology.inconsistent_edges, 0u);
  for (const glm::uvec3& face : mesh.faces()) {
    const glm::dvec3 a(mesh.vertices()[face.x]), b(mesh.vertices()[face.y]), c(mesh.vertices()[face.z]);
    EXPECT_GT(glm::cross(b - a, c - a).z, 0);  // normals have z > 0
  }
}

TEST_P(StreamCliOnDevice, ComparesWaysToCurvature) {
  const Outcome outcome = run("compare " + in("helicoid.json") + " --rays 500" + on_device() + "-o " + in("table.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const char* word : {"interpolated", "mesh", "neighbours", "integrated", "sampled"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " is not in: " << outcome.out;
  const Csv table(file("table.csv"));
  ASSERT_EQ(table.rows.size(), 3u);
  EXPECT_EQ(table.text(0, "derivatives"), "interpolated");
  EXPECT_EQ(table.text(1, "derivatives"), "mesh");
  EXPECT_EQ(table.text(2, "derivatives"), "neighbours");
  EXPECT_EQ(table.text(0, "rays"), "500");
  EXPECT_GT(table.number(0, "hits"), 50);
  EXPECT_GT(table.number(0, "places"), 9'000);
  EXPECT_LT(table.number(0, "deviation_max"), location_tolerance);
  EXPECT_LT(table.number(0, "normal_max"), property_tolerance);
  if (GetParam() == std::string("reference")) {
    // It always integrates.
    EXPECT_EQ(table.number(1, "normal_max"), 0);
  } else {
    // The flat mesh is worse than what is interpolated.
    EXPECT_GT(table.number(1, "normal_rms"), table.number(0, "normal_rms"));
    EXPECT_EQ(table.text(1, "flat"), table.text(1, "hits"));
    EXPECT_TRUE(std::isnan(table.number(1, "gauss_rms")));
  }
  // Both curvatures of the truth: K is -9.. to -0.04, H is 0.
  EXPECT_GT(table.number(0, "integrated_gauss_rms"), 0.1);
  EXPECT_LT(table.number(0, "integrated_mean_rms"), 1e-3);
  EXPECT_LT(table.number(0, "gauss_rms"), property_tolerance * table.number(0, "integrated_gauss_rms"));
}

TEST_P(StreamCliOnDevice, RendersAndTraces) {
  const Outcome drawn = run("render " + in("helicoid.json") + " --shade gauss,phong --size 40x30 --samples 1" +
                            on_device() + "-o " + in("picture.png"));
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  const Image picture = load_png(file("picture.png"));
  EXPECT_EQ(picture.width, 40);
  EXPECT_EQ(picture.height, 30);
  write("seeds.csv", "x,y,z\n1,0,0\n");
  const Outcome traced = run("trace " + in("helicoid.json") + " --seeds " + in("seeds.csv") + " --time 1 --ends" +
                             on_device() + "-o " + in("lines.csv"));
  ASSERT_EQ(traced.code, 0) << traced.err;
  const Csv lines(file("lines.csv"));
  EXPECT_NEAR(lines.number(1, "x"), std::cos(1), location_tolerance);
}

TEST_F(StreamCli, RefusesWhatIsNoStreamSurface) {
  write("ball.json", R"({"kind": "implicit", "equation": "x^2+y^2+z^2-1", "domain": [[-2,-2,-2],[2,2,2]]})");
  expect_refused("export " + in("ball.json") + on_device() + "-o " + in("ball.ply"), {"ball.json", "stream surfaces"});
  expect_refused("export " + in("helicoid.json") + on_device() + "-o " + in("h.obj"), {".vtp or .ply"});
  expect_refused("export " + in("missing.json") + on_device() + "-o " + in("h.vtp"), {"missing.json"});
  expect_refused("compare " + in("helicoid.json") + " --apron 3" + on_device() + "-o " + in("t.csv"), {"--apron"});
  expect_refused("compare " + in("helicoid.json") + " --resolutions 8" + on_device() + "-o " + in("t.csv"),
                 {"--resolutions"});
}

TEST_F(StreamCli, RefusesBadDescriptions) {
  expect_description_refused(description("", "[1, 1]"), {"\"time\"", "empty"});
  expect_description_refused(description("", "[2, 1]"), {"\"time\"", "reversed"});
  expect_description_refused(description("", R"j([0, "1/0"])j"), {"time[1]", "finite"});
  expect_description_refused(description(R"j(, "tolerance": 0)j"), {"tolerance", "positive"});
  expect_description_refused(description(R"j(, "method": "implicit")j"), {"method", "explicit", "back-stream"});
  expect_description_refused(description(R"j(, "derivatives": "exact")j"), {"derivatives", "interpolated"});
  expect_description_refused(description(R"j(, "polish": 1)j"), {"polish", "true or false"});
  expect_description_refused(description(R"j(, "steps": 1)j"), {"steps"});
  expect_description_refused(description("", "[0, 1]", R"j({"points": [[1, 0, 0]]})j"), {"seed", "two"});
}

// What only tracing tells.
TEST_P(StreamCliOnDevice, RefusesSeedsWithoutASurface) {
  const std::string time = "[0, 1]";
  expect_description_refused(description("", time, R"j({"points": [[5, 0, 0], [6, 0, 0]]})j"), {"seed", "no place"});
  expect_description_refused(description("", time, R"j({"points": [[0, 0, 0], [0, 0, 1]]})j"), {"seed", "along"});
  expect_description_refused(
      description("", time, R"j({"points": [[1, 0, 0], [2, 0, 0]]})j", R"j(["0*x", "0*y", "0*z"])j"), {"zero"});
}

}  // namespace
}  // namespace smurf
