#include "workloads/workloads.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <system_error>

namespace smurf::workloads {
namespace {

constexpr std::uint32_t shading = std::uint32_t(Property::normal);
constexpr std::uint32_t curvature = Property::normal | Property::principal;
constexpr std::uint32_t everything =
    Property::value | Property::normal | std::uint32_t(Property::gauss) | Property::mean | Property::principal;

// A volume that is made when first asked for, and shared by those who ask.
std::function<Volume()> lazily(std::function<Volume()> make) {
  auto made = std::make_shared<std::optional<Volume>>();
  return [made, make = std::move(make)] {
    if (!*made) *made = make();
    return **made;
  };
}

Camera marschner_lobb_camera(const Bounds&, int width) {
  Camera camera;
  camera.eye = {0.0, -3.2, 2.2};
  camera.look_at = glm::dvec3(0.0);
  camera.up = {0.0, 0.0, 1.0};
  camera.field_of_view = 45.0;
  camera.width = camera.height = width;
  return camera;
}

Camera whole_volume_camera(const Bounds& bounds, int width) { return fitted_camera(bounds, width, width); }

std::optional<std::filesystem::path> found(const std::vector<std::filesystem::path>& candidates) {
  for (const auto& path : candidates) {
    std::error_code failed;
    if (std::filesystem::is_regular_file(path, failed)) return path;
  }
  return std::nullopt;
}

std::optional<std::filesystem::path> test_volume(const std::string& file) {
  std::vector<std::filesystem::path> candidates;
  if (const char* folder = std::getenv("SMURF_DATA"))
    candidates.push_back(std::filesystem::path(folder) / "volumes" / file);
  candidates.push_back(std::filesystem::path(SMURF_SOURCE_DIR) / "../shared/data/volumes" / file);
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
  w.camera = whole_volume_camera;
  w.sizes = {512, 1024};
  add_first_and_all(list, w, name, fmt::format("{}, isovalue {}, trilinear", text, isovalue));
}

void add_marschner_lobb(std::vector<Workload>& list) {
  Workload w;
  w.isovalue = 0.5;
  w.camera = marschner_lobb_camera;
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
  w.camera = [](const Bounds& bounds, int width) {
    Camera camera;
    camera.look_at = 0.5 * (bounds.lower + bounds.upper);
    camera.eye = camera.look_at + glm::dvec3(0, 0, bounds.upper.z - bounds.lower.z);
    camera.up = {0, 1, 0};
    camera.orthographic_height = bounds.upper.y - bounds.lower.y;
    camera.width = camera.height = width;
    return camera;
  };
  w.sizes = {512, 1024};
  w.equation = "max(sin(6*x)*cos(6*y)+sin(6*y)*cos(6*z)+sin(6*z)*cos(6*x), x^2+y^2+z^2-1)";
  w.domain = {glm::dvec3(-1.1), glm::dvec3(1.1), 0};
  add_first_and_all(list, w, "W3a", "gyroid within a sphere");
  w.equation = "x^4-5*x^2+y^4-5*y^2+z^4-5*z^2+11.8";
  w.domain = {glm::dvec3(-3), glm::dvec3(3), 0};
  add_first_and_all(list, w, "W3b", "tanglecube");
}

}  // namespace

CastOptions Workload::cast_options() const {
  CastOptions options;
  options.hits = kind == Kind::all_hits ? Hits::all : Hits::first;
  options.properties = properties;
  return options;
}

double Workload::length_unit() const {
  const glm::dvec3 extent = domain.upper - domain.lower;
  if (!samples()) return std::max({extent.x, extent.y, extent.z}) / 1024;
  const glm::dmat3 axes = volume().placement().axes;
  return std::min({glm::length(axes[0]), glm::length(axes[1]), glm::length(axes[2])});
}

double Workload::value_unit() const {
  const double range = samples() ? volume().maximum() - volume().minimum() : 1;
  return range > 0 ? range : 1;
}

Surface Workload::surface() const {
  if (!samples()) return implicit(equation, domain);
  GridOptions options;
  options.reconstruction = reconstruction;
  return isosurface(volume(), isovalue, options);
}

Catalogue catalogue(std::string_view filter) {
  Catalogue all;
  add_marschner_lobb(all.workloads);
  if (const auto lobster = test_volume("lobster.nhdr")) {
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

  const std::string wanted = lower(filter);
  auto passed_over = [&](const auto& entry) { return lower(entry.name).find(wanted) == std::string::npos; };
  std::erase_if(all.workloads, passed_over);
  std::erase_if(all.missing, passed_over);
  std::ranges::stable_sort(all.workloads, {}, [](const Workload& w) { return w.name.substr(0, 2); });
  return all;
}

RayBatch rays_of(const Workload& workload, const Surface& surface, int width) {
  return workload.camera(surface.bounds(), width).rays();
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
