// Equations and tapes from files, and files that are wrong or hostile.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "expression/files.hpp"
#include "harness/files/shared_data.hpp"
#include "unit/expression/expressions.hpp"

namespace smurf::expression {
namespace {

namespace fs = std::filesystem;

using test::shared_data, test::has_shared_data;

fs::path written(const std::string& name, const std::string& text) {
  const fs::path file = fs::path(SMURF_TEST_OUTPUT) / name;
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

TEST(ExpressionFiles, AlgebraicSurfaces) {
  const std::map<std::string, int> degrees = {
      {"fantasy_calypso", 3},    {"fantasy_dingdong", 3},     {"fantasy_distel", 6},         {"fantasy_dullo", 4},
      {"fantasy_helix", 4},      {"fantasy_himmel", 4},       {"fantasy_kolibri", 4},        {"fantasy_kreisel", 6},
      {"fantasy_miau", 4},       {"fantasy_nepali", 6},       {"fantasy_quaste", 9},         {"fantasy_suess", 6},
      {"fantasy_tuelle", 4},     {"fantasy_visavis", 4},      {"fantasy_zeck", 4},           {"fantasy_zitrus", 6},
      {"record_7eck", 7},        {"record_barthsextic", 6},   {"record_cayleycubic", 3},     {"record_chmutovoktic", 8},
      {"record_doppelkegel", 2}, {"record_kummerquartic", 4}, {"record_quintic15cuspen", 5}, {"record_togliatti", 5},
      {"tutorial_2kugeln", 4},   {"tutorial_ebene", 1},       {"tutorial_gerade", 3},        {"tutorial_koord1", 6},
      {"tutorial_koord2", 2},    {"tutorial_kreis", 2},       {"tutorial_kugel", 2},         {"tutorial_parabel", 4},
      {"tutorial_tricks1", 4},   {"tutorial_tricks2", 4},     {"tutorial_wuerfel", 6},       {"tutorial_zitrus", 6}};
  if (!has_shared_data("implicit/jsurf")) GTEST_SKIP();
  const fs::path folder = shared_data("implicit/jsurf");
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".jsurf") continue;
    files++;
    const ImplicitFile file = load_jsurf(entry.path());
    const auto known = degrees.find(file.title);
    ASSERT_NE(known, degrees.end()) << file.title;
    EXPECT_EQ(polynomial_degree(file.graph, file.root), known->second) << file.title;
  }
  EXPECT_EQ(files, degrees.size());

