// The program `smurf`, run as a user runs it: what it writes, and how it refuses what it cannot use.
//
// The volumes are made here: a ball, f = 1 - |p|, and a ramp, f = z, on [-1.5, 1.5]³.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "harness/command_line.hpp"
#include "io/png.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;

constexpr int nodes = 25;
constexpr double reach = 1.5;

using test::Csv;
using test::Outcome;
using test::text_of;

// Every test has the inputs that most of them read.
class Cli : public test::CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    write_volume("ball.nrrd", [](double x, double y, double z) { return 1 - std::sqrt(x * x + y * y + z * z); });
    write("ball.json", describe(R"("isovalue": 0.2)", "ball.nrrd"));
    write("rays.csv", "ox,oy,oz,dx,dy,dz\n0,-3,0,0,1,0\n0.3,-3,0.1,0,2,0\n1.4,-3,1.4,0,1,0\n");
    write("points.csv", "x,y,z\n0.5,0.25,0.125\n0,-0.8,0\n9,9,9\n");
  }

  static std::string describe(const std::string& isovalue, const std::string& volume,
                              const std::string& reconstruction = "tricubic") {
    return R"({"kind": "isosurface", )" + isovalue + R"(, "field": {"kind": "grid", "file": ")" + volume +
           R"(", "reconstruction": ")" + reconstruction + "\"}}\n";
  }

  static std::string header(const std::string& sizes = "25 25 25", const std::string& spacings = "0.125 0.125 0.125") {
    return "NRRD0004\ntype: float\ndimension: 3\nsizes: " + sizes + "\nspacings: " + spacings +
           "\nendian: little\nencoding: raw\n\n";
  }

  // In node order, x fastest; spacings are exact in binary, and the nodes of the ball are centred by an origin.
  void write_volume(const std::string& name, const std::function<double(double, double, double)>& f) const {
    std::string bytes =
        "NRRD0004\ntype: float\ndimension: 3\nspace dimension: 3\nsizes: 25 25 25\n"
        "space directions: (0.125,0,0) (0,0.125,0) (0,0,0.125)\nspace origin: (-1.5,-1.5,-1.5)\n"
        "endian: little\nencoding: raw\n\n";
    const double step = 2 * reach / (nodes - 1);
    for (int k = 0; k < nodes; k++)
      for (int j = 0; j < nodes; j++)
        for (int i = 0; i < nodes; i++) {
          const float value = float(f(i * step - reach, j * step - reach, k * step - reach));
          bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
        }
    write(name, bytes);
  }

  // The cast of this description is refused.
  void expect_description_refused(const std::string& description, std::vector<std::string> words) const {
    write("bad.json", description);
    words.push_back("bad.json");
    expect_refused("cast " + in("bad.json") + " --rays " + in("rays.csv") + " --device reference -o " + in("hits.csv"),
                   words);
  }

  void expect_rays_refused(const std::string& rays, std::vector<std::string> words, const std::string& device) const {
    write("bad.csv", rays);
    words.push_back("bad.csv");
    expect_refused(
        "cast " + in("ball.json") + " --rays " + in("bad.csv") + " --device " + device + " -o " + in("hits.csv"),
        words);
  }
};

// What runs on every device.
class CliOnDevice : public Cli, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    Cli::SetUp();
    device_ = GetParam();
    if (!test::has_device(device_)) GTEST_SKIP() << "no device " << device_;
  }
  std::string on_device() const { return " --device " + device_ + " "; }
  std::string device_;
};

INSTANTIATE_TEST_SUITE_P(Devices, CliOnDevice, testing::ValuesIn(test::devices_to_try), test::device_name);

