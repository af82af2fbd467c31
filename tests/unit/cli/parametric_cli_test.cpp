// Parametric surfaces and patches as a user meets them: descriptions and data files, the verbs of `smurf` by the
// reference, and what is wrong with a description, in one line that names the member or patch.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "harness/command_line.hpp"
#include "harness/refusal.hpp"
#include "smurf/surface.hpp"
#include "truth/nurbs.hpp"

namespace smurf {
namespace {

using test::CommandLine;
using test::Csv;
using test::Outcome;
using test::refusal;

class ParametricCli : public CommandLine {
 protected:
  void expect_info(const std::string& file, const std::vector<std::string>& words) const {
    const Outcome outcome = run("info '" + file + "' --device reference");
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    for (const std::string& word : words)
      EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " is not in: " << outcome.out;
  }
  void expect_info_of(const std::string& description, const std::vector<std::string>& words) const {
    write("surface.json", description);
    expect_info(file("surface.json").string(), words);
  }
  // `members` as they stand in a description of a plane, in place of its own.
  void expect_refused_with(const std::string& members, const std::vector<std::string>& words) const {
    write("bad.json", R"j({"kind": "parametric", )j" + members + "}");
    std::vector<std::string> all = words;
    all.push_back("bad.json");
    expect_refused("info " + in("bad.json") + " --device reference", all);
  }
};

constexpr const char* torus = R"j("position": ["(2+cos(v))*cos(u)", "(2+cos(v))*sin(u)", "sin(v)"], )j";
constexpr const char* plane_range = R"j("u": [0, 1], "v": [0, 1])j";

TEST_F(ParametricCli, InfoTellsWhatIsClosed) {
  const std::string begin = std::string(R"j({"kind": "parametric", )j") + torus;
  expect_info_of(begin + R"j("u": [0, 6.2831853], "v": [0, "2*pi"]})j",
                 {"parametric", "(-3, -3, -1) to (3, 3, 1)", "0 to 6.2831853", "closed in u", "differ by 2.15e-08",
                  "no open side", "2 shared", "none"});
  expect_info_of(begin + R"j("u": [0, "pi*a"], "v": ["-pi", "pi"], "parameters": {"a": 1}})j",
                 {"0 to 3.14159", "2 open sides", "closed in v    yes"});
  expect_info_of(begin + R"j("u": [0, 6.28], "v": [0, "2*pi"], "period": ["u"]})j",
                 {"as it is said to be", "differ by 0.00956", "no open side"});
  expect_info_of(
      R"j({"kind": "parametric", "position": ["cos(v)*cos(u)", "cos(v)*sin(u)", "sin(v)"], "u": [0, "2*pi"],
          "v": ["-pi/2", "pi/2"]
})j",
      {"2: at (0, 0, -1), (0, 0, 1)"});
}

TEST_F(ParametricCli, BundledSurfaces) {
  const std::string folder = SMURF_SOURCE_DIR "/host/";
  expect_info(folder + "data/egg.json", {"nurbs", "2 x 3", "rational       yes", "no open side", "poles          2"});
  expect_info(folder + "examples/nurbs-torus.json", {"(-3, -3, -1) to (3, 3, 1)", "16", "32 shared", "no open side"});
  expect_info(folder + "examples/klein-bottle.json", {"turned over", "no open side"});
  expect_info(folder + "examples/enneper.json", {"4 open sides"});
}

