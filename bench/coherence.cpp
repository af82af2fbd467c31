// What coherence and caching gain, on a mesh, a grid and a surface s(u, v).
//
//   coherence-<workload>/<order>/<who>   first hits of the same 1024² camera rays: `image` (as pixels, tile by tile),
//                                       `rows` (row by row, the device does not know of the image), `shuffled`
//   caching-<workload>/<which>/<who>     principal curvatures of these hits: `first` asks the device, `kept` asks the
//                                       hit list again
//
// Results do not depend on the order; each run of `shuffled` is checked against the others by its number of hits.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <random>
#include <stdexcept>
#include <vector>

#include "benchmarks.hpp"
#include "smurf/interrogator.hpp"
#include "workloads/workloads.hpp"

namespace smurf::bench {
namespace {

constexpr int width = 1024;

RayBatch shuffled(const RayBatch& rays) {
  std::vector<std::size_t> order(rays.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::mt19937 random(5);
  std::shuffle(order.begin(), order.end(), random);
  RayBatch result(rays.size());
  for (std::size_t i = 0; i < order.size(); i++) result.set(i, rays[order[i]]);
  return result;
}

void add_orders(const std::string& name, const workloads::Workload& workload, const std::string& device_name,
                int lanes) {
  for (const std::string order : {"image", "rows", "shuffled"}) {
    add(fmt::format("coherence-{}/{}/{}/lanes:{}", name, order, device_name, lanes), [=] {
      const Surface surface = workload.surface();
      const auto query = std::make_shared<Interrogator>(open_device(device_name), surface);
      const RayBatch image = workload.rays(surface.bounds(), width);
      auto rays = std::make_shared<RayBatch>(image);
      if (order == "shuffled") *rays = shuffled(image);
      if (order == "rows") rays->image_width = 0;
      const std::size_t hits = query->cast(*rays, {.hits = Hits::first}).size();
      if (hits != query->cast(image, {.hits = Hits::first}).size())
        throw std::runtime_error("the order of rays changes the number of hits");
      Ready result;
      result.run = [=] { query->cast(*rays, {.hits = Hits::first}); };
      result.count = rays->size();
      result.counters = {{"hits", double(hits)}};
      return result;
    });
  }
}

void add_keeping(const std::string& name, const workloads::Workload& workload, const std::string& device_name,
                 int lanes) {
  for (const bool kept : {false, true}) {
    add(fmt::format("caching-{}/{}/{}/lanes:{}", name, kept ? "kept" : "first", device_name, lanes), [=] {
      const Surface surface = workload.surface();
      const auto query = std::make_shared<Interrogator>(open_device(device_name), surface);
      const auto hits =
          std::make_shared<HitList>(query->cast(workload.rays(surface.bounds(), width), {.hits = Hits::first}));
      hits->principal_curvatures();
      Ready result;
      // A copy of a list has what it had when it was copied.
      const HitList bare = query->cast(workload.rays(surface.bounds(), width), {.hits = Hits::first});
      result.run = [=] {
        if (kept) {
          hits->principal_curvatures();
        } else {
          HitList(bare).principal_curvatures();
        }
      };
      result.count = hits->size();
      return result;
    });
  }
}

}  // namespace

void add_coherence() {
  for (const DeviceInfo& info : list_devices()) {
    if (info.executor == "reference") continue;
    const std::string device_name = fmt::format("{}:{}", info.executor, info.index);
    for (const workloads::Workload& workload : workloads::catalogue().workloads) {
      if (workload.name != "W1-first" && !workload.name.ends_with("camera-first")) continue;
      add_orders(workload.name, workload, device_name, info.lanes);
      add_keeping(workload.name, workload, device_name, info.lanes);
    }
  }
}

}  // namespace smurf::bench
