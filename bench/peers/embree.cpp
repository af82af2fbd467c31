#include "peers/embree.hpp"

#include <embree3/rtcore.h>
#include <xmmintrin.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "parallel.hpp"
#include "smurf/error.hpp"

namespace smurf::bench {

struct EmbreeScene::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  RTCGeometry geometry = nullptr;
};

namespace {

struct Hit {
  float t;
  glm::vec3 normal;
};

struct CollectingContext {
  RTCIntersectContext base;  // first: Embree hands back its address
  std::vector<Hit>* hits;
};

void collect(const RTCFilterFunctionNArguments* a) {
  auto& hits = *reinterpret_cast<CollectingContext*>(a->context)->hits;
  for (unsigned k = 0; k < a->N; k++) {
    if (a->valid[k] != -1) continue;
    hits.push_back({RTCRayN_tfar(a->ray, a->N, k),
                    {RTCHitN_Ng_x(a->hit, a->N, k), RTCHitN_Ng_y(a->hit, a->N, k), RTCHitN_Ng_z(a->hit, a->N, k)}});
    a->valid[k] = 0;
  }
}

// Component arrays of a batch.
struct Components {
  explicit Components(const RayBatch& rays) {
    for (int c = 0; c < RayBatch::component_count; c++) values[c] = rays.data() + std::size_t(c) * rays.size();
  }
  const float* values[RayBatch::component_count];
};

RTCRayHit single_ray(const Components& c, std::size_t i) {
  RTCRayHit r;
  r.ray.org_x = c.values[RayBatch::origin_x][i];
  r.ray.org_y = c.values[RayBatch::origin_y][i];
  r.ray.org_z = c.values[RayBatch::origin_z][i];
  r.ray.dir_x = c.values[RayBatch::direction_x][i];
  r.ray.dir_y = c.values[RayBatch::direction_y][i];
  r.ray.dir_z = c.values[RayBatch::direction_z][i];
  r.ray.tnear = c.values[RayBatch::t_min][i];
  r.ray.tfar = c.values[RayBatch::t_max][i];
  r.ray.time = 0;
  r.ray.mask = ~0u;
  r.ray.id = 0;
  r.ray.flags = 0;
  r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  r.hit.primID = RTC_INVALID_GEOMETRY_ID;
  r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return r;
}

constexpr std::size_t chunk_size = 4096;

// As Embree's manual advises for every thread that traces.
void flush_denormals() { _mm_setcsr(_mm_getcsr() | 0x8040); }

}  // namespace

void EmbreeScene::begin(bool robust, bool grids) {
  state_->device = rtcNewDevice(nullptr);
  if (!state_->device) throw Error(ErrorCode::device, "Embree could not open its device");
  state_->scene = rtcNewScene(state_->device);
  if (robust) rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_ROBUST);
  state_->geometry = rtcNewGeometry(state_->device, grids ? RTC_GEOMETRY_TYPE_GRID : RTC_GEOMETRY_TYPE_TRIANGLE);
}

