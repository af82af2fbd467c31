#include "workloads/workloads.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <system_error>
#include <type_traits>

#include "surfaces/parametric/definition.hpp"

namespace smurf::workloads {
namespace {

constexpr std::uint32_t shading = std::uint32_t(Property::normal);
constexpr std::uint32_t curvature = Property::normal | Property::principal;
constexpr std::uint32_t everything =
    Property::value | Property::normal | std::uint32_t(Property::gauss) | Property::mean | Property::principal;

// A volume or a mesh that is made when first asked for, and shared by those who ask.
template <class Make>
std::function<std::invoke_result_t<Make>()> lazily(Make make) {
  auto made = std::make_shared<std::optional<std::invoke_result_t<Make>>>();
  return [made, make = std::move(make)] {
    if (!*made) *made = make();
    return **made;
  };
}

RayBatch marschner_lobb_rays(const Bounds&, int width) {
  Camera camera;
  camera.eye = {0.0, -3.2, 2.2};
  camera.look_at = glm::dvec3(0.0);
  camera.up = {0.0, 0.0, 1.0};
  camera.field_of_view = 45.0;
  camera.width = camera.height = width;
  return camera.rays();
}

RayBatch rays_on_the_whole(const Bounds& bounds, int width) { return fitted_camera(bounds, width, width).rays(); }

std::optional<std::filesystem::path> found(const std::vector<std::filesystem::path>& candidates) {
  for (const auto& path : candidates) {
    std::error_code failed;
    if (std::filesystem::is_regular_file(path, failed)) return path;
  }
  return std::nullopt;
}

std::optional<std::filesystem::path> test_data(const std::string& file) {
  std::vector<std::filesystem::path> candidates;
  if (const char* folder = std::getenv("SMURF_DATA")) candidates.push_back(std::filesystem::path(folder) / file);
  candidates.push_back(std::filesystem::path(SMURF_SOURCE_DIR) / "../shared/data" / file);
  return found(candidates);
}

std::optional<std::filesystem::path> bundled_volume(const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(SMURF_SOURCE_DIR) / "host/data";
  return found({folder / (name + ".nrrd"), folder / (name + ".nhdr"), folder / name / (name + ".nrrd"),
                folder / name / (name + ".nhdr")});
}

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return result;
}

// First hits with normals, all hits as they are (that is what the peers are asked for), and all hits with normals.
void add_first_and_all(std::vector<Workload>& list, Workload w, const std::string& name, const std::string& text) {
  w.kind = Kind::first_hit;
  w.name = name + "-first";
  w.text = text + ": first hits and normals";
  w.properties = shading;
  list.push_back(w);
  w.kind = Kind::all_hits;
  w.name = name + "-all";
  w.text = text + ": all hits, sorted";
  w.properties = 0;
  list.push_back(w);
  w.name = name + "-all-normals";
  w.text = text + ": all hits, sorted, and normals";
  w.properties = shading;
  list.push_back(w);
}

// First hit and all hits of a volume that is seen whole.
void add_whole_volume(std::vector<Workload>& list, const std::string& name, const std::string& text,
                      const std::filesystem::path& file, double isovalue) {
  Workload w;
  w.isovalue = isovalue;
  w.volume = lazily([file] { return load_volume(file); });
  w.rays = rays_on_the_whole;
  w.sizes = {512, 1024};
  add_first_and_all(list, w, name, fmt::format("{}, isovalue {}, trilinear", text, isovalue));
}

void add_marschner_lobb(std::vector<Workload>& list) {
  Workload w;
  w.isovalue = 0.5;
  w.rays = marschner_lobb_rays;
  w.sizes = {512, 1024};
  w.volume = lazily([] { return marschner_lobb_volume(256); });

  add_first_and_all(list, w, "W1", "Marschner-Lobb 256^3, isovalue 0.5, trilinear");

  w.name = "W1-tricubic";
  w.kind = Kind::first_hit;
  w.properties = curvature;
  w.reconstruction = Reconstruction::tricubic;
  w.text = "Marschner-Lobb 256^3, isovalue 0.5, tricubic: first hits, normals, principal curvatures";
  list.push_back(w);

  // The same images on an eighth of the samples: how cost grows with the volume.
  w.name = "W1-first-128";
  w.volume = lazily([] { return marschner_lobb_volume(128); });
  w.properties = shading;
  w.reconstruction = Reconstruction::trilinear;
  w.sizes = {1024};
  w.text = "Marschner-Lobb 128^3, isovalue 0.5, trilinear: first hits and normals";
  list.push_back(w);

  Workload p;
  p.name = "W4-probe";
  p.kind = Kind::probe;
  p.isovalue = 0.5;
  p.reconstruction = Reconstruction::tricubic;
  p.properties = everything;
  p.sizes = {100'000, 1'000'000};
  p.volume = lazily([] { return marschner_lobb_volume(128); });
  p.text = "Marschner-Lobb 128^3, tricubic: value, normal, Gauss, mean and principal curvatures at random points";
  list.push_back(p);
}

// Equations, seen along -z in parallel projection.
void add_equations(std::vector<Workload>& list) {
  Workload w;
  w.rays = [](const Bounds& bounds, int width) {
    Camera camera;
    camera.look_at = 0.5 * (bounds.lower + bounds.upper);
    camera.eye = camera.look_at + glm::dvec3(0, 0, bounds.upper.z - bounds.lower.z);
    camera.up = {0, 1, 0};
    camera.orthographic_height = bounds.upper.y - bounds.lower.y;
    camera.width = camera.height = width;
    return camera.rays();
  };
  w.sizes = {512, 1024};
  w.equation = "max(sin(6*x)*cos(6*y)+sin(6*y)*cos(6*z)+sin(6*z)*cos(6*x), x^2+y^2+z^2-1)";
  w.domain = {glm::dvec3(-1.1), glm::dvec3(1.1), 0};
  add_first_and_all(list, w, "W3a", "gyroid within a sphere");
  w.equation = "x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+11.8";
  w.domain = {glm::dvec3(-3), glm::dvec3(3), 0};
  add_first_and_all(list, w, "W3b", "tanglecube");
}

// A mesh that is seen whole, and chords in all directions. Hits are told with face and barycentrics, as the peer tells
// them; no properties are measured on top.
void add_mesh(Catalogue& all) {
  const BunnyOrSphere source = bunny_or_sphere();
  Workload w;
  w.mesh = source.mesh;
  w.sizes = {512, 1024};
  const auto add = [&](const std::string& name, const std::string& text,
                       const std::function<RayBatch(const Bounds&, int)>& rays) {
    w.rays = rays;
    for (const Kind kind : {Kind::first_hit, Kind::all_hits}) {
      const std::string which = kind == Kind::first_hit ? "-first" : "-all";
      w.kind = kind;
      w.name = "W8-" + std::string(source.is_bunny ? "" : "sphere-") + name + which;
      w.text = fmt::format("{}, {}: {}, by face and place on it", source.is_bunny ? "bunny00" : "bumpy sphere", text,
                           kind == Kind::first_hit ? "first hits" : "all hits, sorted");
      all.workloads.push_back(w);
      if (!source.is_bunny) all.missing.push_back({"W8-" + name + which, source.why_not});
    }
  };
  add("camera", "camera", rays_on_the_whole);
  add("chords", "random chords of its sphere", random_chords);
}

// Patches that are seen whole, and chords in all directions; hits are told with patch, u and v. Another surface of two
// expressions' worth of sines beside it.
void add_parametric(Catalogue& all) {
  const TeapotOrRing source = teapot_or_ring();
  Workload w;
  w.patches = source.patches;
  w.sizes = {512, 1024};
  const std::string model = source.is_teapot ? "teapot of 32 bicubic patches" : "ring of 32 bicubic patches";
  const auto add = [&](const std::string& name, const std::string& text, Kind kind, std::uint32_t properties,
                       const std::function<RayBatch(const Bounds&, int)>& rays) {
    w.name = "W7-" + std::string(source.is_teapot ? "" : "ring-") + name;
    w.text = model + ", " + text;
    w.kind = kind;
    w.properties = properties;
    w.rays = rays;
    all.workloads.push_back(w);
    if (!source.is_teapot) all.missing.push_back({"W7-" + name, source.why_not});
  };
  add("camera-first", "camera: first hits and normals", Kind::first_hit, shading, rays_on_the_whole);
  add("camera-all", "camera: all hits, sorted, with u and v", Kind::all_hits, 0, rays_on_the_whole);
  add("chords-all", "random chords of its sphere: all hits, sorted, with u and v", Kind::all_hits, 0, random_chords);

  Workload torus;
  torus.position = {"(2+cos(v))*cos(u)", "(2+cos(v))*sin(u)", "sin(v)"};
  torus.u = torus.v = {0, 2 * std::numbers::pi};
  torus.sizes = {512, 1024};
  torus.rays = rays_on_the_whole;
  torus.kind = Kind::first_hit;
  torus.name = "W7-torus-first";
  torus.text = "torus by expressions of u and v, camera: first hits and normals";
  torus.properties = shading;
  all.workloads.push_back(torus);
  torus.kind = Kind::all_hits;
  torus.name = "W7-torus-all";
  torus.text = "torus by expressions of u and v, camera: all hits, sorted, with u and v";
  torus.properties = 0;
  all.workloads.push_back(torus);
}

}  // namespace

CastOptions Workload::cast_options() const {
  CastOptions options;
  options.hits = kind == Kind::all_hits ? Hits::all : Hits::first;
  options.properties = properties;
  return options;
}

double Workload::length_unit() const {
  glm::dvec3 extent = domain.upper - domain.lower;
  if (mesh) extent = glm::dvec3(mesh().upper() - mesh().lower());
  if (parametric()) {
    const Bounds bounds = surface().bounds();
    extent = bounds.upper - bounds.lower;
  }
  if (!samples()) return std::max({extent.x, extent.y, extent.z}) / 1024;
  const glm::dmat3 axes = volume().placement().axes;
  return std::min({glm::length(axes[0]), glm::length(axes[1]), glm::length(axes[2])});
}

double Workload::value_unit() const {
  const double range = samples() ? volume().maximum() - volume().minimum() : 1;
  return range > 0 ? range : 1;
}

Surface Workload::surface() const {
  if (mesh) return mesh_surface(mesh());
  if (patches) return nurbs(patches());
  if (parametric()) return smurf::parametric(position, u, v);
  if (!samples()) return implicit(equation, domain);
  GridOptions options;
  options.reconstruction = reconstruction;
  return isosurface(volume(), isovalue, options);
}

Catalogue catalogue(std::string_view filter) {
  Catalogue all;
  add_marschner_lobb(all.workloads);
  if (const auto lobster = test_data("volumes/lobster.nhdr")) {
    add_whole_volume(all.workloads, "W2", "lobster CT 301x324x56", *lobster, 40.5);
  } else {
    for (const char* name : {"W2-first", "W2-all"})
      all.missing.push_back(
          {name, "volumes/lobster.nhdr is neither in $SMURF_DATA nor in shared/data beside the sources"});
  }
  if (const auto head = bundled_volume("headsq")) {
    add_whole_volume(all.workloads, "W2-headsq", "CT head 64x64x93", *head, 500.5);
  } else {
    for (const char* name : {"W2-headsq-first", "W2-headsq-all"})
      all.missing.push_back({name, "the bundled volume headsq is not in host/data of the sources"});
  }

  add_equations(all.workloads);
  add_mesh(all);
  add_parametric(all);

  const std::string wanted = lower(filter);
  auto passed_over = [&](const auto& entry) { return lower(entry.name).find(wanted) == std::string::npos; };
  std::erase_if(all.workloads, passed_over);
  std::erase_if(all.missing, passed_over);
  std::ranges::stable_sort(all.workloads, {}, [](const Workload& w) { return w.name.substr(0, 2); });
  return all;
}

Mesh bumpy_sphere(std::size_t triangles) {
  const int rings = std::max(3, int(std::sqrt(double(triangles) / 4)));
  const int sectors = 2 * rings;
  std::vector<glm::vec3> vertices;
  std::vector<glm::uvec3> faces;
  for (int i = 0; i <= rings; i++) {
    for (int j = 0; j < sectors; j++) {
      const double polar = std::numbers::pi * i / rings, azimuth = 2 * std::numbers::pi * j / sectors;
      const double sine = i < rings ? std::sin(polar) : 0;
      const double radius = 1 + 0.1 * std::sin(9 * polar) * std::sin(7 * azimuth);
      vertices.emplace_back(radius * sine * std::cos(azimuth), radius * sine * std::sin(azimuth),
                            sine > 0 ? radius * std::cos(polar) : std::cos(polar));
    }
  }
  for (int i = 0; i < rings; i++) {
    for (int j = 0; j < sectors; j++) {
      const int k = (j + 1) % sectors;
      const unsigned a = unsigned(i * sectors + j), b = unsigned((i + 1) * sectors + j);
      const unsigned c = unsigned((i + 1) * sectors + k), d = unsigned(i * sectors + k);
      faces.emplace_back(a, b, c);
      faces.emplace_back(a, c, d);
    }
  }
  return make_mesh(vertices, faces, {.weld = true});
}

std::vector<Patch> bicubic_ring() {
  constexpr int around = 8, across = 4;
  // A cubic's control points of an arc: its ends, and tangents of this length (in radii).
  const auto arc = [](int parts, int part) {
    const double angle = 2 * std::numbers::pi / parts, tangent = 4.0 / 3 * std::tan(angle / 4);
    const auto end = [=](int i) {
      const double a = angle * (i % parts);
      return glm::dvec2(std::cos(a), std::sin(a));
    };
    const glm::dvec2 from = end(part), to = end(part + 1);
    return std::array{from, from + tangent * glm::dvec2(-from.y, from.x), to - tangent * glm::dvec2(-to.y, to.x), to};
  };
  std::vector<Patch> patches;
  for (int j = 0; j < across; j++) {
    for (int i = 0; i < around; i++) {
      std::vector<glm::dvec4> points;
      for (const glm::dvec2& small : arc(across, j)) {
        for (const glm::dvec2& great : arc(around, i)) points.emplace_back((2 + small.x) * great, small.y, 1);
      }
      patches.push_back(bezier_patch(3, 3, points));
    }
  }
  return patches;
}

TeapotOrRing teapot_or_ring() {
  if (const auto teapot = test_data("patches/teapot.bpt")) {
    return {lazily([teapot] {
              const Surface surface = load_nurbs(*teapot);
              return static_cast<const ParametricSurface&>(surface.model()).patches;
            }),
            true, ""};
  }
  return {lazily([] { return bicubic_ring(); }), false,
          "patches/teapot.bpt is neither in $SMURF_DATA nor in shared/data beside the sources; a ring of as many "
          "patches is measured in its place, by the name of ring"};
}

BunnyOrSphere bunny_or_sphere() {
  constexpr std::size_t triangles = 75'408;  // the bunny's
  const char* file = std::getenv("SMURF_BUNNY");
  if (const auto bunny = found({file ? file : ""})) return {lazily([bunny] { return load_mesh(*bunny); }), true, ""};
  const std::string why = file ? fmt::format("$SMURF_BUNNY names no file, but \"{}\"", file)
                               : "$SMURF_BUNNY does not name bunny00.off (Debian package libcgal-demo)";
  return {lazily([] { return bumpy_sphere(triangles); }), false,
          why + "; a generated mesh is measured in its place, by the name of sphere"};
}

RayBatch random_chords(const Bounds& bounds, int width) {
  const glm::dvec3 centre = 0.5 * (bounds.lower + bounds.upper);
  const double radius = 0.5 * glm::length(bounds.upper - bounds.lower);
  Dice dice(5);
  const auto anywhere = [&] {
    const double z = 2 * dice.unit() - 1, azimuth = 2 * std::numbers::pi * dice.unit(), across = std::sqrt(1 - z * z);
    return centre + radius * glm::dvec3(across * std::cos(azimuth), across * std::sin(azimuth), z);
  };
  RayBatch rays(std::size_t(width) * std::size_t(width));
  for (std::size_t i = 0; i < rays.size(); i++) {
    const glm::dvec3 from = anywhere(), to = anywhere();
    rays.set(i, {glm::vec3(from), glm::vec3(to - from)});
  }
  return rays;
}

RayBatch rays_of(const Workload& workload, const Surface& surface, int width) {
  return workload.rays(surface.bounds(), width);
}

std::vector<glm::vec3> points_of(const Surface& surface, int count) {
  const Bounds bounds = surface.bounds();
  Dice dice(4);
  std::vector<glm::vec3> points;
  points.reserve(std::size_t(count));
  for (int i = 0; i < count; i++) {
    const double x = dice.unit(), y = dice.unit(), z = dice.unit();
    points.emplace_back(bounds.lower + (bounds.upper - bounds.lower) * glm::dvec3(x, y, z));
  }
  return points;
}

// Steele, Lea and Flood's SplitMix64.
std::uint64_t Dice::bits() {
  std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

}  // namespace smurf::workloads
