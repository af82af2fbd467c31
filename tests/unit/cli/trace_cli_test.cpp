// Streamlines as a user meets them: `smurf trace` on every device, `info` and `render` of vector fields by the
// reference, and what is refused in one line.
//
// The flow of (-y, x, 0.3) is known: it turns about z by the angle t, and rises by 0.3 t.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "harness/command_line.hpp"
#include "harness/devices.hpp"
#include "io/png.hpp"
#include "io/vtk/vtk_files.hpp"

namespace smurf {
namespace {

using test::Csv;
using test::Outcome;
using test::text_of;

// Lines of files are floats, of numbers below 4, and by default a step of the integrator may err by 1e-6 of the extent,
// 6e-6, some tens of times along a line; errors of the reference are far below.
constexpr double tolerance = 1e-4;

class TraceCli : public test::CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    write("turn.json", field(R"j(["-y", "x", "0.3"])j"));
    write("seeds.csv", "x,y,z\n1,0,0\n0,2,0.5\n0.5,0,2.5\n");
    write("curve.json", R"j({"position": ["1 + u^2", "u", "0"], "u": [0, 1], "count": 5})j");
  }
  static std::string field(const std::string& vector, const std::string& domain = "[[-3, -3, -3], [3, 3, 3]]") {
    return R"j({"kind": "expression", "vector": )j" + vector + R"j(, "domain": )j" + domain + "}\n";
  }
  std::string command(const std::string& rest, const std::string& file = "turn.json",
                      const std::string& seeds = "seeds.csv") const {
    return "trace " + in(file) + " --seeds " + in(seeds) + " " + rest + " --device " + device_ + " -o " +
           in("lines.csv");
  }
  Csv traced(const std::string& rest, const std::string& file = "turn.json",
             const std::string& seeds = "seeds.csv") const {
    const Outcome outcome = run(command(rest, file, seeds));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    return Csv(this->file("lines.csv"));
  }
  // What a line's last row says.
  static std::vector<std::string> ends(const Csv& lines) {
    std::vector<std::string> found;
    for (std::size_t row = 0; row < lines.rows.size(); row++) {
      const bool first = row == 0 || lines.text(row, "line") != lines.text(row - 1, "line");
      const bool last = row + 1 == lines.rows.size() || lines.text(row, "line") != lines.text(row + 1, "line");
      if (last) found.push_back(lines.text(row, "status"));
      EXPECT_TRUE(first || last || lines.text(row, "status") == "inside") << row;
    }
    return found;
  }
  std::string device_ = "reference";
  static void expect_turned(const Csv& lines, std::size_t row, const glm::dvec3& seed) {
    const double t = lines.number(row, "t");
    EXPECT_NEAR(lines.number(row, "x"), seed.x * std::cos(t) - seed.y * std::sin(t), tolerance) << row;
    EXPECT_NEAR(lines.number(row, "y"), seed.x * std::sin(t) + seed.y * std::cos(t), tolerance) << row;
    EXPECT_NEAR(lines.number(row, "z"), seed.z + 0.3 * t, tolerance) << row;
  }
};

const glm::dvec3 three_seeds[] = {{1, 0, 0}, {0, 2, 0.5}, {0.5, 0, 2.5}};

// What runs on every device.
class TraceCliOnDevice : public TraceCli, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    TraceCli::SetUp();
    device_ = GetParam();
    if (!test::has_device(device_)) GTEST_SKIP() << "no device " << device_;
  }
};

INSTANTIATE_TEST_SUITE_P(Devices, TraceCliOnDevice, testing::ValuesIn(test::devices_to_try), test::device_name);

TEST_P(TraceCliOnDevice, WritesTheColumnsOfTheContract) {
  const Csv lines = traced("--time 6");
  EXPECT_EQ(lines.header, "line,t,status,x,y,z");
  EXPECT_EQ(ends(lines), (std::vector<std::string>{"time", "time", "domain"}));
  for (std::size_t row = 0; row < lines.rows.size(); row++) {
    const std::size_t line = std::stoul(lines.text(row, "line"));
    expect_turned(lines, row, three_seeds[line]);
    if (row == 0 || lines.text(row - 1, "line") != lines.text(row, "line")) {
      EXPECT_EQ(lines.number(row, "t"), 0);
      EXPECT_EQ(lines.number(row, "x"), float(three_seeds[line].x));
    } else {
      EXPECT_GT(lines.number(row, "t"), lines.number(row - 1, "t"));
    }
    const bool last = row + 1 == lines.rows.size() || lines.text(row + 1, "line") != lines.text(row, "line");
    EXPECT_TRUE(!last || line == 2 || lines.number(row, "t") == 6) << row;
  }
  // The third line leaves through the lid, after (3 - 2.5) / 0.3.
  EXPECT_NEAR(lines.number(lines.rows.size() - 1, "z"), 3, tolerance);
  EXPECT_NEAR(lines.number(lines.rows.size() - 1, "t"), 0.5 / 0.3, tolerance);
}