  // Singular points known by hand: value and gradient vanish.
  const double golden = (1 + std::sqrt(5.0)) / 2;
  const double size = std::sqrt(1 + std::pow(golden, 2) + std::pow(golden, 4));
  const std::vector<std::pair<std::string, Point>> nodes = {
      {"record_cayleycubic", {-1, -1, -1}},
      {"record_barthsextic", {1 / size, golden / size, golden * golden / size}},
      {"record_barthsextic", {golden * golden / size, 1 / size, -golden / size}},
      {"fantasy_dingdong", {0, 0, 0}},
  };
  for (const auto& [name, p] : nodes) {
    ImplicitFile file = load_jsurf(folder / (name + ".jsurf"));
    EXPECT_NEAR(value_of(file.graph, file.root, p), 0, 1e-11) << name;
    for (int axis = 0; axis < 3; axis++)
      EXPECT_NEAR(value_of(file.graph, derivative(file.graph, file.root, axis), p), 0, 1e-10) << name;
  }
  const ImplicitFile ball = load_jsurf(folder / "tutorial_kugel.jsurf");
  EXPECT_EQ(value_of(ball.graph, ball.root, {0.6, 0.8, 0.5}), 0.6 * 0.6 + 0.8 * 0.8 + 0.25 - 1);
}

TEST(ExpressionFiles, PropertiesAreReadAsJavaDoes) {
  const std::string text =
      "#jSurfer surface description\n"
      "! surface_equation=nonsense\n"
      "light_color_0=1.0 1.0 1.0\r\n"
      "  surface_parameter_a : 0.5\n"
      "#0.41736117005348206\n"
      "surface_parameter_long_name 2\r\n"
      "background_color=1 \\\n"
      "surface_equation=not this\n"
      "surface_equation \\= (x^2 + \\\n"
      "      a*y)\\u002along_name - \\\r\n"
      "   z   \n"
      "surface_title=Test";
  // The separator is the blank; the escaped = would belong to the value.
  expect_fragment(message_of([&] { parse_jsurf(text, "a.jsurf"); }),
                  "\"a.jsurf\", line 9: expression \"= (x^2 + a*y)*");
  const std::string good = std::string(text).replace(text.find("\\="), 2, "=");
  const fs::path path = written("expression_properties.jsurf", good);
  const ImplicitFile file = load_jsurf(path);
  EXPECT_EQ(file.title, "expression_properties");
  EXPECT_EQ(value_of(file.graph, file.root, {3, 4, 5}), (9 + 0.5 * 4) * 2 - 5);
  EXPECT_EQ(polynomial_degree(file.graph, file.root), 2);
  EXPECT_GT(file.operations, 5u);

  // Two backslashes are one character, and no continuation.
  const ImplicitFile even = parse_jsurf("other=1\\\\\nsurface_equation=x", "a.jsurf");
  EXPECT_EQ(even.graph[even.root].op, Op::variable);

  const ImplicitFile barth = load_jsurf(written("expression_barth.jsurf",
                                                "surface_parameter_a=1.0\n"
                                                "surface_equation=4*((a*(1+sqrt(5))/2)^2*x^2-1*y^2)*((a*(1+sqrt(5))/"
                                                "2)^2*y^2-1*z^2)*((a*(1+sqrt(5))/2)^2*z^2-1*x^2)"
                                                "-1*(1+2*(a*(1+sqrt(5))/2))*(x^2+y^2+z^2-1*1)^2\n"));
  EXPECT_EQ(polynomial_degree(barth.graph, barth.root), 6);
  EXPECT_NEAR(value_of(barth.graph, barth.root, {0, 0, 0}), -(2 + std::sqrt(5.0)), 1e-14);
}

TEST(ExpressionFiles, AlgebraicSurfacesThatAreWrong) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "\"bad.jsurf\": no line \"surface_equation=...\""},
      {"camera_height=2\n", "no line \"surface_equation=...\""},
      {"\n\nsurface_equation=x+*y", "\"bad.jsurf\", line 3: expression \"x+*y\", column 3: found \"*\""},
      {"surface_equation=", "line 1: expression \"\", column 1: found the end"},
      {"surface_equation=x+a", "line 1: expression \"x+a\", column 3: found \"a\", expected one of x, y, z, pi, e"},
      {"surface_equation=2x", "line 1: expression \"2x\", column 2"},
      {"surface_equation=x\n#\nsurface_equation=y",
       "line 3: \"surface_equation\" is given a second time; the first was in line 1"},
      {"surface_parameter_a=1\nsurface_parameter_a=1\nsurface_equation=x",
       "line 2: \"surface_parameter_a\" is given a second time; the first was in line 1"},
      {"surface_parameter_a=one\nsurface_equation=x", "line 1: \"surface_parameter_a\" is \"one\", which is no number"},
      {"surface_parameter_a=nan\nsurface_equation=x", "line 1: \"surface_parameter_a\" is \"nan\", which is no number"},
      {"surface_parameter_a=1e999\nsurface_equation=x", "line 1: \"surface_parameter_a\" is 1e999, out of range"},
      {"surface_parameter_a=\nsurface_equation=x", "line 1: \"surface_parameter_a\" is \"\", which is no number"},
      {"surface_parameter_x=1\nsurface_equation=x", "line 2: parameter \"x\" hides the variable"},
      {"surface_parameter_=1\nsurface_equation=x", "is no name"},
      {"surface_equation=" + std::string(10'000, '('), "nested more than 1000 levels deep"},
      {"surface_equation=" + std::string(10'000'000, '('), "at most 1048576 are read"},
      {std::string(10'000'000, '\\'), "no line \"surface_equation=...\""},
      {repeated("\\\n", 5'000'000), "no line \"surface_equation=...\""},
      {std::string(10'000'000, '\0'), "no line \"surface_equation=...\""},
      {"surface_equation=x\\u12", "column 2: found \"?\""},
      {std::string(17 << 20, 'x'), "17825792 bytes; at most 16777216 are read"},
  };
  for (const auto& [text, fragment] : cases)
    expect_fragment(message_of([&] { parse_jsurf(text, "bad.jsurf"); }), fragment);
  expect_fragment(message_of([] { load_jsurf("/no/such/file.jsurf"); }), "cannot read \"/no/such/file.jsurf\"");
  expect_fragment(message_of([] { load_vm(fs::temp_directory_path()); }), "it is a folder");
  const fs::path large = written("expression_large.jsurf", "");
  fs::resize_file(large, std::uintmax_t(1) << 33);  // 8 GiB, all of it a hole
  expect_fragment(message_of([&] { load_jsurf(large); }), "8589934592 bytes; at most 16777216 are read");
  expect_fragment(message_of([&] { load_vm(large); }), "8589934592 bytes; at most 16777216 are read");
  fs::remove(large);
}

// An interpreter of tapes of its own; knows the operations of those at hand.
double tape_value(const std::string& text, const Point& p) {
  std::map<std::string, double> values;
  std::istringstream lines(text);
  double last = nan;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name, op, a, b;
    words >> name >> op >> a >> b;
    if (name.empty() || name[0] == '#') continue;
    const auto at = [&](const std::string& word) { return values.at(word); };
    if (op == "const") last = std::stod(a);
    else if (op == "var-x") last = p[0];
    else if (op == "var-y") last = p[1];
    else if (op == "var-z") last = p[2];
    else if (op == "neg") last = -at(a);
    else if (op == "square") last = at(a) * at(a);
    else if (op == "sqrt") last = std::sqrt(at(a));
    else if (op == "add") last = at(a) + at(b);
    else if (op == "sub") last = at(a) - at(b);
    else if (op == "mul") last = at(a) * at(b);
    else if (op == "min") last = std::min(at(a), at(b));
    else if (op == "max") last = std::max(at(a), at(b));
    else throw std::runtime_error("unknown operation " + op);
    values[name] = last;
  }
  return last;
}

