// W10: neighbours of about 10⁶ hits of random chords, each in a random direction, at a distance of one cell (of a mesh:
// its mean edge; of equations and surfaces s(u, v): a 128th of the extent).
//
//   W10-<surface>/<who>      neighbours a second, by HitList::neighbors: normals at the starts and at the ends included
//
// In the same run:
//   reached       those that were reached, in parts of all; past creases, too
//   boundary      where the surface ended
//   chord_error   the greatest | |q - p| - r | / r of those
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "benchmarks.hpp"
#include "smurf/interrogator.hpp"
#include "workloads/workloads.hpp"

namespace smurf::bench {
namespace {

using workloads::Dice;

struct Ground {
  std::string name;
  std::function<Surface()> surface;
  std::function<float(const Surface&)> distance;
  int width;  // width² chords have about 10⁶ hits
};

float extent_part(const Surface& surface) {
  const Bounds bounds = surface.bounds();
  const glm::dvec3 size = bounds.upper - bounds.lower;
  return float(std::max({size.x, size.y, size.z}) / 128);
}

float mean_edge(const Mesh& mesh) {
  double sum = 0;
  for (std::size_t f = 0; f < mesh.face_count(); f++) {
    const auto corner = [&](int c) { return mesh.vertices()[mesh.faces()[f][c]]; };
    for (int c = 0; c < 3; c++) sum += glm::distance(corner(c), corner((c + 1) % 3));
  }
  return float(sum / (3.0 * double(mesh.face_count())));
}

void add_ground(const Ground& ground, const DeviceInfo& info) {
  const std::string device_name = fmt::format("{}:{}", info.executor, info.index);
  add(fmt::format("W10-{}/{}/lanes:{}", ground.name, device_name, info.lanes), [=] {
    const Device device = open_device(device_name);
    const Surface surface = ground.surface();
    const auto query = std::make_shared<Interrogator>(device, surface);
    const float distance = ground.distance(surface);
    const auto hits = std::make_shared<HitList>(
        query->cast(workloads::random_chords(surface.bounds(), ground.width), {.hits = Hits::all}));
    Dice dice(17);
    const auto directions = std::make_shared<std::vector<glm::vec3>>(hits->size());
    for (glm::vec3& d : *directions) d = {float(dice.unit() - 0.5), float(dice.unit() - 0.5), float(dice.unit() - 0.5)};
    Ready result;
    result.run = [=] { hits->neighbors(*directions, distance); };
    result.count = hits->size();
    const Neighbors next = hits->neighbors(*directions, distance);
    std::size_t reached = 0, boundary = 0;
    double error = 0;
    for (std::size_t i = 0; i < next.size(); i++) {
      boundary += next.status[i] == WalkStatus::boundary;
      if (!goes_on(next.status[i])) continue;
      reached++;
      error = std::max(error, std::abs(double(next.chords[i]) / double(distance) - 1));
    }
    result.label = fmt::format("{}, distance {:.3g}", info.name, distance);
    result.counters = {{"reached", double(reached) / double(next.size())},
                       {"boundary", double(boundary) / double(next.size())},
                       {"chord_error", error}};
    return result;
  });
}

}  // namespace

void add_walks() {
  const workloads::Catalogue samples = workloads::catalogue("W4-probe");
  const workloads::Catalogue gyroid = workloads::catalogue("W3a-first");
  const workloads::Catalogue torus = workloads::catalogue("W7-torus-all");
  std::vector<Ground> grounds;
  for (const workloads::Workload& w : samples.workloads) {
    for (const Reconstruction r : {Reconstruction::trilinear, Reconstruction::tricubic}) {
      workloads::Workload other = w;
      other.reconstruction = r;
      grounds.push_back({std::string(name_of(r)), [other] { return other.surface(); },
                         [other](const Surface&) { return float(other.length_unit()); }, 600});
    }
  }
  for (const workloads::Workload& w : gyroid.workloads)
    grounds.push_back({"equation", [w] { return w.surface(); }, extent_part, 700});
  for (const workloads::Workload& w : torus.workloads)
    grounds.push_back({"parametric", [w] { return w.surface(); }, extent_part, 1000});
  const auto bunny = workloads::bunny_or_sphere();
  grounds.push_back({bunny.is_bunny ? "mesh" : "mesh-sphere", [=] { return mesh_surface(bunny.mesh()); },
                     [=](const Surface&) { return mean_edge(bunny.mesh()); }, 900});
  for (const DeviceInfo& info : list_devices()) {
    if (info.executor == "reference") continue;
    for (const Ground& ground : grounds) add_ground(ground, info);
  }
}

}  // namespace smurf::bench