TEST_P(TraceCliOnDevice, BackAndBothWays) {
  const Csv back = traced("--time -2 --interval 0.5");
  ASSERT_EQ(back.rows.size(), 15u);
  for (std::size_t row = 0; row < 15; row++) {
    expect_turned(back, row, three_seeds[row / 5]);
    EXPECT_NEAR(back.number(row, "t"), -2 + 0.5 * double(row % 5), 1e-6);
    EXPECT_EQ(back.text(row, "status"), row % 5 == 0 ? "time" : "inside");
  }
  const Csv both = traced("--time 2 --both --interval 0.5");
  std::size_t row = 0, seeds = 0;
  for (std::size_t line = 0; line < 3; line++) {
    EXPECT_EQ(both.text(row, "status"), "time");
    EXPECT_EQ(both.number(row, "t"), -2);
    for (; row < both.rows.size() && both.text(row, "line") == std::to_string(line); row++) {
      expect_turned(both, row, three_seeds[line]);
      seeds += both.number(row, "t") == 0;
      const bool first = row == 0 || both.text(row - 1, "line") != both.text(row, "line");
      EXPECT_TRUE(first || both.number(row, "t") > both.number(row - 1, "t"));
    }
    EXPECT_EQ(both.text(row - 1, "status"), line < 2 ? "time" : "domain");
  }
  EXPECT_EQ(seeds, 3u);
}

// c(u) = (1 + u², u, 0) is turned with its derivatives.
TEST_P(TraceCliOnDevice, VariationAlongACurve) {
  const Csv lines = traced("--time 2 --interval 1 --variation 2", "turn.json", "curve.json");
  EXPECT_EQ(lines.header, "line,t,status,x,y,z,ux,uy,uz,uux,uuy,uuz");
  ASSERT_EQ(lines.rows.size(), 15u);
  for (std::size_t row = 0; row < 15; row++) {
    const double u = 0.25 * double(row / 3), t = lines.number(row, "t");
    expect_turned(lines, row, {1 + u * u, u, 0});
    EXPECT_NEAR(lines.number(row, "ux"), 2 * u * std::cos(t) - std::sin(t), tolerance);
    EXPECT_NEAR(lines.number(row, "uy"), 2 * u * std::sin(t) + std::cos(t), tolerance);
    EXPECT_NEAR(lines.number(row, "uuz"), 0, tolerance);
    EXPECT_NEAR(lines.number(row, "uux"), 2 * std::cos(t), tolerance);
    EXPECT_NEAR(lines.number(row, "uuy"), 2 * std::sin(t), tolerance);
  }
  write("tangents.csv", "x,y,z,dx,dy,dz\n1,0,0,0,1,0\n");
  const Csv single = traced("--time 1 --interval 1 --variation 1", "turn.json", "tangents.csv");
  EXPECT_EQ(single.header, "line,t,status,x,y,z,ux,uy,uz");
  EXPECT_NEAR(single.number(1, "ux"), -std::sin(1), tolerance);
}

TEST_P(TraceCliOnDevice, LinesEndForEveryReason) {
  EXPECT_EQ(ends(traced("--time 9 --steps 1 --integrator rk4 --step 0.01")),
            (std::vector<std::string>{"steps", "steps", "steps"}));
  const Csv shortened = traced("--time 9 --length 0.5");
  EXPECT_EQ(ends(shortened), (std::vector<std::string>{"length", "length", "length"}));
  // An arc of length 0.5 at the speed √(1 + 0.09) of the first line.
  std::size_t row = 0;
  while (shortened.text(row + 1, "line") == "0") row++;
  EXPECT_NEAR(shortened.number(row, "t"), 0.5 / std::sqrt(1.09), tolerance);
  // A sink draws lines in for ever: they end where nothing moves, and not at the time.
  write("sink.json", field(R"j(["-x", "-y", "-z"])j"));
  const Csv sink = traced("--time 1000", "sink.json");
  EXPECT_EQ(ends(sink), (std::vector<std::string>{"stagnation", "stagnation", "stagnation"}));
  EXPECT_NEAR(sink.number(sink.rows.size() - 1, "z"), 0, 1e-3);
  // √x has no value left of x = 0.
  write("root.json", field(R"j(["-0.1 - sqrt(x)", "0", "0"])j"));
  write("one.csv", "x,y,z\n1,0,0\n");
  EXPECT_EQ(ends(traced("--time 9", "root.json", "one.csv")), std::vector<std::string>{"undefined"});
  const Csv two = traced("--time 3 --ends");
  EXPECT_EQ(two.rows.size(), 6u);
}

