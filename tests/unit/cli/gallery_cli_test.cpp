// The verb `gallery`, and what `render` says where there is nothing to see.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "harness/command_line.hpp"
#include "io/png.hpp"

namespace smurf {
namespace {

using test::Outcome;

class GalleryCommandLine : public test::CommandLine {};

TEST_F(GalleryCommandLine, shows_the_figures_and_the_commands_that_make_them) {
  if (!test::has_device("opencl")) GTEST_SKIP();
  const Outcome outcome = run("gallery --size 40 --quiet -o " + in("gallery"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  for (const char* words :
       {"Figure 5a", "Figure 5b", "Figure 7", "Figure 8", "trilinear", "tricubic", "nurbs", "black box"})
    EXPECT_NE(outcome.out.find(words), std::string::npos) << words;

  const std::string page = test::text_of(file("gallery/index.html"));
  EXPECT_EQ(page.find("http"), std::string::npos) << "something comes from elsewhere";
  std::size_t pictures = 0;
  const std::string source = "<img src=\"";
  for (std::size_t at = page.find(source); at != std::string::npos; at = page.find(source, at + 1)) {
    const std::size_t begin = at + source.size();
    const std::string name = page.substr(begin, page.find('"', begin) - begin);
    const Image image = load_png(file("gallery/" + name));
    EXPECT_EQ(image.width, name == "kinds.png" ? 4 * 32 : 40) << name;
    pictures++;
  }
  EXPECT_EQ(pictures, 12u);

  // A command of the page makes the same picture again.
  const std::size_t figure = page.find("figure-5a.png"), command = page.find("smurf render", figure);
  ASSERT_NE(command, std::string::npos);
  std::string arguments = page.substr(command + 6, page.find("</pre>", command) - command - 6);
  arguments = arguments.substr(0, arguments.find('\n'));
  const std::string first = test::text_of(file("gallery/figure-5a.png"));
  std::filesystem::remove(file("gallery/figure-5a.png"));
  const Outcome again = run(arguments);
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_TRUE(test::text_of(file("gallery/figure-5a.png")) == first);
}

TEST_F(GalleryCommandLine, says_what_it_cannot_do) {
  write("file", "");
  expect_refused("gallery --only 9 -o " + in("gallery"), {"9", "5a", "kinds"});
  expect_refused("gallery --data " + in("nowhere") + " -o " + in("gallery"), {"headsq.json", "--data"});
  expect_refused("gallery --lobster " + in("none.nrrd") + " -o " + in("gallery"), {"--lobster", "none.nrrd"});
  expect_refused("gallery -o " + in("file"), {"file"});
}

class NothingToSee : public test::CommandLine {
 protected:
  // What render says; the picture is there, and its words are dark on light.
  std::string said(const std::string& surface, const std::string& options) {
    const Outcome outcome = run("render " + in(surface) + " --device reference --size 120x90 --samples 1 " + options +
                                " -o " + in("image.png"));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), outcome.err.empty() ? 0 : 1);
    const Image image = load_png(file("image.png"));
    // Words are the one thing in an empty picture that is dark.
    std::size_t dark = 0;
    for (std::size_t i = 0; i < image.rgba.size(); i += 4) dark += image.rgba[i] < 60 ? 1 : 0;
    EXPECT_TRUE(outcome.err.empty() || dark > 100) << dark;
    return outcome.err;
  }
};

TEST_F(NothingToSee, is_said_with_the_reason) {
  write("ball.json", R"({"kind":"implicit","equation":"x^2+y^2+z^2-1","domain":[[-2,-2,-2],[2,2,2]]})");
  write("none.json", R"({"kind":"implicit","equation":"x^2+y^2+z^2+1","domain":[[-2,-2,-2],[2,2,2]]})");
  write("grid.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: ascii\n\n1 2 3 4 5 6 7 8\n");
  write("grid.json", R"({"kind":"isosurface","isovalue":90,"field":{"kind":"grid","file":"grid.nrrd"}})");
  EXPECT_EQ(said("ball.json", ""), "");
  const auto expect = [](const std::string& line, const char* words) {
    EXPECT_NE(line.find(words), std::string::npos) << line;
  };
  expect(said("grid.json", ""), "the isovalue 90 is outside of the data's range, 1 to 8");
  expect(said("none.json", ""), "no ray hits the surface");
  expect(said("ball.json", "--eye 0,-5,0 --look-at 0,-6,0"), "the surface is behind the camera");
  expect(said("ball.json", "--eye 0,-5,0 --look-at 8,-4,0 --fov 20"), "beyond the borders of the picture");
}

}  // namespace
}  // namespace smurf
