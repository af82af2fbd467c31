#include "surfaces/mesh/hierarchy.hpp"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <span>

#include "kernels/mesh/layout.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

// Lanes test as many as 16 triangles at the price of one, so that leaves of fewer are split no further: on the bunny
// such leaves have 11 triangles in the mean, where the builder would make half of its leaves of one triangle, and rays
// with all hits are faster by a tenth.
constexpr unsigned fewest_to_split = 16;
constexpr float triangle_cost = 0.05f;  // of a node's
constexpr std::size_t most_parts = 4;   // of a triangle in the mean, where they are split

struct Box {
  glm::vec3 lower, upper;
};

// A node as Embree builds it: inner nodes have children, leaves triangles.
struct BuildNode {
  std::array<BuildNode*, MESH_WIDTH> children{};
  std::array<Box, MESH_WIDTH> boxes{};
  std::array<std::uint32_t, MESH_LEAF_MOST> triangles{};
  std::uint32_t count = 0;  // of children or triangles
  bool leaf = false;
};

void* create_node(RTCThreadLocalAllocator allocator, unsigned, void*) {
  return new (rtcThreadLocalAlloc(allocator, sizeof(BuildNode), 16)) BuildNode;
}

void set_children(void* node, void** children, unsigned count, void*) {
  auto& to = *static_cast<BuildNode*>(node);
  to.count = count;
  for (unsigned i = 0; i < count; i++) to.children[i] = static_cast<BuildNode*>(children[i]);
}

void set_bounds(void* node, const RTCBounds** bounds, unsigned count, void*) {
  auto& to = *static_cast<BuildNode*>(node);
  for (unsigned i = 0; i < count; i++) {
    const RTCBounds& b = *bounds[i];
    to.boxes[i] = {{b.lower_x, b.lower_y, b.lower_z}, {b.upper_x, b.upper_y, b.upper_z}};
  }
}

void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives, std::size_t count, void*) {
  auto* leaf = new (rtcThreadLocalAlloc(allocator, sizeof(BuildNode), 16)) BuildNode;
  leaf->leaf = true;
  leaf->count = std::uint32_t(count);
  for (std::size_t i = 0; i < count; i++) leaf->triangles[i] = primitives[i].primID;
  return leaf;
}

// Embree calls from many threads, and no exception may pass through it.
class Report {
 public:
  using Call = std::function<void(std::size_t done, std::size_t total)>;
  Report(const Call& call, std::size_t total) : call_(call), total_(total) {}

  void rethrow() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }
  // False ends the work.
  bool tell(double part) {
    const std::lock_guard lock(mutex_);
    if (thrown_) return false;
    done_ = std::max(done_, std::size_t(std::clamp(part, 0.0, 1.0) * double(total_)));
    try {
      call_(done_, total_);
    } catch (...) {
      thrown_ = std::current_exception();
    }
    return !thrown_;
  }

 private:
  const Call& call_;
  const std::size_t total_;
  std::mutex mutex_;
  std::size_t done_ = 0;
  std::exception_ptr thrown_;
};

// What Embree's calls get to know.
struct Build {
  const Mesh& mesh;
  const float unit;
  Report report;
};

// The parts of a primitive, a triangle or what earlier splits left of it, on both sides of a plane. Boxes hold all of
// the triangle that lies in them: where its edges cross the plane is told in double, and rounded outwards by more than
// that errs.
void split(const RTCBuildPrimitive* primitive, unsigned axis, float at, RTCBounds* left, RTCBounds* right, void* user) {
  const Build& build = *static_cast<const Build*>(user);
  const glm::uvec3 face = build.mesh.faces()[primitive->primID];
  std::array<glm::dvec3, 3> corners;
  for (int k = 0; k < 3; k++) corners[std::size_t(k)] = glm::dvec3(build.unit * build.mesh.vertices()[face[k]]);
  const glm::vec3 lower(primitive->lower_x, primitive->lower_y, primitive->lower_z),
      upper(primitive->upper_x, primitive->upper_y, primitive->upper_z);
  glm::dvec3 least[2], most[2];
  for (const int side : {0, 1}) {
    least[side] = glm::dvec3(std::numeric_limits<double>::max());
    most[side] = -least[side];
  }
  const auto add = [&](int side, const glm::dvec3& p) {
    least[side] = glm::min(least[side], p);
    most[side] = glm::max(most[side], p);
  };
  const int a = int(axis);
  for (std::size_t k = 0; k < 3; k++) {
    const glm::dvec3 &from = corners[k], &to = corners[(k + 1) % 3];
    if (from[a] <= double(at)) add(0, from);
    if (from[a] >= double(at)) add(1, from);
    if ((from[a] < double(at) && to[a] > double(at)) || (from[a] > double(at) && to[a] < double(at))) {
      glm::dvec3 p = from + (to - from) * ((double(at) - from[a]) / (to[a] - from[a]));
      p[a] = double(at);
      add(0, p);
      add(1, p);
    }
  }
  for (const int side : {0, 1}) {
    glm::vec3 low = lower, high = upper;
    // Boxes are a little wider than triangles: a plane that passes beside the triangle leaves nothing on one side,
    // where the box is kept.
    const bool some = least[side].x <= most[side].x;
    for (int k = 0; some && k < 3; k++) {
      // From float's neighbours on either side: double errs by far less.
      low[k] = std::max(lower[k], std::nextafter(float(least[side][k]), -std::numeric_limits<float>::max()));
      high[k] = std::min(upper[k], std::nextafter(float(most[side][k]), std::numeric_limits<float>::max()));
    }
    (side == 0 ? high : low)[a] = at;
    RTCBounds& to = side == 0 ? *left : *right;
    to.lower_x = low.x, to.lower_y = low.y, to.lower_z = low.z;
    to.upper_x = high.x, to.upper_y = high.y, to.upper_z = high.z;
  }
}