TEST_P(TraceCliOnDevice, RungeKuttaIsOfFourthOrder) {
  const auto error = [&](const std::string& step) {
    const Csv lines = traced("--time 3 --ends --integrator rk4 --step " + step);
    return std::hypot(lines.number(1, "x") - std::cos(3.0), lines.number(1, "y") - std::sin(3.0));
  };
  // The reference has a method of its own, whatever the integrator.
  if (device_ == "reference") {
    EXPECT_LT(error("0.5"), 1e-6);
    return;
  }
  // The error of a turn by h is h⁵/120 and there are 3/h of them; it stays far above the rounding of floats.
  EXPECT_NEAR(error("0.5"), 3 * std::pow(0.5, 4) / 120, 0.2 * 3 * std::pow(0.5, 4) / 120);
  EXPECT_NEAR(error("0.5") / error("0.25"), 16, 1.5);
}

TEST_P(TraceCliOnDevice, SeedsOutside) {
  write("some.csv", "x,y,z\n1,0,0\n9,0,0\n0,-7,0\n");
  const Outcome partly = run(command("--time 1", "turn.json", "some.csv"));
  ASSERT_EQ(partly.code, 0) << partly.err;
  EXPECT_EQ(partly.err, "smurf: 2 of 3 seeds lie outside of the domain\n");
  const Csv lines(file("lines.csv"));
  EXPECT_EQ(ends(lines), (std::vector<std::string>{"time", "domain", "domain"}));
  const std::size_t rows = lines.rows.size();
  EXPECT_EQ(lines.text(rows - 2, "line"), "1");
  EXPECT_EQ(lines.number(rows - 2, "x"), 9);
  EXPECT_EQ(lines.number(rows - 1, "y"), -7);
  EXPECT_EQ(run(command("--time 1 --quiet", "turn.json", "some.csv")).err, "");

  write("far.csv", "x,y,z\n9,0,0\n0,-7,0\n");
  std::filesystem::remove(file("lines.csv"));
  expect_refused(command("--time 1", "turn.json", "far.csv"), {"no seed lies in the field", "(9, 0, 0)"});
}

TEST_F(TraceCli, StreamSurfacesGiveFieldAndSeeds) {
  write("stream.json", R"j({"kind": "stream", "time": [0, 1], "seed": {"points": [[1, 0, 0], [2, 0, 0]]}, "field": )j" +
                           field(R"j(["-y", "x", "0.3"])j") + "}");
  const Csv lines = traced("--time 1 --interval 1", "stream.json", "stream.json");
  ASSERT_EQ(lines.rows.size(), 200u);
  expect_turned(lines, 1, {1, 0, 0});
  expect_turned(lines, 199, {2, 0, 0});
}