TEST_F(ParametricCli, DataFilesStandForDescriptions) {
  write("flat.bpt", "1\n1 1\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n");
  write("flat.json", R"j({"kind": "nurbs", "file": "flat.bpt"})j");
  write("tetrahedron.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
  expect_info(file("flat.bpt").string(), {"nurbs", "4 open sides"});
  expect_info(file("flat.json").string(), {"nurbs", "4 open sides"});
  expect_info(file("tetrahedron.off").string(), {"mesh", "outward"});
  expect_refused("info " + in("missing.bpt"), {"missing.bpt"});
  write("broken.bpt", "1\n1 1\n0 0 0\n1 0 zero\n0 1 0\n1 1 0\n");
  expect_refused("info " + in("broken.bpt"), {"broken.bpt", "zero"});
  write("broken.json", R"j({"patches": [{"degree": [1, 1], "size": [2, 2], "knots": [[0, 0, 1, 1]]}]})j");
  expect_refused("info " + in("broken.json"), {"broken.json", "patch 0", "knots"});
  write("neither.json", R"j({"patch": []})j");
  expect_refused("info " + in("neither.json"), {"neither.json", "kind"});
}

TEST_F(ParametricCli, CastAndProbeByTheReference) {
  write("torus.json", std::string(R"j({"kind": "parametric", )j") + torus + R"j("u": [0, "2*pi"], "v": [0, "2*pi"]})j");
  write("rays.csv", "ox,oy,oz,dx,dy,dz\n5,0,0,-1,0,0\n0,0,5,0,0,-1\n");
  const std::string rest = " --rays " + in("rays.csv") + " --hits all --device reference -o " + in("hits.csv");
  ASSERT_EQ(run("cast " + in("torus.json") + " --properties parameters,normal,mean" + rest).code, 0);
  const Csv hits(file("hits.csv"));
  ASSERT_EQ(hits.rows.size(), 4u);
  EXPECT_TRUE(hits.header.starts_with("ray,t,status,x,y,z,u,v,nx")) << hits.header;
  EXPECT_FLOAT_EQ(hits.number(0, "t"), 2);
  EXPECT_FLOAT_EQ(hits.number(1, "v"), float(M_PI));
  const std::string patch = "'" SMURF_SOURCE_DIR "/host/examples/nurbs-torus.json'";
  ASSERT_EQ(run("cast " + patch + " --properties parameters" + rest).code, 0);
  EXPECT_TRUE(Csv(file("hits.csv")).header.starts_with("ray,t,status,x,y,z,patch,u,v"));
  ASSERT_EQ(Csv(file("hits.csv")).rows.size(), 4u);

  write("cone.json", R"j({"kind": "parametric", "position": ["v*cos(u)", "v*sin(u)", "v"], "u": [0, "2*pi"],
                        "v": [0, 1]
})j");
  write("points.csv", "x,y,z\n0,0,-1\n0.5,0,0.5\n");
  ASSERT_EQ(run("probe " + in("cone.json") + " --points " + in("points.csv") + " --device reference -o " +
                in("points-out.csv"))
                .code,
            0);
  const Csv points(file("points-out.csv"));
  ASSERT_EQ(points.rows.size(), 2u);
  EXPECT_EQ(points.text(0, "status"), "undefined+singular");
  EXPECT_EQ(points.number(0, "u"), 0);
  EXPECT_EQ(points.text(1, "status"), "regular");
  expect_refused("cast " + in("torus.json") + " --properties value" + rest, {"value", "parametric", "level set"});
}