struct DeviceRelease {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct HierarchyRelease {
  void operator()(RTCBVH bvh) const { rtcReleaseBVH(bvh); }
};

// Writes nodes in the order in which they are first met, breadth first.
class Layout {
 public:
  Layout(const Mesh& mesh, float unit, float margin) : mesh_(mesh), unit_(unit), margin_(margin) {}

  MeshHierarchy lay_out(const BuildNode& root, const Box& bounds) {
    result_.lower = bounds.lower - margin_;
    result_.upper = bounds.upper + margin_;
    BuildNode above;  // a mesh of one leaf has a node above it
    if (root.leaf) {
      above.children[0] = const_cast<BuildNode*>(&root);
      above.boxes[0] = bounds;
      above.count = 1;
    }
    std::vector<const BuildNode*> level{root.leaf ? &above : &root};
    std::size_t begun = 1;
    while (!level.empty()) {
      std::vector<const BuildNode*> next;
      for (const BuildNode* node : level) {
        const std::size_t at = result_.nodes.size();
        result_.nodes.resize(at + MESH_NODE_WORDS);
        for (std::uint32_t i = 0; i < MESH_WIDTH; i++) {
          const BuildNode* child = i < node->count ? node->children[i] : nullptr;
          std::uint32_t word = 0;
          if (child && child->leaf) word = std::uint32_t(-1 - std::int32_t(add_leaf(*child)));
          if (child && !child->leaf) {
            word = std::uint32_t(begun++);
            next.push_back(child);
          }
          if (child) put_child(at, i, node->boxes[i], word);
        }
      }
      level = std::move(next);
    }
    result_.stack = deepest(root.leaf ? above : root);
    // Lanes read whole vectors; those beyond the last triangle of a leaf take whatever stands there for a corner.
    result_.nodes.resize(result_.nodes.size() + 16);
    result_.triangles.resize(result_.triangles.size() + (1 << MESH_CORNER_BITS));
    return std::move(result_);
  }

 private:
  // What is kept at most while a child is followed and the others wait.
  static int deepest(const BuildNode& node) {
    int most = 1;
    if (node.leaf) return most;
    for (std::uint32_t i = 0; i < node.count; i++) most = std::max(most, deepest(*node.children[i]));
    return most + int(node.count) - 1;
  }

  void put_child(std::size_t at, std::uint32_t i, const Box& box, std::uint32_t word) {
    for (std::uint32_t axis = 0; axis < 3; axis++) {
      result_.nodes[at + axis * MESH_WIDTH + i] = std::bit_cast<std::uint32_t>(box.lower[int(axis)] - margin_);
      result_.nodes[at + (3 + axis) * MESH_WIDTH + i] = std::bit_cast<std::uint32_t>(box.upper[int(axis)] + margin_);
    }
    result_.nodes[at + MESH_CHILDREN + i] = word;
  }