TEST_F(TraceCli, WritesPolylines) {
  const Outcome outcome = run("trace " + in("turn.json") + " --seeds " + in("seeds.csv") +
                              " --time 1 --device reference -o " + in("lines.vtp"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const std::string text = text_of(file("lines.vtp"));
  EXPECT_NE(text.find("type=\"PolyData\""), std::string::npos);
  EXPECT_NE(text.find("NumberOfLines=\"3\""), std::string::npos);
}

TEST_F(TraceCli, VerboseTellsWhatBecameOfLines) {
  const Outcome outcome = run(command("--time 6 -v"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("time 2, domain 1"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("Msteps/s"), std::string::npos) << outcome.err;
}

TEST_F(TraceCli, InfoTellsAboutFields) {
  const Outcome outcome = run("info " + in("turn.json") + " --device reference");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const char* word : {"kind", "expression", "(-3, -3, -3) to (3, 3, 3)", "(-y, x, 0.3)", "device memory"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " is not in: " << outcome.out;
}

TEST_F(TraceCli, RendersLines) {
  const std::string begin = "render " + in("turn.json") + " --seeds " + in("seeds.csv") + " --device reference ";
  ASSERT_EQ(run(begin + "--size 80x60 --both -o " + in("lines.png")).code, 0);
  ASSERT_EQ(run(begin + "--size 80x60 --shade time --time 3 --radius 0.05 -o " + in("other.png")).code, 0);
  const Image lines = load_png(file("lines.png")), other = load_png(file("other.png"));
  EXPECT_EQ(lines.width, 80);
  EXPECT_EQ(lines.height, 60);
  EXPECT_NE(lines.rgba, other.rgba);
  expect_refused(begin + "--shade phong -o " + in("no.png"), {"phong", "speed, time, none"});
  expect_refused(begin + "--radius -1 -o " + in("no.png"), {"radius"});
  expect_refused("render " + in("turn.json") + " --device reference -o " + in("no.png"), {"turn.json", "--seeds"});
  expect_refused("render " + in("turn.json") + " --time 3 -o " + in("no.png"), {"--time", "--seeds"});
}

TEST_F(TraceCli, RefusesBadFields) {
  const auto refused = [&](const std::string& description, std::vector<std::string> words) {
    write("bad.json", description);
    words.push_back("bad.json");
    expect_refused(command("--time 1", "bad.json"), words);
  };
  refused("{", {"JSON"});
  refused("{}", {"kind", "missing"});
  refused(R"j({"kind": "wind"})j", {"kind", "wind", "expression"});
  refused(field(R"j(["-y", "x"])j"), {"vector", "three"});
  refused(field(R"j(["-y", "x", "q"])j"), {"vector[2]", "q"});
  refused(field(R"j(["-y", "x", "0"])j", "[[1, 0, 0], [0, 1, 1]]"), {"domain"});
  refused(R"j({"kind": "expression", "vector": ["1", "0", "0"]})j", {"domain", "missing"});
  refused(R"j({"kind": "stream", "time": [0, 1]})j", {"field", "missing"});
  expect_refused(command("--time 1", "missing.json"), {"missing.json"});
  // Nothing moves anywhere, or at any seed.
  write("zero.json", field(R"j(["0", "0", "0"])j"));
  expect_refused(command("--time 1", "zero.json"), {"zero", "seeds"});
  write("void.json", field(R"j(["sqrt(-1 - x^2)", "0", "0"])j"));
  expect_refused(command("--time 1", "void.json"), {"no value"});
}

// 5 x 3 x 3 nodes at whole places, with the vector (1, 0, 0), and (`hole`) none at x = 3.
std::string wind(int components, bool hole) {
  std::string text =
      fmt::format("NRRD0005\ntype: float\ndimension: 4\nsizes: {} 5 3 3\nencoding: ascii\n\n", components);
  for (int node = 0; node < 5 * 3 * 3; node++)
    for (int c = 0; c < components; c++) text += hole && node % 5 == 3 ? "nan " : c == 0 ? "1 " : "0 ";
  return text;
}

TEST_F(TraceCli, Grids) {
  write("wind.nrrd", wind(3, false));
  write("hole.nrrd", wind(3, true));
  write("pair.nrrd", wind(2, false));
  write("start.csv", "x,y,z,dx,dy,dz\n0.5,1,1,0,1,0\n");
  const auto grid = [&](const std::string& members) {
    write("grid.json", R"j({"kind": "grid", "file": )j" + members + "}");
    return command("--time 9", "grid.json", "start.csv");
  };
  ASSERT_EQ(run(grid(R"j("wind.nrrd")j")).code, 0);
  const Csv through(file("lines.csv"));
  EXPECT_EQ(ends(through), std::vector<std::string>{"domain"});
  EXPECT_NEAR(through.number(through.rows.size() - 1, "x"), 4, tolerance);
  // Cells with a node that has no vector have no field: the line ends at their border, x = 2.
  ASSERT_EQ(run(grid(R"j("hole.nrrd")j")).code, 0);
  const Csv ended(file("lines.csv"));
  EXPECT_EQ(ends(ended), std::vector<std::string>{"undefined"});
  EXPECT_NEAR(ended.number(ended.rows.size() - 1, "x"), 2, tolerance);

  std::filesystem::remove(file("lines.csv"));
  expect_refused(grid(R"j("pair.nrrd")j"), {"grid.json", "pair.nrrd", "2 components"});
  expect_refused(grid(R"j("missing.nrrd")j"), {"grid.json", "missing.nrrd"});
  expect_refused(grid(R"j("wind.nrrd", "array": "wind")j"), {"grid.json", "array \"wind\""});
  expect_refused(grid(R"j("wind.nrrd")j") + " --variation 2", {"trilinear", "tricubic"});
  write("grid.json", R"j({"kind": "grid", "file": "wind.nrrd", "reconstruction": "tricubic"})j");
  EXPECT_EQ(run(command("--time 1 --variation 2", "grid.json", "start.csv")).code, 0);
  if (!built_with_vtk()) {
    test::report_missing("VTK: arrays of its files are not read");
    GTEST_SKIP();
  }
  std::filesystem::remove(file("lines.csv"));
  expect_refused(grid(R"j(")j" SMURF_SOURCE_DIR R"j(/host/data/carotid.vtk", "array": "wind")j"),
                 {"grid.json", "carotid.vtk", "wind", "vectors"});
}

// The bundled flow about a cylinder: PLOT3D, curvilinear, blocks and blanking found from the size of the file.
TEST_F(TraceCli, BundledCurvilinearGrid) {
  write("upstream.json", R"j({"points": [[-3, -0.5, 0], [-3, 0.5, 0]], "count": 5})j");
  const std::string field = "'" SMURF_SOURCE_DIR "/host/data/cylinder-flow.json'";
  const Outcome info = run("info " + field + " --device reference");
  ASSERT_EQ(info.code, 0) << info.err;
  EXPECT_NE(info.out.find("curvilinear"), std::string::npos) << info.out;
  EXPECT_NE(info.out.find("65x33x9"), std::string::npos) << info.out;
  const Outcome outcome = run("trace " + field + " --seeds " + in("upstream.json") +
                              " --time 4 --ends --device reference -o " + in("lines.csv"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Csv lines(file("lines.csv"));
  ASSERT_EQ(lines.rows.size(), 10u);
  for (std::size_t row = 1; row < 10; row += 2) EXPECT_GT(lines.number(row, "x"), lines.number(row - 1, "x")) << row;
}

TEST_F(TraceCli, RefusesBadSeeds) {
  const auto refused = [&](const std::string& name, const std::string& text, std::vector<std::string> words,
                           const std::string& options = "") {
    write(name, text);
    words.push_back(name);
    expect_refused(command("--time 1 " + options, "turn.json", name), words);
  };
  refused("bad.csv", "x,y,z\n", {"no point"});
  refused("bad.csv", "x,y\n1,2\n", {"\"z\""});
  refused("bad.csv", "x,y,z\n1,inf,2\n", {"row 1", "not finite"});
  refused("bad.csv", "x,y,z,dx\n1,0,2,1\n", {"dx,dy,dz"});
  refused("bad.csv", "x,y,z\n1,0,2\n", {"--variation", "dx,dy,dz"}, "--variation 1");
  refused("bad.json", R"j({"points": [[1, 0, 0]]})j", {"points", "is one"});
  refused("bad.json", R"j({"position": ["u", "log(u)", "0"], "u": [0, 1]})j", {"position[1]", "u = 0"});
  refused("bad.json", R"j({"position": ["u", "sqrt(u)", "0"], "u": [0, 1]})j", {"first derivative", "seed 0"},
          "--variation 1");
  expect_refused(command("--time 1", "turn.json", "missing.csv"), {"missing.csv"});
}

TEST_F(TraceCli, RefusesBadOptions) {
  expect_refused(command(""), {"--time"});
  expect_refused(command("--time 0"), {"time", "not 0"});
  expect_refused(command("--time inf"), {"time", "finite"});
  expect_refused(command("--time soon"), {"--time"});
  expect_refused(command("--time 1 --integrator euler"), {"euler"});
  expect_refused(command("--time 1 --step 0.1"), {"--step", "rk4"});
  expect_refused(command("--time 1 --integrator rk4 --tolerance 0.1"), {"--tolerance", "dormand-prince"});
  expect_refused(command("--time 1 --integrator rk4 --step 0"), {"--step", "positive"});
  expect_refused(command("--time 1 --tolerance -1"), {"--tolerance", "positive"});
  expect_refused(command("--time 1 --interval -1"), {"interval"});
  expect_refused(command("--time 1 --length nan"), {"length"});
  expect_refused(command("--time 1 --steps 0"), {"step"});
  expect_refused(command("--time 1 --variation 3"), {"--variation"});
  const std::string begin = "trace " + in("turn.json") + " --time 1 --device reference ";
  expect_refused(begin + "-o " + in("lines.csv"), {"--seeds"});
  expect_refused(begin + "--seeds " + in("seeds.csv") + " -o " + in("lines.txt"), {".csv or .vtp"});
  expect_refused(begin + "--seeds " + in("seeds.csv"), {"--output"});
}

}  // namespace
}  // namespace smurf