TEST_F(ParametricCli, RefusesBadDescriptions) {
  const std::string range = plane_range, flat = R"j("position": ["u", "v", "0"], )j";
  expect_refused_with(range, {"position", "missing"});
  expect_refused_with(R"j("position": ["u", "v"], )j" + range, {"position", "three"});
  expect_refused_with(R"j("position": "u,v,0", )j" + range, {"position", "three"});
  expect_refused_with(R"j("position": ["u", "v", true], )j" + range, {"position[2]", "true"});
  expect_refused_with(R"j("position": ["u", "v", "x"], )j" + range, {"position[2]", "x"});
  expect_refused_with(R"j("position": ["u", "v*", "0"], )j" + range, {"position[1]", "v*"});
  expect_refused_with(R"j("position": ["u", "v", "sqrt(-1-u^2)"], )j" + range, {"position[2]", "undefined", "sqrt"});
  expect_refused_with(R"j("position": ["u", "v", "log(-1)"], )j" + range, {"position[2]", "undefined"});
  expect_refused_with(R"j("position": ["sqrt(u-0.7)", "v", "sqrt(0.3-u)"], )j" + range, {"position", "no place"});
  expect_refused_with(R"j("position": ["u", "v", "1/(u-0.3)"], )j" + range, {"position", "infinity", "u = 0.3"});
  expect_refused_with(R"j("position": ["u+v", "2*(u+v)", "sin(u+v)"], )j" + range, {"position", "curve"});
  expect_refused_with(R"j("position": ["u", "u^2", "0"], )j" + range, {"position", "curve"});
  expect_refused_with(R"j("position": ["1", "2", "3"], )j" + range, {"position", "point"});
  expect_refused_with(flat + R"j("u": [0, 1])j", {"\"v\"", "missing"});
  expect_refused_with(flat + R"j("u": [1, 0], "v": [0, 1])j", {"\"u\"", "reversed"});
  expect_refused_with(flat + R"j("u": [0, 1], "v": ["2*pi", "pi"])j", {"\"v\"", "reversed"});
  expect_refused_with(flat + R"j("u": [1, 1], "v": [0, 1])j", {"\"u\"", "empty"});
  expect_refused_with(flat + R"j("u": [1, 1.0000000001], "v": [0, 1])j", {"\"u\"", "floats"});
  expect_refused_with(flat + R"j("u": 1, "v": [0, 1])j", {"\"u\"", "range"});
  expect_refused_with(flat + R"j("u": [0, "1/0"], "v": [0, 1])j", {"u[1]", "finite"});
  expect_refused_with(flat + R"j("u": [0, "b"], "v": [0, 1])j", {"u[1]", "\"b\""});
  expect_refused_with(flat + R"j("u": [0, "v"], "v": [0, 1])j", {"u[1]"});
  expect_refused_with(flat + R"j("u": [0, null], "v": [0, 1])j", {"u[1]", "null"});
  expect_refused_with(flat + range + R"j(, "period": ["w"])j", {"period", "w"});
  expect_refused_with(flat + range + R"j(, "closed": ["u"])j", {"closed", "period"});
  expect_refused_with(flat + range + R"j(, "parameters": {"a": "x"})j", {"parameters.a", "x"});
  expect_refused_with(flat + range + R"j(, "parameters": {"u": 1})j", {"\"u\"", "hides"});
}

TEST(ParametricSurfaces, RefuseWhatIsNoSurface) {
  const auto message = [](const std::vector<Patch>& patches) {
    return refusal(ErrorCode::input, [&] { nurbs(patches); });
  };
  const Patch good = test::nurbs_sphere(1);
  EXPECT_NE(message({}).find("one patch"), std::string::npos);
  Patch bad = good;
  bad.knots[0].pop_back();
  EXPECT_NE(message({good, bad}).find("patch 1"), std::string::npos);
  bad = good;
  for (auto& p : bad.points) p = {p.w, 2 * p.w, 3 * p.w, p.w};
  EXPECT_NE(message({good, bad}).find("patch 1 collapses to a point"), std::string::npos) << message({good, bad});
  bad = good;
  for (auto& p : bad.points) p = {p.x, 0, 0, p.w};
  EXPECT_NE(message({bad}).find("patch 0 collapses to a curve"), std::string::npos);
  // Weights: 0 in the middle of an arc is a half circle, 0 at an end is at infinity.
  const auto half = [](double end) {
    return bezier_patch(2, 1,
                        {{1, 0, 0, 1}, {0, 1, 0, 0}, {-1, 0, 0, end}, {1, 0, 1, 1}, {0, 1, 0, 0}, {-1, 0, 1, end}});
  };
  EXPECT_EQ(nurbs({half(1)}).kind(), "nurbs");
  EXPECT_NE(message({good, half(0)}).find("patch 1: the weight vanishes"), std::string::npos);
  EXPECT_NE(refusal(ErrorCode::input,
                    [] {
                      parametric({"u", "v", "0"}, {0, std::nan("")}, {0, 1});
                    })
                .find("u: the range"),
            std::string::npos);
}

}  // namespace
}  // namespace smurf