TEST(ExpressionFiles, Tapes) {
  if (!has_shared_data("implicit")) GTEST_SKIP();
  RandomTrees random(4);
  struct Model {
    std::string name, title;
    std::size_t operations;
    int points;
  };
  for (const Model& model :
       {Model{"prospero", "Text of a monologue from The Tempest", 7866, 60},
        Model{"colonnade", "Model of a colonnade with a balcony and outside staircase", 808, 200},
        Model{"hi", "The letters 'hi' in the upper-right quadrant", 56, 200},
        Model{"quarter", "A quarter-circle in the lower-left quadrant", 9, 200},
        Model{"tanglecube", "Recommended settings: --scale 0.222 --pitch -25 --yaw 30", 20, 200}}) {
    const fs::path path = shared_data("implicit") / (model.name + ".vm");
    std::ostringstream content;
    content << std::ifstream(path).rdbuf();
    const ImplicitFile file = load_vm(path);
    EXPECT_EQ(file.title, model.title);
    EXPECT_EQ(file.operations, model.operations) << model.name;
    int inside = 0;
    for (int i = 0; i < model.points; i++) {
      const Point p = random.point(model.name == "tanglecube" ? 3 : 1);
      const double found = value_of(file.graph, file.root, p), expected = tape_value(content.str(), p);
      EXPECT_NEAR(found, expected, 1e-12 * (1 + std::abs(expected))) << model.name;
      inside += found < 0;
    }
    EXPECT_GT(inside, 0) << model.name;
    EXPECT_LT(inside, model.points) << model.name;
  }
  const ImplicitFile text = load_vm(shared_data("implicit") / "prospero.vm");
  for (const Point& corner : {Point{1, 1, 0}, Point{-1, 1, 0}, Point{1, -1, 0}, Point{-1, -1, 0}})
    EXPECT_GT(value_of(text.graph, text.root, corner), 0);
  // Deep in strokes of letters.
  for (const Point& stroke : {Point{0.4, 0.2, 0}, Point{0.2, 0.48, 0}, Point{-0.72, -0.2, 0}, Point{0.24, -0.48, 0}})
    EXPECT_LT(value_of(text.graph, text.root, stroke), -0.07);
}