void EmbreeScene::fill(const std::vector<glm::vec3>& vertices, const void* faces, std::size_t count, std::size_t bytes,
                       bool grids) {
  void* places = rtcSetNewGeometryBuffer(state_->geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                         sizeof(glm::vec3), vertices.size());
  void* indices = rtcSetNewGeometryBuffer(state_->geometry, grids ? RTC_BUFFER_TYPE_GRID : RTC_BUFFER_TYPE_INDEX, 0,
                                          grids ? RTC_FORMAT_GRID : RTC_FORMAT_UINT3, bytes, count);
  if (!places || !indices)
    throw Error(ErrorCode::memory, "Embree could not hold " + std::to_string(vertices.size()) + " vertices");
  std::memcpy(places, vertices.data(), vertices.size() * sizeof(glm::vec3));
  std::memcpy(indices, faces, count * bytes);
  rtcCommitGeometry(state_->geometry);
  rtcAttachGeometry(state_->scene, state_->geometry);
  rtcReleaseGeometry(state_->geometry);
  rtcSetSceneFlags(state_->scene,
                   RTCSceneFlags(rtcGetSceneFlags(state_->scene) | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
  rtcCommitScene(state_->scene);
}

EmbreeScene::EmbreeScene(const TriangleMesh& mesh, bool robust) : state_(std::make_unique<State>()) {
  begin(robust, false);
  fill(mesh.vertices, mesh.triangles.data(), mesh.triangles.size(), sizeof(glm::uvec3), false);
}

EmbreeScene::EmbreeScene(const GridMesh& mesh) : state_(std::make_unique<State>()) {
  begin(false, true);
  std::vector<RTCGrid> grids;
  const auto width = static_cast<unsigned short>(mesh.width);
  for (std::size_t i = 0; i < mesh.grids; i++)
    grids.push_back({unsigned(i * mesh.width * mesh.width), mesh.width, width, width});
  fill(mesh.vertices, grids.data(), grids.size(), sizeof(RTCGrid), true);
}

EmbreeScene::~EmbreeScene() {
  rtcReleaseScene(state_->scene);
  rtcReleaseDevice(state_->device);
}

void EmbreeScene::closest_single(const RayBatch& rays, ClosestHits& hits) const {
  const Components c(rays);
  hits.t.resize(rays.size());
  hits.normals.resize(rays.size());
  parallel_chunks(rays.size(), chunk_size, [&](unsigned, std::size_t begin, std::size_t end) {
    flush_denormals();
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (std::size_t i = begin; i < end; i++) {
      RTCRayHit r = single_ray(c, i);
      rtcIntersect1(state_->scene, &context, &r);
      hits.t[i] = r.hit.geomID == RTC_INVALID_GEOMETRY_ID ? INFINITY : r.ray.tfar;
      hits.normals[i] = {r.hit.Ng_x, r.hit.Ng_y, r.hit.Ng_z};
    }
  });
}

void EmbreeScene::closest_packets(const RayBatch& rays, ClosestHits& hits) const {
  const Components c(rays);
  const std::size_t count = rays.size(), width = rays.image_width;
  const bool tiled = width > 0 && width % 4 == 0 && count % (4 * width) == 0;
  hits.t.resize(count);
  hits.normals.resize(count);
  parallel_chunks((count + 15) / 16, chunk_size / 16, [&](unsigned, std::size_t begin, std::size_t end) {
    flush_denormals();
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (std::size_t packet = begin; packet < end; packet++) {
      alignas(64) int valid[16];
      alignas(64) RTCRayHit16 r;
      std::size_t id[16];
      for (std::size_t k = 0; k < 16; k++) {
        std::size_t i = 16 * packet + k;
        if (tiled) i = (packet / (width / 4) * 4 + k / 4) * width + packet % (width / 4) * 4 + k % 4;
        valid[k] = i < count ? -1 : 0;
        id[k] = i = std::min(i, count - 1);
        r.ray.org_x[k] = c.values[RayBatch::origin_x][i];
        r.ray.org_y[k] = c.values[RayBatch::origin_y][i];
        r.ray.org_z[k] = c.values[RayBatch::origin_z][i];
        r.ray.dir_x[k] = c.values[RayBatch::direction_x][i];
        r.ray.dir_y[k] = c.values[RayBatch::direction_y][i];
        r.ray.dir_z[k] = c.values[RayBatch::direction_z][i];
        r.ray.tnear[k] = c.values[RayBatch::t_min][i];
        r.ray.tfar[k] = c.values[RayBatch::t_max][i];
        r.ray.time[k] = 0;
        r.ray.mask[k] = ~0u;
        r.ray.id[k] = 0;
        r.ray.flags[k] = 0;
        r.hit.geomID[k] = r.hit.primID[k] = r.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
      }
      rtcIntersect16(valid, state_->scene, &context, &r);
      for (std::size_t k = 0; k < 16; k++) {
        if (!valid[k]) continue;
        hits.t[id[k]] = r.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID ? INFINITY : r.ray.tfar[k];
        hits.normals[id[k]] = {r.hit.Ng_x[k], r.hit.Ng_y[k], r.hit.Ng_z[k]};
      }
    }
  });
}

void EmbreeScene::all(const RayBatch& rays, AllHits& hits) const {
  const Components c(rays);
  const std::size_t chunks = (rays.size() + chunk_size - 1) / chunk_size;
  std::vector<std::vector<Hit>> found(chunks);
  hits.offsets.assign(rays.size() + 1, 0);
  parallel_chunks(rays.size(), chunk_size, [&](unsigned, std::size_t begin, std::size_t end) {
    flush_denormals();
    auto& mine = found[begin / chunk_size];
    mine.reserve(2 * chunk_size);
    CollectingContext context;
    rtcInitIntersectContext(&context.base);
    context.base.filter = collect;
    context.hits = &mine;
    for (std::size_t i = begin; i < end; i++) {
      const std::size_t first = mine.size();
      RTCRayHit r = single_ray(c, i);
      rtcIntersect1(state_->scene, &context.base, &r);
      std::sort(mine.begin() + std::ptrdiff_t(first), mine.end(), [](const Hit& a, const Hit& b) { return a.t < b.t; });
      hits.offsets[i + 1] = mine.size() - first;
    }
  });
  std::inclusive_scan(hits.offsets.begin(), hits.offsets.end(), hits.offsets.begin());
  hits.t.resize(hits.offsets.back());
  hits.normals.resize(hits.offsets.back());
  parallel_chunks(chunks, 1, [&](unsigned, std::size_t chunk, std::size_t) {
    std::size_t at = hits.offsets[chunk * chunk_size];
    for (const Hit& hit : found[chunk]) {
      hits.t[at] = hit.t;
      hits.normals[at++] = hit.normal;
    }
  });
}

}  // namespace smurf::bench