TEST_P(CliOnDevice, CastWritesTheColumnsOfTheContract) {
  const Outcome outcome =
      run("cast " + in("ball.json") + " --rays " + in("rays.csv") +
          " --properties normal,gauss,mean,principal,directions" + on_device() + "-o " + in("hits.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const Csv hits(file("hits.csv"));
  EXPECT_EQ(hits.header, "ray,t,status,x,y,z,nx,ny,nz,gauss,mean,k1,k2,d1x,d1y,d1z,d2x,d2y,d2z,uncertainty");
  ASSERT_EQ(hits.rows.size(), 4u);  // the third ray misses
  for (std::size_t row = 0; row < 4; row++) {
    EXPECT_EQ(hits.text(row, "ray"), row < 2 ? "0" : "1");
    EXPECT_EQ(hits.text(row, "status"), "isolated");
  }
  // A cubic B-spline through the distances at nodes 0.125 apart is this near to a ball of radius 0.8.
  EXPECT_NEAR(hits.number(0, "t"), 2.2f, 1e-3);
  EXPECT_NEAR(hits.number(1, "t"), 3.8f, 1e-3);
  EXPECT_NEAR(hits.number(0, "y"), -0.8f, 1e-3);
  EXPECT_NEAR(hits.number(0, "ny"), -1.0f, 1e-3);
  EXPECT_NEAR(hits.number(1, "ny"), 1.0f, 1e-3);
  EXPECT_NEAR(hits.number(0, "k1"), 1.25f, 0.05);
  EXPECT_NEAR(hits.number(0, "gauss"), 1.5625f, 0.1);
  // t is measured along the direction as given: the second ray's has length 2.
  EXPECT_NEAR(hits.number(2, "y"), -3 + 2 * hits.number(2, "t"), 1e-5);
}

TEST_P(CliOnDevice, FirstHitsAreTheFirstOfAllHits) {
  for (const std::string which : {"first", "all"}) {
    const Outcome outcome = run("cast " + in("ball.json") + " --hits " + which + " --rays " + in("rays.csv") +
                                on_device() + "-o " + in(which + ".csv"));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
  }
  const Csv first(file("first.csv")), all(file("all.csv"));
  ASSERT_EQ(first.rows.size(), 2u);
  ASSERT_EQ(all.rows.size(), 4u);
  EXPECT_NEAR(first.number(0, "t"), all.number(0, "t"), 1e-5);
  EXPECT_NEAR(first.number(1, "t"), all.number(2, "t"), 1e-5);
}

TEST_P(CliOnDevice, AnyAndNumberOfHits) {
  for (const std::string which : {"any", "count"}) {
    const Outcome outcome = run("cast " + in("ball.json") + " --hits " + which + " --rays " + in("rays.csv") +
                                on_device() + "-o " + in(which + ".csv"));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
  }
  EXPECT_EQ(text_of(file("any.csv")), "ray,hit,flagged\n0,1,0\n1,1,0\n2,0,0\n");
  EXPECT_EQ(text_of(file("count.csv")), "ray,count,flagged\n0,2,0\n1,2,0\n2,0,0\n");
}

TEST_P(CliOnDevice, LinesOfCurvature) {
  write("torus.json", R"text({"kind": "implicit", "equation": "(x^2+y^2+z^2+0.84)^2-4*(x^2+y^2)",
                          "domain": [[-1.5,-1.5,-0.5], [1.5,1.5,0.5]]})text");
  write("seeds.csv", "x,y,z\n1.4,0,0\n0,0.6,0\n9,9,9\n");
  const std::string lines =
      "lines " + in("torus.json") + " --points " + in("seeds.csv") + " --principal 1 --length 0.5 --both --step 0.05";
  const Outcome outcome = run(lines + on_device() + "-o " + in("lines.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Csv rows(file("lines.csv"));
  EXPECT_EQ(text_of(file("lines.csv")).substr(0, 36), "line,step,status,x,y,z,k1,k2,arc\n0,0");
  ASSERT_EQ(rows.rows.size(), 21u + 21u + 1u);
  for (std::size_t i = 0; i < 21; i++) {
    EXPECT_NEAR(std::hypot(std::hypot(rows.number(i, "x"), rows.number(i, "y")) - 1, rows.number(i, "z")), 0.4, 1e-5);
    EXPECT_NEAR(rows.number(i, "arc"), 0.05 * double(i) - 0.5, 1e-5);
    EXPECT_NEAR(rows.number(i, "k1"), 2.5, 1e-3);
  }
  ASSERT_EQ(run(lines + on_device() + "-o " + in("lines.vtp")).code, 0);
  EXPECT_NE(text_of(file("lines.vtp")).find("NumberOfLines=\"2\""), std::string::npos);
}

TEST_P(CliOnDevice, DistanceAndInside) {
  const Outcome outcome = run("probe " + in("ball.json") + " --points " + in("points.csv") +
                              " --properties distance,inside" + on_device() + "-o " + in("out.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Csv out(file("out.csv"));
  EXPECT_NEAR(out.number(0, "distance"), 0.8 - std::sqrt(0.328125), 2e-3);
  EXPECT_NEAR(out.number(1, "distance"), 0, 2e-3);
  EXPECT_NEAR(out.number(2, "distance"), std::sqrt(243.0) - 0.8, 2e-3);
  EXPECT_EQ(out.number(0, "inside"), 1);
}

TEST_P(CliOnDevice, NumbersReadBackToTheSameFloat) {
  // The hits, cast again as rays from themselves, print the same digits: writing and reading lose nothing.
  ASSERT_EQ(run("cast " + in("ball.json") + " --rays " + in("rays.csv") + on_device() + "-o " + in("hits.csv")).code,
            0);
  const Csv hits(file("hits.csv"));
  std::string points = "x,y,z\n";
  for (std::size_t row = 0; row < hits.rows.size(); row++)
    points += hits.text(row, "x") + "," + hits.text(row, "y") + "," + hits.text(row, "z") + "\n";
  write("again.csv", points);
  ASSERT_EQ(run("probe " + in("ball.json") + " --points " + in("again.csv") + on_device() + "-o " + in("out.csv")).code,
            0);
  const Csv out(file("out.csv"));
  ASSERT_EQ(out.rows.size(), hits.rows.size());
  for (std::size_t row = 0; row < hits.rows.size(); row++) {
    for (const std::string name : {"x", "y", "z"}) EXPECT_EQ(out.text(row, name), hits.text(row, name));
    EXPECT_NEAR(out.number(row, "value"), 0.2, 1e-5);  // the hits are on the surface
  }
}

TEST_P(CliOnDevice, ProbeTellsPropertiesAndStatus) {
  const Outcome outcome =
      run("probe " + in("ball.json") + " --points " + in("points.csv") + on_device() + "-o " + in("out.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Csv out(file("out.csv"));
  EXPECT_EQ(out.header, "x,y,z,status,value,nx,ny,nz,gauss,mean");
  ASSERT_EQ(out.rows.size(), 3u);
  const double radius = std::sqrt(0.5 * 0.5 + 0.25 * 0.25 + 0.125 * 0.125);
  EXPECT_NEAR(out.number(0, "value"), 1 - radius, 1e-3);
  EXPECT_NEAR(out.number(0, "nx"), 0.5 / radius, 1e-2);
  EXPECT_TRUE(out.text(0, "status") == "regular" || out.text(0, "status") == "umbilic") << out.text(0, "status");
  EXPECT_NE(out.text(2, "status").find("undefined"), std::string::npos) << "outside of the domain";
  EXPECT_TRUE(std::isnan(out.number(2, "value")));
}

TEST_P(CliOnDevice, ProbeTellsCreases) {
  write("cube.json",
        R"({"kind": "implicit", "equation": "max(max(abs(x),abs(y)),abs(z))-1", "domain": [[-2,-2,-2],[2,2,2]]})");
  write("places.csv", "x,y,z\n1,0.25,0\n1,-1,0.5\n0,0,3\n");
  const std::string probe = "probe " + in("cube.json") + " --points " + in("places.csv") + on_device();
  const Outcome outcome = run(probe + "-o " + in("out.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Csv out(file("out.csv"));
  ASSERT_EQ(out.rows.size(), 3u);
  // Planes are umbilic.
  EXPECT_EQ(out.text(0, "status"), "umbilic");
  EXPECT_EQ(out.text(1, "status"), "umbilic+crease");
  EXPECT_EQ(out.number(1, "nx"), 1) << "one side's normal";
  EXPECT_EQ(out.text(2, "status"), "undefined") << "outside of the domain";
  ASSERT_EQ(run(probe + "-o " + in("out.vtp")).code, 0);
  EXPECT_NE(text_of(file("out.vtp")).find("NumberOfPoints=\"3\""), std::string::npos);
}

TEST_P(CliOnDevice, CastsAUsersOwnSource) {
  write("own.inc", "FN real black_box(real x, real y, real z) { return x * x + y * y + z * z - 0.64f; }\n");
  const std::string rest = R"("equation": "x^2+y^2+z^2-0.64", "domain": [[-1.5, -1.5, -1.5], [1.5, 1.5, 1.5]]})";
  write("own.json", R"({"kind": "implicit", "source": "own.inc", )" + rest);
  const Outcome outcome = run("cast " + in("own.json") + " --rays " + in("rays.csv") +
                              " --hits all --properties normal,mean" + on_device() + "-o " + in("hits.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Csv hits(file("hits.csv"));
  ASSERT_EQ(hits.rows.size(), 4u);
  for (std::size_t i = 0; i < 4; i++) EXPECT_EQ(hits.text(i, "status"), "bracketed");
  EXPECT_NEAR(hits.number(0, "t"), 2.2f, 1e-5f);
  EXPECT_NEAR(hits.number(1, "t"), 3.8f, 1e-5f);
  EXPECT_NEAR(hits.number(0, "ny"), -1.0f, 1e-5f);
  EXPECT_NEAR(hits.number(0, "mean"), 1.25f, 1e-3f);
  const Outcome info = run("info " + in("own.json"));
  EXPECT_NE(info.out.find("black box"), std::string::npos) << info.out;
  EXPECT_NE(info.out.find("roots between samples may be missed"), std::string::npos) << info.out;
}

TEST_P(CliOnDevice, WritesVtp) {
  const Outcome outcome = run("cast " + in("ball.json") + " --rays " + in("rays.csv") + " --properties normal" +
                              on_device() + "-o " + in("hits.vtp"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::string text = text_of(file("hits.vtp"));
  EXPECT_NE(text.find("<VTKFile"), std::string::npos);
  EXPECT_NE(text.find("PolyData"), std::string::npos);
  EXPECT_NE(text.find("NumberOfPoints=\"4\""), std::string::npos) << text.substr(0, 400);
}

TEST_P(CliOnDevice, NoSurfaceIsAnEmptyResult) {
  write("outside.json", describe(R"("isovalue": 1000)", "ball.nrrd"));
  const Outcome cast = run("cast " + in("outside.json") + " --properties normal --rays " + in("rays.csv") +
                           on_device() + "-o " + in("hits.csv"));
  ASSERT_EQ(cast.code, 0) << cast.err;
  EXPECT_EQ(text_of(file("hits.csv")), "ray,t,status,x,y,z,nx,ny,nz,uncertainty\n");
  const Outcome render =
      run("render " + in("outside.json") + " --shade gauss,phong --size 40x30" + on_device() + "-o " + in("empty.png"));
  ASSERT_EQ(render.code, 0) << render.err;
  write("none.csv", "ox,oy,oz,dx,dy,dz\n");
  const Outcome none =
      run("cast " + in("ball.json") + " --rays " + in("none.csv") + on_device() + "-o " + in("no_rays.csv"));
  ASSERT_EQ(none.code, 0) << none.err;
  EXPECT_EQ(text_of(file("no_rays.csv")), "ray,t,status,x,y,z,uncertainty\n");
}

TEST_P(CliOnDevice, SamplesThatAreNotFiniteAreAllowed) {
  write_volume("holes.nrrd", [](double x, double y, double z) {
    return x > 1.3 ? std::numeric_limits<double>::quiet_NaN() : 1 - std::sqrt(x * x + y * y + z * z);
  });
  write("holes.json", describe(R"("isovalue": 0.2)", "holes.nrrd", "catmull-rom"));
  const Outcome cast =
      run("cast " + in("holes.json") + " --rays " + in("rays.csv") + on_device() + "-o " + in("hits.csv"));
  ASSERT_EQ(cast.code, 0) << cast.err;
  EXPECT_EQ(Csv(file("hits.csv")).rows.size(), 4u);  // far from the holes
  const Outcome info = run("info " + in("holes.json") + on_device());
  ASSERT_EQ(info.code, 0) << info.err;
  // Two planes of nodes are beyond x = 1.3.
  EXPECT_NE(info.out.find(std::to_string(2 * nodes * nodes)), std::string::npos) << info.out;
}

TEST_P(CliOnDevice, RenderWritesAPngOfTheAskedSize) {
  for (const std::string shade : {"phong", "contour", "normal", "gauss,phong", "k2", "depth,phong"}) {
    SCOPED_TRACE(shade);
    const Outcome outcome = run("render " + in("ball.json") + " --shade " + shade +
                                " --size 64x48 --samples 1 --eye -1,-4,2 --look-at 0,0,0 --up 0,0,1 --fov 40" +
                                on_device() + "-o " + in("image.png"));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Image image = load_png(file("image.png"));
    EXPECT_EQ(image.width, 64);
    EXPECT_EQ(image.height, 48);
    // The corner shows the background, the middle the ball.
    const auto* corner = &image.rgba[0];
    const auto* middle = &image.rgba[(24 * 64 + 32) * 4];
    if (shade != "contour") EXPECT_FALSE(std::equal(corner, corner + 3, middle));
    else EXPECT_EQ(corner[0] + middle[0], 0);  // seen head on there is no contour
  }
}

TEST_P(CliOnDevice, InfoTellsWhatTheSurfaceIs) {
  const Outcome outcome = run("info " + in("ball.json") + on_device());
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const std::string word : {"isosurface", "25", "float", "-1.5", "1.5", "device memory"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " is not in: " << outcome.out;
}

TEST_P(CliOnDevice, VerboseTellsDeviceAndRate) {
  const Outcome outcome =
      run("-v cast " + in("ball.json") + " --rays " + in("rays.csv") + on_device() + "-o " + in("hits.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  for (const std::string word : {"device: ", "rays/s"})
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
  if (device_ != "reference") {
    for (const std::string word : {"compiled", "find_hits"})
      EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
  }
}

TEST_P(CliOnDevice, CompareTellsErrorsAndOrders) {
  write("sphere.json",
        R"({"kind": "implicit", "equation": "sqrt(x^2+y^2+z^2)-1", "domain": [[-1.5,-1.5,-1.5],[1.5,1.5,1.5]]})");
  const Outcome outcome =
      run("compare " + in("sphere.json") + " --resolutions 20,40 --rays 200" + on_device() + "-o " + in("table.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  for (const std::string word : {"trilinear", "catmull-rom", "tricubic", "order", "missed", "invented", "Left out"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " is not in: " << outcome.out;
  const Csv table(file("table.csv"));
  EXPECT_EQ(table.header,
            "reconstruction,resolution,step,points,roots,missed,invented,undecided,lost,undefined,not_finite,"
            "location_rms,location_max,location_order,normal_rms,normal_max,normal_order,mean_rms,mean_max,mean_order,"
            "gauss_rms,gauss_max,gauss_order,chord_rms,chord_max,chord_order,exact_mean_rms,exact_gauss_rms,margin");
  ASSERT_EQ(table.rows.size(), 6u);
  EXPECT_EQ(table.text(1, "reconstruction"), "trilinear");
  EXPECT_EQ(table.text(1, "resolution"), "40");
  EXPECT_TRUE(std::isnan(table.number(0, "location_order")));
  EXPECT_NEAR(table.number(1, "location_order"), 2, 0.4);
  EXPECT_NEAR(table.number(5, "location_order"), 4, 0.5);
  EXPECT_NEAR(table.number(5, "mean_order"), 2, 0.4);
  EXPECT_NEAR(table.number(5, "exact_mean_rms"), 1, 1e-5);
}

TEST_P(CliOnDevice, RefusesRaysThatCannotBeCast) {
  const std::string device = device_;
  const std::string head = "ox,oy,oz,dx,dy,dz\n0,-3,0,0,1,0\n";
  expect_rays_refused(head + "0,0,0,0,0,0\n", {"line 3", "direction"}, device);
  expect_rays_refused(head + "\nnan,0,0,0,1,0\n", {"line 4"}, device);
  expect_rays_refused(head + "0,0,0,0,inf,0\n", {"line 3"}, device);
  expect_rays_refused("ox,oy,oz,dx,dy,dz,tmin,tmax\n0,-3,0,0,1,0,2,1\n", {"line 2", "tmin"}, device);
}

TEST_F(Cli, DevicesListsTheReference) {
  const Outcome outcome = run("devices");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("reference:0"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("double"), std::string::npos) << outcome.out;
}

TEST_F(Cli, HelpAndVersionSucceed) {
  EXPECT_EQ(run("--help").code, 0);
  EXPECT_EQ(run("cast --help").code, 0);
  EXPECT_NE(run("--version").out.find("smurf"), std::string::npos);
}

TEST_F(Cli, RefusesWrongUsage) {
  const std::string cast = "cast " + in("ball.json") + " --rays " + in("rays.csv") + " --device reference";
  const std::string probe = "probe " + in("ball.json") + " --points " + in("points.csv") + " --device reference";
  const std::string render = "render " + in("ball.json") + " --device reference";
  expect_refused("", {"--help"});
  expect_refused("dance", {"--help"});
  expect_refused(cast, {"--output"});
  expect_refused("cast " + in("ball.json") + " -o " + in("hits.csv"), {"--rays"});
  expect_refused(cast + " --hits some -o " + in("hits.csv"), {"--hits"});
  expect_refused(cast + " --hits count --properties normal -o " + in("hits.csv"), {"--hits count", "--properties"});
  expect_refused(cast + " --hits any -o " + in("hits.vtp"), {"hits.vtp", ".csv"});
  expect_refused(cast + " --properties distance -o " + in("hits.csv"), {"distance", "probe"});
  const std::string lines = "lines " + in("ball.json") + " --points " + in("points.csv") + " --device reference";
  expect_refused(lines + " -o " + in("lines.csv"), {"--length"});
  expect_refused(lines + " --length -1 -o " + in("lines.csv"), {"length", "-1"});
  expect_refused(lines + " --length 1 --principal 3 -o " + in("lines.csv"), {"--principal"});
  expect_refused(cast + " --no-such-option -o " + in("hits.csv"), {"--no-such-option"});
  expect_refused(cast + " --lanes 3 -o " + in("hits.csv"), {"--lanes"});
  expect_refused(cast + " -o " + in("hits.txt"), {"hits.txt", ".csv"});
  expect_refused(cast + " -o " + in("nowhere/hits.csv"), {"nowhere"});
  expect_refused(probe + " -o " + in("nowhere/out.csv"), {"nowhere"});
  expect_refused(render + " -o " + in("nowhere/image.png"), {"nowhere"});
  expect_refused(render + " -o " + in("image.jpg"), {".png"});
  expect_refused(render + " --size 64 -o " + in("image.png"), {"--size"});
  expect_refused(render + " --size 0x64 -o " + in("image.png"), {"--size"});
  expect_refused(render + " --shade glitter -o " + in("image.png"), {"glitter", "phong"});
  expect_refused(render + " --shade gauss,mean -o " + in("image.png"), {"gauss", "mean"});
  expect_refused(render + " --eye 1,2 -o " + in("image.png"), {"--eye"});
  expect_refused(render + " --eye 0,0,0 --look-at 0,0,0 -o " + in("image.png"), {"eye"});
  expect_refused(render + " --range 2,1 -o " + in("image.png"), {"--range"});
}

TEST_F(Cli, RefusesUnknownPropertiesAndDevices) {
  const std::string cast = "cast " + in("ball.json") + " --rays " + in("rays.csv") + " -o " + in("hits.csv");
  expect_refused(cast + " --device reference --properties colour", {"colour", "normal", "gauss", "directions"});
  expect_refused(cast + " --device reference --properties normal,,gauss", {"unknown property"});
  expect_refused(cast + " --device reference --properties parameters", {"parameters", "isosurface"});
  expect_refused(cast + " --device reference --properties normal_curvature", {"normal_curvature", "direction"});
  expect_refused(cast + " --device abacus", {"abacus", "reference"});
  expect_refused(cast + " --device opencl:99", {"opencl:99"});
  expect_refused(cast + " --device vulkan:99", {"vulkan:99"});
  expect_refused(cast + " --device reference:7", {"reference:7"});
}

TEST_F(Cli, RefusesBadDescriptions) {
  expect_refused("info " + in("missing.json"), {"missing.json"});
  expect_description_refused("{\"kind\": \"isosurface\",\n \"isovalue\" 3}", {"line 2", "column"});
  expect_description_refused("", {"JSON"});
  expect_description_refused("[1, 2]", {"object"});
  expect_description_refused(R"({"isovalue": 1})", {"\"kind\"", "missing"});
  expect_description_refused(R"({"kind": "teapot"})", {"teapot", "isosurface"});
  expect_description_refused(R"({"kind": "isosurface", "field": {"kind": "grid", "file": "ball.nrrd"}})",
                             {"\"isovalue\""});
  expect_description_refused(describe(R"("isovalue": "high")", "ball.nrrd"), {"\"isovalue\"", "high"});
  expect_description_refused(describe(R"("isovalue": 1e999)", "ball.nrrd"), {"1e999"});
  expect_description_refused(R"({"kind": "isosurface", "isovalue": 1})", {"\"field\""});
  expect_description_refused(R"({"kind": "isosurface", "isovalue": 1, "field": {"kind": "dream"}})",
                             {"field.kind", "dream", "grid"});
  expect_description_refused(R"({"kind": "isosurface", "isovalue": 1, "field": {"kind": "grid"}})", {"field.file"});
  expect_description_refused(describe(R"("isovalue": 1)", "ball.nrrd", "septic"),
                             {"field.reconstruction", "septic", "trilinear", "tricubic", "catmull-rom"});
  expect_description_refused(
      R"({"kind": "isosurface", "isovalue": 1, "isovalve": 2, "field": {"kind": "grid", "file": "ball.nrrd"}})",
      {"isovalve"});
}

TEST_F(Cli, RefusesBadVolumes) {
  const std::string samples = text_of(file("ball.nrrd")).substr(text_of(file("ball.nrrd")).find("\n\n") + 2);
  const auto refused = [&](const std::string& volume, const std::vector<std::string>& words) {
    write("bad.nrrd", volume);
    std::vector<std::string> all = words;
    all.push_back("bad.nrrd");
    expect_description_refused(describe(R"("isovalue": 0.2)", "bad.nrrd"), all);
  };
  expect_description_refused(describe(R"("isovalue": 0.2)", "missing.nrrd"), {"field.file", "missing.nrrd"});
  refused(header() + samples.substr(0, samples.size() / 2), {});        // truncated
  refused(header("25 25 26") + samples, {});                            // sizes beyond the data
  refused(header("25 25 25", "0.125 0 0.125") + samples, {"spacing"});  // zero
  refused(header("25 25 25", "0.125 -0.125 0.125") + samples, {"spacing"});
  refused("not a volume\n", {});
  refused("", {});
}

TEST_F(Cli, RefusesBadTables) {
  expect_rays_refused("ox,oy,oz,dx,dy,dz\n0,-3,0,0,one,0\n", {"line 2", "dy", "one"}, "reference");
  expect_rays_refused("ox,oy,oz,dx,dy\n0,-3,0,0,1\n", {"dz"}, "reference");
  expect_rays_refused("ox,oy,oz,dx,dy,dz\n0,-3,0,0,1\n", {"line 2"}, "reference");
  expect_rays_refused("", {}, "reference");
  expect_refused("cast " + in("ball.json") + " --rays " + in("missing.csv") + " -o " + in("hits.csv"), {"missing.csv"});
  expect_refused("probe " + in("ball.json") + " --points " + in("rays.csv") + " -o " + in("out.csv"), {"rays.csv"});
}

TEST_F(Cli, CompareRefusesWhatItCannotCompare) {
  const std::string domain = R"("domain": [[-1,-1,-1],[1,1,1]])";
  write("plane.json", R"({"kind": "implicit", "equation": "z", )" + domain + "}");
  write("boundless.json", R"({"kind": "implicit", "equation": "z"})");
  write("nothing.json", R"({"kind": "implicit", "equation": "z-2", )" + domain + "}");
  write("flat.json", R"({"kind": "implicit", "equation": "z", "domain": [[-1,-1,0],[1,1,0]]})");
  write("mesh.json", R"({"kind": "mesh", "file": "bunny.off"})");
  write("table.csv", "precious\n");
  const std::string rest = " --rays 20 --device reference -o " + in("table.csv");
  expect_refused("compare " + in("ball.json") + rest, {"ball.json", "expression"});
  expect_refused("compare " + in("boundless.json") + rest, {"boundless.json", "domain"});
  expect_refused("compare " + in("nothing.json") + rest, {"nothing.json", "nothing to compare"});
  expect_refused("compare " + in("flat.json") + rest, {"flat.json", "along z"});
  expect_refused("compare " + in("mesh.json") + rest, {"mesh.json"});
  expect_refused("compare " + in("missing.json") + rest, {"missing.json"});
  const std::string plane = "compare " + in("plane.json");
  expect_refused(plane + " --resolutions 1,16" + rest, {"from 2"});
  expect_refused(plane + " --resolutions 32,16" + rest, {"ascend"});
  expect_refused(plane + " --resolutions 16,16" + rest, {"ascend"});
  for (const std::string list : {"many", "16,", "16,,32", "16.5", "16,x", "-16", "99999999999"})
    expect_refused(plane + " --resolutions=" + list + rest, {"esolution"});
  expect_refused(plane + " --rays 0 --device reference", {"--rays"});
  expect_refused(plane + " --seed -1" + rest, {"--seed"});
  expect_refused(plane + " --margin 3" + rest, {"margin"});
  expect_refused(plane + " --margin nan" + rest, {"margin"});
  expect_refused(plane + " --apron -1" + rest, {"apron"});
  expect_refused(plane + " --device abacus", {"abacus", "reference"});
  expect_refused(plane + " --device reference -o " + in("table.txt"), {"table.txt", ".csv"});
  expect_refused(plane + " --device reference -o " + in("nowhere/table.csv"), {"nowhere"});
  EXPECT_EQ(text_of(file("table.csv")), "precious\n");
}

TEST_F(Cli, AnOlderResultStaysWhenTheInputIsBad) {
  write("hits.csv", "precious\n");
  write("bad.csv", "ox,oy,oz,dx,dy,dz\n0,0,0,0,0,0\n");
  expect_refused("cast " + in("ball.json") + " --rays " + in("bad.csv") + " --device reference -o " + in("hits.csv"),
                 {"line 2"});
  EXPECT_EQ(text_of(file("hits.csv")), "precious\n");
}

}  // namespace
}  // namespace smurf