TEST(ExpressionFiles, EveryTapeOperation) {
  const std::vector<std::tuple<std::string, double, double, double>> cases = {{"abs a", -2.5, 0, 2.5},
                                                                              {"neg a", 2, 0, -2},
                                                                              {"sqrt a", 9, 0, 3},
                                                                              {"square a", -3, 0, 9},
                                                                              {"floor a", -1.5, 0, -2},
                                                                              {"ceil a", -1.5, 0, -1},
                                                                              {"ceil a", 1.2, 0, 2},
                                                                              {"round a", 2.5, 0, 3},
                                                                              {"round a", -2.5, 0, -3},
                                                                              {"round a", 2.4, 0, 2},
                                                                              {"sin a", 0.3, 0, std::sin(0.3)},
                                                                              {"cos a", 0.3, 0, std::cos(0.3)},
                                                                              {"tan a", 0.3, 0, std::tan(0.3)},
                                                                              {"asin a", 0.3, 0, std::asin(0.3)},
                                                                              {"acos a", 0.3, 0, std::acos(0.3)},
                                                                              {"atan a", 0.3, 0, std::atan(0.3)},
                                                                              {"exp a", 0.3, 0, std::exp(0.3)},
                                                                              {"ln a", 0.3, 0, std::log(0.3)},
                                                                              {"not a", 0, 0, 1},
                                                                              {"not a", -3, 0, 0},
                                                                              {"add a b", 1, 2, 3},
                                                                              {"sub a b", 1, 3, -2},
                                                                              {"mul a b", 2, 3, 6},
                                                                              {"div a b", 3, 2, 1.5},
                                                                              {"min a b", 2, 3, 2},
                                                                              {"max a b", 2, 3, 3},
                                                                              {"atan2 a b", 1, -2, std::atan2(1, -2)},
                                                                              {"compare a b", 1, 2, -1},
                                                                              {"compare a b", 2, 2, 0},
                                                                              {"compare a b", 3, 2, 1},
                                                                              {"mod a b", -1, 3, 2},
                                                                              {"mod a b", -1, -3, 2},
                                                                              {"and a b", 0, 5, 0},
                                                                              {"and a b", 2, 5, 5},
                                                                              {"or a b", 0, 5, 5},
                                                                              {"or a b", 2, 5, 2}};
  for (const auto& [operation, a, b, expected] : cases) {
    const ImplicitFile file = parse_vm("a var-x\nb var-y\nc " + operation + "\n", "t.vm");
    EXPECT_EQ(value_of(file.graph, file.root, {a, b, 0}), expected) << operation << " of " << a << ", " << b;
    EXPECT_EQ(file.operations, 3u);
  }
  const ImplicitFile plain =
      load_vm(written("expression_plain.vm", "\n \n#\n# A plane\r\nq var-z\r\n# more\np const -.5e1\r\nr add q p"));
  EXPECT_EQ(plain.title, "A plane");
  EXPECT_EQ(value_of(plain.graph, plain.root, {0, 0, 7}), 2);
  EXPECT_EQ(parse_vm("x var-x", "folder/name.vm").title, "name");
}

TEST(ExpressionFiles, TapesThatAreWrong) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "\"bad.vm\": no operations"},
      {"# only a comment\n", "no operations"},
      {"a var-x\nb\n", "\"bad.vm\", line 2: found \"b\", expected a name and an operation"},
      {"a var-x\nb neg c\n", "line 2: \"c\" is not defined in any line above"},
      {"a neg a\n", "line 1: \"a\" is not defined in any line above"},
      {"a neg b\nb neg a\n", "line 1: \"b\" is not defined in any line above"},
      {"a var-x\n\na var-y\n", "line 3: \"a\" is defined a second time; the first was in line 1"},
      {"a var-x\nb cube a\n", "line 2: \"cube\" is no operation; known are const, var-x"},
      {"a var-w\n", "line 1: \"var-w\" is no operation"},
      {"a var-x\nb add a\n", "line 2: \"add\" takes 2 names, found 1"},
      {"a var-x\nb neg a a\n", "line 2: \"neg\" takes 1 name, found 2"},
      {"a var-x\nb add a a a a a a\n", "line 2: \"add\" takes 2 names, found more than 2"},
      {"a var-x a\n", "line 1: \"var-x\" takes 0 names, found 1"},
      {"a const\n", "line 1: \"const\" takes 1 number, found 0"},
      {"a const b\n", "line 1: the constant is \"b\", which is no number"},
      {"a const inf\n", "line 1: the constant is inf, out of range"},
      {"a const nan\n", "line 1: the constant is \"nan\", which is no number"},
      {"a const 1e999\n", "line 1: the constant is 1e999, out of range"},
      {std::string(10'000'000, 'a'), "line 1: found \"aaa"},
      {std::string(10'000'000, '\0'), "line 1: found \"???"},
      {repeated("a b ", 2'500'000), "line 1: \"b\" is no operation"},
      {std::string(10'000'000, '\n'), "no operations"},
      {std::string("\xFF\xFE") + "a", "line 1: found \"??a\""},
  };
  for (const auto& [text, fragment] : cases) expect_fragment(message_of([&] { parse_vm(text, "bad.vm"); }), fragment);
}

// Long and legal: no limit but that of the file.
TEST(ExpressionFiles, LongTapes) {
  std::string text = "n0 var-x\n";
  constexpr int length = 300'000;
  for (int i = 1; i < length; i++) text += fmt::format("n{} {} n{}\n", i, i % 2 ? "sin" : "neg", i - 1);
  const ImplicitFile file = parse_vm(text, "long.vm");
  EXPECT_EQ(file.operations, std::size_t(length));
  EXPECT_TRUE(std::isfinite(value_of(file.graph, file.root, {0.5, 0, 0})));
}

}  // namespace
}  // namespace smurf::expression