  // The number of the new leaf.
  std::uint32_t add_leaf(const BuildNode& leaf) {
    std::vector<std::uint32_t>& words = result_.triangles;
    words.resize((words.size() + MESH_LEAF_WORDS - 1) / MESH_LEAF_WORDS * MESH_LEAF_WORDS);
    const std::size_t at = words.size();
    // By number, so that what is found does not depend on how the hierarchy was built.
    std::vector<std::uint32_t> faces(leaf.triangles.data(), leaf.triangles.data() + leaf.count);
    std::ranges::sort(faces);
    // Corners at the same place are one vertex.
    std::vector<std::array<std::uint32_t, 3>> vertices;
    std::vector<std::uint32_t> corners(faces.size());
    for (std::size_t i = 0; i < faces.size(); i++) {
      for (int corner = 0; corner < 3; corner++) {
        const glm::vec3 place = unit_ * mesh_.vertices()[mesh_.faces()[faces[i]][corner]];
        const auto vertex = std::bit_cast<std::array<std::uint32_t, 3>>(place);
        const auto number = std::size_t(std::ranges::find(vertices, vertex) - vertices.begin());
        if (number == vertices.size()) vertices.push_back(vertex);
        corners[i] |= std::uint32_t(number) << (MESH_CORNER_BITS * corner);
      }
    }
    words.push_back(std::uint32_t(vertices.size() + MESH_LEAF_COUNT * faces.size()));
    words.insert(words.end(), corners.begin(), corners.end());
    for (const std::size_t axis : {0u, 1u, 2u}) {
      for (const auto& vertex : vertices) words.push_back(vertex[axis]);
    }
    words.insert(words.end(), faces.begin(), faces.end());
    return std::uint32_t(at / MESH_LEAF_WORDS);
  }

  const Mesh& mesh_;
  const float unit_;
  const float margin_;
  MeshHierarchy result_;
};

float largest(const glm::vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

}  // namespace

MeshHierarchy build_hierarchy(const Mesh& mesh, float unit, bool spatial_splits, const Report::Call& progress) {
  // A leaf takes no more than MESH_LEAF_WORDS for each of its triangles.
  constexpr std::size_t most = (std::size_t(1) << 31) / MESH_LEAF_WORDS - 1;
  if (mesh.face_count() > most / (spatial_splits ? most_parts : 1))
    throw Error(ErrorCode::memory,
                fmt::format("the mesh has {} triangles; kernels can number {}", mesh.face_count(), most));
  const std::unique_ptr<RTCDeviceTy, DeviceRelease> device(rtcNewDevice(nullptr));
  if (!device) throw Error(ErrorCode::device, "Embree, which builds hierarchies, could not be started");
  const std::unique_ptr<RTCBVHTy, HierarchyRelease> bvh(rtcNewBVH(device.get()));

  // Room for what splits add: the builder splits no more than it has room for.
  std::vector<RTCBuildPrimitive> primitives;
  primitives.reserve(mesh.face_count() * (spatial_splits ? most_parts : 1));
  primitives.resize(mesh.face_count());
  Box bounds{glm::vec3(std::numeric_limits<float>::max()), glm::vec3(std::numeric_limits<float>::lowest())};
  for (std::size_t i = 0; i < primitives.size(); i++) {
    const glm::uvec3 f = mesh.faces()[i];
    const glm::vec3 a = mesh.vertices()[f.x], b = mesh.vertices()[f.y], c = mesh.vertices()[f.z];
    const glm::vec3 lower = unit * glm::min(glm::min(a, b), c), upper = unit * glm::max(glm::max(a, b), c);
    primitives[i] = {lower.x, lower.y, lower.z, 0, upper.x, upper.y, upper.z, unsigned(i)};
    bounds = {glm::min(bounds.lower, lower), glm::max(bounds.upper, upper)};
  }

  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM;
  arguments.maxBranchingFactor = MESH_WIDTH;
  arguments.maxDepth = 48;
  arguments.sahBlockSize = 1;
  arguments.minLeafSize = fewest_to_split;
  arguments.maxLeafSize = MESH_LEAF_MOST;
  arguments.traversalCost = 1.0f;
  arguments.intersectionCost = triangle_cost;
  arguments.bvh = bvh.get();
  arguments.primitives = primitives.data();
  arguments.primitiveCount = primitives.size();
  arguments.primitiveArrayCapacity = primitives.capacity();
  arguments.createNode = create_node;
  arguments.setNodeChildren = set_children;
  arguments.setNodeBounds = set_bounds;
  arguments.createLeaf = create_leaf;
  if (spatial_splits) {
    arguments.buildQuality = RTC_BUILD_QUALITY_HIGH;
    arguments.splitPrimitive = split;
  }
  Build build{mesh, unit, {progress, mesh.face_count()}};
  if (progress)
    arguments.buildProgress = [](void* user, double part) { return static_cast<Build*>(user)->report.tell(part); };
  arguments.userPtr = &build;
  const auto* root = static_cast<const BuildNode*>(rtcBuildBVH(&arguments));
  build.report.rethrow();
  if (!root)
    throw Error(ErrorCode::memory, fmt::format("Embree could not build a hierarchy over {} triangles (its error {})",
                                               mesh.face_count(), int(rtcGetDeviceError(device.get()))));
  const float margin = std::ldexp(std::max(largest(bounds.lower), largest(bounds.upper)), -22);
  return Layout(mesh, unit, margin).lay_out(*root, bounds);
}

}  // namespace smurf
