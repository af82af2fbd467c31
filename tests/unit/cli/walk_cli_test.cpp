// Walks as a user meets them: `smurf walk` on every device, and what is refused in one line.
//
// On the unit sphere a path is a great circle: a chord of 0.5 is an angle of 2 asin(0.25).
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "harness/command_line.hpp"

namespace smurf {
namespace {

using test::Csv;
using test::Outcome;
using test::text_of;

class WalkCli : public test::CommandLine {
 protected:
  void SetUp() override {
    CommandLine::SetUp();
    write("sphere.json",
          R"j({"kind": "implicit", "equation": "x^2+y^2+z^2-1", "domain": [[-1.5, -1.5, -1.5], [1.5, 1.5, 1.5]]})j");
    write("points.csv", "x,y,z,dx,dy,dz\n1,0,0,0,1,0\n\n0,1,0,0,0.5,2\n");
  }
  std::string command(const std::string& rest, const std::string& points = "points.csv",
                      const std::string& surface = "sphere.json") const {
    return "walk " + in(surface) + " --points " + in(points) + " " + rest + " --device " + device_ + " -o " +
           in("paths.csv");
  }
  std::string device_ = "reference";
};

class WalkCliOnDevice : public WalkCli, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    WalkCli::SetUp();
    device_ = GetParam();
    if (!test::has_device(device_)) GTEST_SKIP() << "no device " << device_;
  }
};

INSTANTIATE_TEST_SUITE_P(Devices, WalkCliOnDevice, testing::ValuesIn(test::devices_to_try), test::device_name);

TEST_P(WalkCliOnDevice, WritesTheColumnsOfTheContract) {
  const Outcome outcome = run(command("--distance 0.5 --steps 3"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  const Csv paths(file("paths.csv"));
  EXPECT_EQ(paths.header, "path,step,status,x,y,z");
  ASSERT_EQ(paths.rows.size(), 8u);
  for (std::size_t row = 0; row < 8; row++) {
    const int step = int(row % 4);
    EXPECT_EQ(paths.text(row, "path"), row < 4 ? "0" : "1");
    EXPECT_EQ(paths.text(row, "step"), std::to_string(step));
    EXPECT_EQ(paths.text(row, "status"), step == 0 ? "start" : "reached");
    const double angle = 2 * std::asin(0.25) * step, c = std::cos(angle), s = std::sin(angle);
    EXPECT_NEAR(paths.number(row, "x"), row < 4 ? c : 0, 1e-5);
    EXPECT_NEAR(paths.number(row, "y"), row < 4 ? s : c, 1e-5);
    EXPECT_NEAR(paths.number(row, "z"), row < 4 ? 0 : s, 1e-5);
  }
}

TEST_F(WalkCli, PathsEndWithTheReason) {
  EXPECT_EQ(run(command("--distance 2.5 --steps 9")).code, 0);
  const Csv beyond(file("paths.csv"));
  ASSERT_EQ(beyond.rows.size(), 4u);
  EXPECT_EQ(beyond.text(1, "status"), "unreachable");
  EXPECT_EQ(beyond.text(3, "status"), "unreachable");

  write("cut.json", R"j({"kind": "implicit", "equation": "x^2+y^2+z^2-1", "domain": [[-2, -2, -2], [2, 0.3, 2]]})j");
  write("up.csv", "x,y,z,dx,dy,dz\n1,0,0,0,1,0\n");
  EXPECT_EQ(run(command("--distance 0.2 --steps 9", "up.csv", "cut.json")).code, 0);
  const Csv cut(file("paths.csv"));
  ASSERT_EQ(cut.rows.size(), 3u);
  EXPECT_EQ(cut.text(2, "status"), "boundary");
  EXPECT_NEAR(cut.number(2, "y"), 0.3, 1e-4);
}

TEST_F(WalkCli, MeshesTellFacesAndVtpHasPolylines) {
  write("square.off", "OFF\n4 2 0\n0 0 0\n4 0 0\n4 4 0\n0 4 0\n3 0 1 2\n3 0 2 3\n");
  write("on.csv", "x,y,z,dx,dy,dz\n1,0.5,0,0,1,5\n");
  EXPECT_EQ(run(command("--distance 1 --steps 2", "on.csv", "square.off")).code, 0);
  const Csv paths(file("paths.csv"));
  EXPECT_EQ(paths.header, "path,step,status,x,y,z,face,u,v");
  ASSERT_EQ(paths.rows.size(), 3u);
  EXPECT_EQ(paths.text(0, "face"), "0");
  EXPECT_EQ(paths.text(2, "face"), "1");
  EXPECT_NEAR(paths.number(2, "y"), 2.5, 1e-5);

  const Outcome outcome = run("walk " + in("square.off") + " --points " + in("on.csv") +
                              " --distance 1 --steps 2 --device reference -o " + in("paths.vtp"));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const std::string text = text_of(file("paths.vtp"));
  EXPECT_NE(text.find(R"(NumberOfPoints="3" NumberOfVerts="0" NumberOfLines="1")"), std::string::npos);
}

TEST_F(WalkCli, BadInputIsRefusedInOneLine) {
  for (const char* distance : {"-1", "0", "nan", "inf"})
    expect_refused(command(std::string("--distance ") + distance), {"--distance", "positive", distance});
  expect_refused(command("--distance x"), {"--distance"});
  expect_refused(command(""), {"--distance"});
  for (const char* steps : {"0", "-2", "1.5"})
    expect_refused(command(std::string("--distance 1 --steps ") + steps), {"--steps", steps});
  expect_refused(command("--distance 1 --tolerance -1"), {"--tolerance"});
  write("plain.csv", "x,y,z\n1,0,0\n");
  expect_refused(command("--distance 1", "plain.csv"), {"plain.csv", "dx,dy,dz"});
  write("part.csv", "x,y,z,dx\n1,0,0,1\n");
  expect_refused(command("--distance 1", "part.csv"), {"part.csv", "dx,dy,dz"});
  write("off.csv", "x,y,z,dx,dy,dz\n1,0,0,0,1,0\n\n1.5,0,0,0,1,0\n");
  expect_refused(command("--distance 1", "off.csv"), {"off.csv", "line 4", "--tolerance"});
  EXPECT_EQ(run(command("--distance 1 --tolerance 0.6", "off.csv")).code, 0);
  std::filesystem::remove(file("paths.csv"));
  write("normal.csv", "x,y,z,dx,dy,dz\n1,0,0,-3,0,0\n");
  expect_refused(command("--distance 1", "normal.csv"), {"normal.csv", "line 2", "along the normal"});
  write("nan.csv", "x,y,z,dx,dy,dz\n1,0,nan,0,1,0\n");
  expect_refused(command("--distance 1", "nan.csv"), {"nan.csv", "line 2", "finite"});
}

}  // namespace
}  // namespace smurf
