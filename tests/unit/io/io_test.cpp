// Tables, images and whole-or-nothing output files; ray batches and cameras.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>

#include "harness/refusal.hpp"
#include "io/atomic_file.hpp"
#include "io/png.hpp"
#include "io/ray_table.hpp"
#include "io/result_table.hpp"
#include "smurf/camera.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;
using test::refusal;

// A folder of the running test, empty.
fs::path test_folder() {
  fs::path folder = fs::path(SMURF_TEST_OUTPUT) / "io" / testing::UnitTest::GetInstance()->current_test_info()->name();
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

fs::path put(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
  return file;
}

std::string get(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::size_t entries(const fs::path& folder) {
  return std::size_t(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

#define EXPECT_REFUSED_AS(code, action, part)                                           \
  do {                                                                                  \
    const std::string message = refusal(ErrorCode::code, [&] { action; });              \
    EXPECT_NE(message.find(part), std::string::npos) << "the message was: " << message; \
  } while (false)

// Floats of all magnitudes, normal and not, by their bits.
std::vector<float> test_floats(std::size_t count) {
  std::mt19937 random(3);
  std::vector<float> values(count);
  for (float& value : values) {
    do value = std::bit_cast<float>(std::uint32_t(random()));
    while (std::isnan(value));
  }
  const float special[] = {0.0f, -0.0f,      INFINITY, -INFINITY, 1e-45f, std::numeric_limits<float>::max(),
                           0.1f, 16777216.0f};
  std::copy(std::begin(special), std::end(special), values.begin());
  return values;
}

// ---- CSV in

TEST(RayTable, reads_columns_in_any_order) {
  const fs::path folder = test_folder();
  const RayBatch rays = read_rays(put(folder / "rays.csv",
                                      "\xEF\xBB\xBF dz, dy,dx ,name,oz,oy,ox,tmax\r\n"
                                      "1,2,3,\"a, b\",4, 5 ,\t6,inf\r\n"
                                      "\r\n"
                                      "-1e-3,+2,.5,,4.,1e39,-0,\"7.5\"\r\n\r\n  \n"));
  ASSERT_EQ(rays.size(), 2u);
  EXPECT_EQ(rays[0].origin, glm::vec3(6, 5, 4));
  EXPECT_EQ(rays[0].direction, glm::vec3(3, 2, 1));
  EXPECT_EQ(rays[0].t_min, 0.0f);
  EXPECT_EQ(rays[0].t_max, INFINITY);
  EXPECT_EQ(rays[1].origin, glm::vec3(-0.0f, INFINITY, 4));
  EXPECT_EQ(rays[1].direction, glm::vec3(0.5f, 2, -1e-3f));
  EXPECT_EQ(rays[1].t_max, 7.5f);
  const RayBatch limited = read_rays(put(folder / "rays.csv", "ox,oy,oz,dx,dy,dz,tmin,tmax\n0,0,0,0,0,1,0.25,nan"));
  EXPECT_EQ(limited[0].t_min, 0.25f);
  EXPECT_TRUE(std::isnan(limited[0].t_max));
  EXPECT_EQ(read_rays(put(folder / "rays.csv", "ox,oy,oz,dx,dy,dz")).size(), 0u);
}

TEST(RayTable, reads_points) {
  const fs::path folder = test_folder();
  const PointTable plain = read_points(put(folder / "points.csv", "x,y,z\n1,2,3\n4,5,6\n"));
  EXPECT_EQ(plain.points, (std::vector<glm::vec3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_FALSE(plain.has_directions);
  const PointTable directed = read_points(put(folder / "points.csv", "dx,dy,dz,x,y,z\n0,0,1,1,2,3\n"));
  EXPECT_EQ(directed.points, (std::vector<glm::vec3>{{1, 2, 3}}));
  EXPECT_EQ(directed.directions, (std::vector<glm::vec3>{{0, 0, 1}}));
  EXPECT_REFUSED_AS(input, read_points(put(folder / "points.csv", "x,y,z,dx,dy\n1,2,3,4,5\n")), "dx,dy,dz");
}

TEST(RayTable, refuses_what_is_no_table) {
  const fs::path folder = test_folder();
  const std::string header = "ox,oy,oz,dx,dy,dz\n";
  const auto load = [&](const std::string& text) { read_rays(put(folder / "rays.csv", text)); };
  EXPECT_REFUSED_AS(input, read_rays(folder / "missing.csv"), "missing.csv\": No such file");
  EXPECT_REFUSED_AS(input, read_rays(folder), "folder");
  EXPECT_REFUSED_AS(input, load(""), "empty");
  EXPECT_REFUSED_AS(input, load("ox,oy,oz,dx,dy\n0,0,0,0,0\n"), "no column \"dz\"");
  EXPECT_REFUSED_AS(input, load("1,2,3,4,5,6\n"), "no column \"ox\"");
  EXPECT_REFUSED_AS(input, load("ox,oy,oz,dx,dy,dz,ox\n1,2,3,4,5,6,7\n"), "twice");
  EXPECT_REFUSED_AS(input, load(header + "1,2,3,4,5,6\n1,2,3,4,5\n"),
                    "rays.csv\", line 3: 5 cells, but the header has 6");
  EXPECT_REFUSED_AS(input, load(header + "1,2,3,4,5,6,7\n"), "7 cells");
  EXPECT_REFUSED_AS(input, load(header + "\n1,2,three,4,5,6\n"),
                    "line 3: column \"oz\" holds \"three\", which is no number");
  EXPECT_REFUSED_AS(input, load(header + "1,2,,4,5,6\n"), "column \"oz\" holds \"\"");
  EXPECT_REFUSED_AS(input, load(header + "1,2,3mm,4,5,6\n"), "3mm");
  EXPECT_REFUSED_AS(input, load(header + "1,2,0x1,4,5,6\n"), "0x1");
  EXPECT_REFUSED_AS(input, load(header + "1,2,+-1,4,5,6\n"), "+-1");
  EXPECT_REFUSED_AS(input, load(header + "1,2,\"3,4,5,6\n"), "quote");
  EXPECT_REFUSED_AS(input, load(header + std::string("1,2,\0,4,5,6\n", 12)), "oz");
  EXPECT_REFUSED_AS(input, load(header + "1,2," + std::string(100000, 'x') + ",4,5,6\n"), "...");
}

TEST(RayTable, is_fast) {
  const fs::path file = test_folder() / "rays.csv";
  const std::size_t count = 200000;
  const std::vector<float> values = test_floats(count);
  Table table;
  for (const char* name : {"ox", "oy", "oz", "dx", "dy", "dz"}) table.add(name, std::span<const float>(values));
  write_table(table, file);
  const auto start = std::chrono::steady_clock::now();
  const RayBatch rays = read_rays(file);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  EXPECT_EQ(rays.size(), count);
  RecordProperty("microseconds_per_row", std::to_string(seconds.count() / double(count) * 1e6));
  EXPECT_LT(seconds.count(), 10.0);  // about 0.2 s; the bound is for sanitizers and busy machines
}

// ---- Tables out

TEST(ResultTable, floats_read_back_to_the_same_bits) {
  const fs::path file = test_folder() / "points.csv";
  const std::vector<float> values = test_floats(30000);
  std::vector<glm::vec3> points(values.size() / 3);
  std::memcpy(static_cast<void*>(points.data()), values.data(), values.size() * sizeof(float));
  Table table;
  table.add({"x", "y", "z"}, points);
  write_table(table, file);
  const PointTable read = read_points(file);
  ASSERT_EQ(read.points.size(), points.size());
  EXPECT_EQ(std::memcmp(read.points.data(), points.data(), values.size() * sizeof(float)), 0);
}

struct Sample {
  std::vector<std::uint32_t> rays{0, 4294967295u};
  std::vector<std::uint64_t> offsets{7, 18446744073709551615u};
  std::vector<float> t{0.1f, NAN};
  std::vector<std::string_view> status{"isolated", "a, \"b\""};
  std::vector<glm::vec3> locations{{1, 2, 3}, {4, 5, 1e-20f}};
  std::vector<glm::vec2> curvatures{{2, 1}, {INFINITY, -0.0f}};
  std::vector<glm::vec3> directions{{1, 0, 0}, {0, 1, 0}};

  Table table() const {
    Table table;
    table.add("ray", rays);
    table.add("offset", offsets);
    table.add("t", t);
    table.add("status", status);
    table.add({"x", "y", "z"}, locations);
    table.add({"k1", "k2"}, curvatures);
    table.add({"d1x", "d1y", "d1z"}, directions);
    return table;
  }
};

TEST(ResultTable, writes_csv) {
  const fs::path file = test_folder() / "hits.csv";
  const Sample sample;
  write_table(sample.table(), file);
  EXPECT_EQ(get(file),
            "ray,offset,t,status,x,y,z,k1,k2,d1x,d1y,d1z\n"
            "0,7,0.1,isolated,1,2,3,2,1,1,0,0\n"
            "4294967295,18446744073709551615,nan,\"a, \"\"b\"\"\",4,5,1e-20,inf,-0,0,1,0\n");
  Table empty;
  empty.add("ray", std::span<const std::uint32_t>());
  empty.add({"x", "y", "z"}, std::span<const glm::vec3>());
  write_table(empty, file);
  EXPECT_EQ(get(file), "ray,x,y,z\n");
}

TEST(ResultTable, refuses_columns_that_do_not_fit) {
  const Sample sample;
  Table table = sample.table();
  EXPECT_THROW(table.add("t", sample.t), std::logic_error);
  EXPECT_THROW(table.add("u", std::span(sample.t).first(1)), std::logic_error);
}

std::string decoded(const std::string& text) {
  static const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | std::uint32_t(digits.find(c));
    if ((count += 6) >= 8) out += char(bits >> (count -= 8));
  }
  return out;
}

// The bytes of a DataArray; checks its type, its components and that its header word tells its length.
std::string array_bytes(const std::string& document, const std::string& name, const std::string& type, int components) {
  const auto named = document.find(" Name=\"" + name + "\"");
  if (named == document.npos) return "no array " + name;
  const auto open = document.rfind('<', named), text = document.find('>', named) + 1;
  const std::string tag = document.substr(open, text - open);
  EXPECT_NE(tag.find("type=\"" + type + "\""), tag.npos) << tag;
  EXPECT_NE(tag.find("format=\"binary\""), tag.npos) << tag;
  EXPECT_EQ(tag.find("NumberOfComponents=\"" + std::to_string(components) + "\"") != tag.npos, components > 1) << tag;
  const std::string bytes = decoded(document.substr(text, document.find('<', text) - text));
  std::uint64_t size = 0;
  if (bytes.size() >= 8) std::memcpy(&size, bytes.data(), 8);
  EXPECT_EQ(size + 8, bytes.size()) << name;
  return bytes.substr(8);
}

template <class T>
std::string raw(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

TEST(ResultTable, writes_vtk_xml) {
  const fs::path file = test_folder() / "hits.vtp";
  const Sample sample;
  write_table(sample.table(), file);
  const std::string document = get(file);
  EXPECT_NE(document.find("<VTKFile type=\"PolyData\" version=\"1.0\""), document.npos);
  EXPECT_NE(document.find("NumberOfPoints=\"2\" NumberOfVerts=\"2\""), document.npos);
  EXPECT_LT(document.find("<Points>"), document.find("Name=\"Points\""));
  EXPECT_EQ(array_bytes(document, "Points", "Float32", 3), raw(sample.locations));
  EXPECT_EQ(array_bytes(document, "d1", "Float32", 3), raw(sample.directions));
  EXPECT_EQ(array_bytes(document, "ray", "UInt32", 1), raw(sample.rays));
  EXPECT_EQ(array_bytes(document, "offset", "UInt64", 1), raw(sample.offsets));
  EXPECT_EQ(array_bytes(document, "t", "Float32", 1), raw(sample.t));
  EXPECT_EQ(array_bytes(document, "k2", "Float32", 1), raw(std::vector<float>{1.0f, -0.0f}));
  EXPECT_EQ(array_bytes(document, "status", "String", 1), std::string("isolated\0a, \"b\"\0", 16));
  EXPECT_EQ(array_bytes(document, "connectivity", "Int64", 1), raw(std::vector<std::int64_t>{0, 1}));
  EXPECT_EQ(array_bytes(document, "offsets", "Int64", 1), raw(std::vector<std::int64_t>{1, 2}));

  Table unplaced;
  unplaced.add("t", sample.t);
  EXPECT_THROW(write_table(unplaced, file), std::logic_error);
  EXPECT_EQ(get(file), document);
  EXPECT_EQ(entries(file.parent_path()), 1u);
}

// ---- Whole or not at all

TEST(AtomicFile, replaces_only_on_commit) {
  const fs::path folder = test_folder(), file = put(folder / "out.csv", "before");
  {
    AtomicFile out(file);
    out.write("half of ");
    EXPECT_EQ(get(file), "before");
  }
  EXPECT_EQ(get(file), "before");
  EXPECT_EQ(entries(folder), 1u);
  {
    AtomicFile out(file);
    out.write("after");
    out.commit();
  }
  EXPECT_EQ(get(file), "after");
  EXPECT_EQ(entries(folder), 1u);
}

TEST(AtomicFile, keeps_links_and_permissions) {
  const fs::path folder = test_folder(), file = put(folder / "target", "before");
  fs::create_symlink("target", folder / "link");
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  write_file(folder / "link", "after");
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(get(file), "after");
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  const mode_t mask = umask(022);
  write_file(folder / "new", "");
  umask(mask);
  EXPECT_EQ(unsigned(fs::status(folder / "new").permissions()), 0644u);
}

TEST(AtomicFile, says_what_is_wrong) {
  const fs::path folder = test_folder();
  EXPECT_REFUSED_AS(io, write_file(folder / "none" / "out.csv", "x"), "none/out.csv\": No such file or directory");
  EXPECT_REFUSED_AS(io, write_file(folder, "x"), "directory");
  EXPECT_REFUSED_AS(io, write_file("", "x"), "No such file");
  EXPECT_EQ(entries(folder), 0u);
  if (fs::exists("/dev/full")) {
    EXPECT_REFUSED_AS(io, write_file("/dev/full", "x"), "/dev/full");
    EXPECT_REFUSED_AS(io, write_file("/dev/full", std::string(1 << 20, 'x')), "/dev/full");
  }
  write_file("/dev/null", "x");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));  // written to, not replaced
}

// ---- Images

Image test_image(int width, int height, bool opaque) {
  Image image{width, height, std::vector<std::uint8_t>(std::size_t(width) * std::size_t(height) * 4)};
  std::mt19937 random(5);
  for (std::size_t i = 0; i < image.rgba.size(); i++)
    image.rgba[i] = opaque && i % 4 == 3 ? 255 : std::uint8_t(random());
  return image;
}

TEST(Png, reads_back_to_the_same_pixels) {
  const fs::path folder = test_folder();
  for (const bool opaque : {true, false}) {
    const Image image = test_image(37, 21, opaque);
    save_png(image, folder / "image.png");
    EXPECT_EQ(get(folder / "image.png")[25], opaque ? 2 : 6);  // colour type: RGB, RGBA
    const Image read = load_png(folder / "image.png");
    EXPECT_EQ(read.width, 37);
    EXPECT_EQ(read.height, 21);
    EXPECT_EQ(read.rgba, image.rgba);
  }
  EXPECT_EQ(entries(folder), 1u);
}

TEST(Png, refuses) {
  const fs::path folder = test_folder();
  EXPECT_REFUSED_AS(input, save_png({0, 5, {}}, folder / "image.png"), "0 x 5");
  EXPECT_REFUSED_AS(input, save_png({2, 2, std::vector<std::uint8_t>(12)}, folder / "image.png"), "16 bytes, not 12");
  EXPECT_REFUSED_AS(io, save_png(test_image(2, 2, true), folder / "none" / "image.png"), "none/image.png");
  EXPECT_EQ(entries(folder), 0u);
  EXPECT_REFUSED_AS(input, load_png(folder / "missing.png"), "missing.png");
  save_png(test_image(64, 64, true), folder / "whole.png");
  EXPECT_REFUSED_AS(input, load_png(put(folder / "half.png", get(folder / "whole.png").substr(0, 5000))), "half.png");
  EXPECT_REFUSED_AS(input, load_png(put(folder / "text.png", "no image")), "text.png");
}

// ---- Rays and cameras

TEST(RayBatch, holds_components_one_after_another) {
  RayBatch rays(3);
  EXPECT_EQ(rays[2].direction, glm::vec3(0, 0, 1));
  EXPECT_EQ(rays[2].t_max, INFINITY);
  const Ray ray{.origin = {1, 2, 3}, .direction = {4, 5, 6}, .t_min = 7, .t_max = 8};
  rays.set(1, ray);
  for (int c = 0; c < RayBatch::component_count; c++) {
    EXPECT_EQ(rays.component(RayBatch::Component(c))[1], float(c + 1));
    EXPECT_EQ(rays.data()[3 * c + 1], float(c + 1));
  }
  const std::vector<Ray> list{Ray{}, ray};
  const RayBatch copied{std::span<const Ray>(list)};
  EXPECT_EQ(copied.size(), 2u);
  EXPECT_EQ(copied[1].direction, ray.direction);
  EXPECT_EQ(copied[1].t_min, 7.0f);
  EXPECT_EQ(RayBatch().size(), 0u);
}

TEST(Camera, sends_rays_through_pixel_centres) {
  const Camera camera{
      .eye = {0, -3, 0}, .look_at = {0, 0, 0}, .up = {0, 0, 1}, .field_of_view = 90, .width = 4, .height = 2};
  const RayBatch rays = camera.rays();
  ASSERT_EQ(rays.size(), 8u);
  EXPECT_EQ(rays.image_width, 4u);
  const glm::dvec3 upper_left = glm::normalize(glm::dvec3(-1.5, 1, 0.5));  // x to the right, z upwards
  EXPECT_NEAR(glm::distance(glm::dvec3(rays[0].direction), upper_left), 0, 1e-7);
  EXPECT_NEAR(glm::distance(glm::dvec3(rays[7].direction), upper_left * glm::dvec3(-1, 1, -1)), 0, 1e-7);
  for (std::size_t i = 0; i < rays.size(); i++) {
    EXPECT_EQ(rays[i].origin, glm::vec3(0, -3, 0));
    EXPECT_NEAR(glm::length(rays[i].direction), 1, 1e-6);
  }
}

TEST(Camera, projects_in_parallel) {
  const Camera camera{
      .eye = {0, 0, 5}, .look_at = {0, 0, 0}, .up = {0, 1, 0}, .orthographic_height = 4, .width = 2, .height = 2};
  const RayBatch rays = camera.rays();
  EXPECT_EQ(rays[0].origin, glm::vec3(-1, 1, 5));
  EXPECT_EQ(rays[3].origin, glm::vec3(1, -1, 5));
  for (std::size_t i = 0; i < 4; i++) EXPECT_EQ(rays[i].direction, glm::vec3(0, 0, -1));
}

TEST(Camera, refuses) {
  EXPECT_REFUSED_AS(input, (Camera{.width = 0}.rays()), "0 x 512");
  EXPECT_REFUSED_AS(input, (Camera{.eye = {1, 2, 3}, .look_at = {1, 2, 3}}.rays()), "same point");
  EXPECT_REFUSED_AS(input, (Camera{.eye = {0, 0, -3}}.rays()), "parallel");
  EXPECT_REFUSED_AS(input, (Camera{.up = {0, 0, 0}}.rays()), "zero");
  EXPECT_REFUSED_AS(input, (Camera{.eye = {NAN, 0, 0}}.rays()), "finite");
  EXPECT_REFUSED_AS(input, (Camera{.field_of_view = 180}.rays()), "180");
  EXPECT_REFUSED_AS(input, (Camera{.orthographic_height = INFINITY}.rays()), "orthographic");
}

TEST(Camera, fits_bounds) {
  const Camera camera = fitted_camera({{0, 0, 0}, {2, 4, 4}}, 320, 200);
  EXPECT_EQ(camera.look_at, glm::dvec3(1, 2, 2));
  EXPECT_NEAR(glm::distance(camera.eye, camera.look_at), 1.6 * 6, 1e-12);
  EXPECT_LT(camera.eye.y, camera.look_at.y);
  EXPECT_EQ(camera.rays().size(), 64000u);
  EXPECT_EQ(fitted_camera({}, 8, 8).rays().size(), 64u);
}

}  // namespace
}  // namespace smurf
