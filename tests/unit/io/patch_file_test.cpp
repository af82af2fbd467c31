// Files of patches: what is read, and what is refused.
#include "io/patch_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "harness/files/shared_data.hpp"
#include "harness/refusal.hpp"
#include "patches/bezier.hpp"

namespace smurf {
namespace {

using test::has_shared_data;
using test::refusal;
using test::shared_data;

std::filesystem::path written(const std::string& name, const std::string& text) {
  const auto file = std::filesystem::path(SMURF_TEST_OUTPUT) / name;
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

void expect_refused(const std::string& name, const std::string& text, const std::string& part) {
  const auto file = written(name, text);
  const std::string message = refusal(ErrorCode::input, [&] { load_patches(file); });
  EXPECT_NE(message.find(part), std::string::npos) << message;
  EXPECT_NE(message.find(name), std::string::npos) << message;
}

const std::string bilinear = "0 0 0  1 0 0  0 1 0  1 1 2\n";

TEST(PatchFiles, Bpt) {
  const auto patches =
      load_patches(written("two.bpt", "2\n1 1\n" + bilinear + "2 1\n0 0 0 1 0 1 2 0 0 0 1 0 1 1 1 2 1 0\n"));
  ASSERT_EQ(patches.size(), 2u);
  EXPECT_EQ(patches[0].degree, (std::array<int, 2>{1, 1}));
  EXPECT_EQ(patches[1].size, (std::array<int, 2>{3, 2}));
  EXPECT_EQ(patches[0].points[3], glm::dvec4(1, 1, 2, 1));
  EXPECT_EQ(patches[1].knots[0], (std::vector<double>{0, 0, 0, 1, 1, 1}));
  expect_refused("none.bpt", "", "the number of patches is missing");
  expect_refused("zero.bpt", "0\n", "the number of patches is 0");
  expect_refused("many.bpt", "1000000\n1 1\n", "the number of patches is 1000000");
  expect_refused("high.bpt", "1\n1 10\n" + bilinear, "line 2: the degree of a patch is 10; it must be 1 to 9");
  expect_refused("short.bpt", "1\n1 1\n0 0 0 1 0 0\n", "a coordinate of a control point is missing");
  expect_refused("word.bpt", "1\n1 1\n0 0 0 1 zero 0\n", "line 3: a coordinate of a control point is \"zero\"");
  expect_refused("more.bpt", "1\n1 1\n" + bilinear + bilinear, "goes on behind its 1 patches");
  expect_refused("nan.bpt", "1\n1 1\n0 0 0 1 0 nan 0 1 0 1 1 0\n", "patch 0: control point 1 is not finite");
}

TEST(PatchFiles, Bez) {
  const auto plain = load_patches(written("plain.bez", "BEZ113 # two patches\n" + bilinear + "\n" + bilinear));
  ASSERT_EQ(plain.size(), 2u);
  EXPECT_EQ(plain[1].points[3], glm::dvec4(1, 1, 2, 1));
  const auto rational = load_patches(written("rational.bez", "BEZ114\n0 0 0 1  2 0 0 2  0 1 0 1  1 1 0 0\n"));
  ASSERT_EQ(rational.size(), 1u);
  EXPECT_EQ(rational[0].points[1], glm::dvec4(2, 0, 0, 2));
  EXPECT_EQ(rational[0].points[3].w, 0);
  const auto textured = load_patches(
      written("textured.bez", "STBEZ113\n" + bilinear + "0 0 1 0 0 1 1 1\n" + bilinear + "0 0 1 0 0 1 1 1\n"));
  EXPECT_EQ(textured.size(), 2u);
  expect_refused("kind.bez", "OFF\n", "a .bez file begins with BBP or BEZ");
  expect_refused("digits.bez", "BEZ33\n", "a .bez file begins with BBP or BEZ");
  expect_refused("flat.bez", "BEZ112\n", "3 or 4 numbers, not 2");
  expect_refused("degree.bez", "BEZ013\n", "the degree of a patch is 0");
  expect_refused("none.bez", "BBP\n", "there is no patch in the file");
  expect_refused("short.bez", "BEZ113\n0 0 0 1\n", "a coordinate of a control point is missing");
  expect_refused("negative.bez", "BEZ114\n0 0 0 1  2 0 0 -2  0 1 0 1  1 1 0 1\n",
                 "the weight of control point 1 is -2");
}

TEST(PatchFiles, Json) {
  const std::string start = R"({"patches":[{"degree":[1,1],"size":[2,2],"knots":[[0,0,1,1],[2,2,3,3]],)";
  const auto patches = load_patches(written(
      "one.json", start + R"("points":[[0,0,0],[1,0,0],[0,1,0],[1,1,2]],"weights":[1,2,1,0.5]}],"source":"x"})"));
  ASSERT_EQ(patches.size(), 1u);
  EXPECT_EQ(patches[0].lower(1), 2);
  EXPECT_EQ(patches[0].points[3], glm::dvec4(0.5, 0.5, 1, 0.5));
  const auto homogeneous = load_patches(written(
      "homogeneous.json", start + R"("homogeneous":true,"points":[[0,0,0,1],[1,0,0,0],[0,1,0,1],[1,1,2,1]]}]})"));
  EXPECT_EQ(homogeneous[0].points[1], glm::dvec4(1, 0, 0, 0));

  expect_refused("text.json", "{", "not valid JSON at byte");
  expect_refused("list.json", "[]", "a JSON object with the member");
  expect_refused("nothing.json", R"({"patches":[]})", "one patch or more");
  expect_refused("no-degree.json", R"({"patches":[{}]})", "patch 0: member \"degree\" is missing");
  expect_refused("points.json", start + R"("points":[[0,0],[1,0],[0,1],[1,1]]}]})",
                 "control point 0 must have 3 numbers");
  expect_refused("weights.json", start + R"("points":[[0,0,0],[1,0,0],[0,1,0],[1,1,2]],"weights":[1]}]})",
                 "as many weights as control points, 4");
  expect_refused("few.json", start + R"("points":[[0,0,0]]}]})", "1 control points; 2 x 2 are needed");
  expect_refused("size.json", R"({"patches":[{"degree":[1,1],"size":[2,1e30],"knots":[[],[]],"points":[]}]})",
                 "two whole numbers");
  expect_refused("other.txt", "", "end in .bpt, .bez or .json");
  EXPECT_NE(refusal(ErrorCode::input, [] { load_patches("/no/such/file.bpt"); }).find("no/such"), std::string::npos);
}

// Cut short anywhere, and with bytes changed: patches that are valid, or one line that says what is wrong.
TEST(PatchFiles, DamageIsTold) {
  const std::vector<std::pair<std::string, std::string>> files = {
      {"damaged.bpt", "2\n1 1\n" + bilinear + "1 1\n" + bilinear},
      {"damaged.bez", "CSTBEZ114\n0 0 0 1 1 0 0 1 0 1 0 1 1 1 0 1\n" + std::string(24, '1') + "\n"},
      {"damaged.json", R"({"patches":[{"degree":[1,1],"size":[2,2],"knots":[[0,0,1,1],[2,2,3,3]],"points":[[0,0,0],)"
                       R"([1,0,0],[0,1,0],[1,1,2]],"weights":[1,2,1,0.5]}]})"}};
  std::mt19937 random(5);
  for (const auto& [name, text] : files) {
    int refused = 0;
    for (int n = 0; n < 400; n++) {
      std::string damaged = text;
      if (n % 2 == 0) {
        damaged.resize(random() % text.size());
      } else {
        for (unsigned k = 0; k <= random() % 3; k++) damaged[random() % damaged.size()] = char(random() % 256);
      }
      const auto file = written(name, damaged);
      try {
        for (const Patch& patch : load_patches(file)) EXPECT_FALSE(bezier_pieces(patch, 0).empty());
      } catch (const Error& error) {
        refused++;
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      }
    }
    EXPECT_GT(refused, 100) << name;
  }
}

TEST(PatchFiles, ThoseAtHand) {
  if (!has_shared_data("patches")) GTEST_SKIP();
  const auto count = [](const char* name) {
    return load_patches(shared_data(std::filesystem::path("patches") / name)).size();
  };
  EXPECT_EQ(count("teapot.bpt"), 32u);
  EXPECT_EQ(count("linkA.bez"), 1u);
  EXPECT_EQ(count("octant.bez"), 1u);
  EXPECT_EQ(count("gismo/egg.json"), 1u);
  EXPECT_EQ(count("gismo/g_plus_s_surf.json"), 126u);
}

}  // namespace
}  // namespace smurf
