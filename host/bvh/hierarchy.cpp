#include "bvh/hierarchy.hpp"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <utility>

#include "kernels/bvh/layout.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

// A node as Embree builds it.
struct BuildNode {
  std::uint32_t count = 0;  // of children or primitives
  bool leaf = false;
};

struct InnerNode : BuildNode {
  std::array<BuildNode*, BVH_WIDTH> children{};
  std::array<BvhBox, BVH_WIDTH> boxes{};
};

// The numbers of its primitives follow in memory.
struct LeafNode : BuildNode {
  std::uint32_t* primitives() { return reinterpret_cast<std::uint32_t*>(this + 1); }
};
static_assert(sizeof(LeafNode) % alignof(std::uint32_t) == 0);

BvhBox box_of(const RTCBounds& b) { return {{b.lower_x, b.lower_y, b.lower_z}, {b.upper_x, b.upper_y, b.upper_z}}; }

void set_box(const BvhBox& box, RTCBounds& to) {
  to.lower_x = box.lower.x, to.lower_y = box.lower.y, to.lower_z = box.lower.z;
  to.upper_x = box.upper.x, to.upper_y = box.upper.y, to.upper_z = box.upper.z;
}

void* create_node(RTCThreadLocalAllocator allocator, unsigned, void*) {
  return static_cast<BuildNode*>(new (rtcThreadLocalAlloc(allocator, sizeof(InnerNode), 16)) InnerNode);
}

void set_children(void* node, void** children, unsigned count, void*) {
  auto& to = *static_cast<InnerNode*>(static_cast<BuildNode*>(node));
  to.count = count;
  for (unsigned i = 0; i < count; i++) to.children[i] = static_cast<BuildNode*>(children[i]);
}

void set_bounds(void* node, const RTCBounds** bounds, unsigned count, void*) {
  auto& to = *static_cast<InnerNode*>(static_cast<BuildNode*>(node));
  for (unsigned i = 0; i < count; i++) to.boxes[i] = box_of(*bounds[i]);
}

void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives, std::size_t count, void*) {
  const std::size_t bytes = sizeof(LeafNode) + count * sizeof(std::uint32_t);
  auto* leaf = new (rtcThreadLocalAlloc(allocator, bytes, 16)) LeafNode;
  leaf->leaf = true;
  leaf->count = std::uint32_t(count);
  for (std::size_t i = 0; i < count; i++) leaf->primitives()[i] = primitives[i].primID;
  return static_cast<BuildNode*>(leaf);
}

// Embree calls from many threads, and no exception may pass through it.
class Progress {
 public:
  Progress(const BvhOptions& options, std::size_t total) : call_(options.progress), total_(total) {}

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
  const std::function<void(std::size_t done, std::size_t total)>& call_;
  const std::size_t total_;
  std::mutex mutex_;
  std::size_t done_ = 0;
  std::exception_ptr thrown_;
};

// What Embree's calls get to know.
struct Build {
  const BvhOptions& options;
  Progress progress;
};

void split(const RTCBuildPrimitive* primitive, unsigned axis, float at, RTCBounds* left, RTCBounds* right, void* user) {
  const BvhBox box{{primitive->lower_x, primitive->lower_y, primitive->lower_z},
                   {primitive->upper_x, primitive->upper_y, primitive->upper_z}};
  const auto parts = static_cast<const Build*>(user)->options.split(primitive->primID, box, int(axis), at);
  set_box(parts[0], *left);
  set_box(parts[1], *right);
}

bool tell(void* user, double part) { return static_cast<Build*>(user)->progress.tell(part); }

struct DeviceRelease {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct HierarchyRelease {
  void operator()(RTCBVH bvh) const { rtcReleaseBVH(bvh); }
};

// Writes nodes in the order in which they are first met, breadth first.
class Layout {
 public:
  Layout(float margin, const BvhLeafWriter& write_leaf) : margin_(margin), write_leaf_(write_leaf) {}

  Bvh lay_out(BuildNode& root, const BvhBox& bounds) {
    result_.bounds = {bounds.lower - margin_, bounds.upper + margin_};
    InnerNode above;  // of a tree that is one leaf
    above.children[0] = &root;
    above.boxes[0] = bounds;
    above.count = 1;
    InnerNode& top = root.leaf ? above : static_cast<InnerNode&>(root);
    std::vector<const InnerNode*> level{&top};
    std::size_t begun = 1;
    while (!level.empty()) {
      std::vector<const InnerNode*> next;
      for (const InnerNode* node : level) {
        const std::size_t at = result_.nodes.size();
        result_.nodes.resize(at + BVH_NODE_WORDS);
        for (std::uint32_t i = 0; i < node->count; i++) {
          BuildNode* child = node->children[i];
          if (child->leaf) {
            put_child(at, i, node->boxes[i], std::uint32_t(-1 - std::int32_t(write(static_cast<LeafNode&>(*child)))));
          } else {
            put_child(at, i, node->boxes[i], std::uint32_t(begun++));
            next.push_back(static_cast<const InnerNode*>(child));
          }
        }
      }
      if (begun > most_nodes)
        throw Error(ErrorCode::memory,
                    fmt::format("a hierarchy has {} nodes; kernels can number {}", begun, most_nodes));
      level = std::move(next);
    }
    result_.stack = deepest(top);
    result_.nodes.resize(result_.nodes.size() + BVH_PADDING);
    return std::move(result_);
  }

 private:
  static constexpr std::size_t most_nodes = (std::size_t(1) << 31) / BVH_NODE_WORDS - 1;

  // What is kept at most while a child is followed and the others wait.
  static int deepest(const BuildNode& node) {
    int most = 1;
    if (node.leaf) return most;
    const auto& inner = static_cast<const InnerNode&>(node);
    for (std::uint32_t i = 0; i < inner.count; i++) most = std::max(most, deepest(*inner.children[i]));
    return most + int(inner.count) - 1;
  }

  void put_child(std::size_t at, std::uint32_t i, const BvhBox& box, std::uint32_t word) {
    for (std::uint32_t axis = 0; axis < 3; axis++) {
      result_.nodes[at + axis * BVH_WIDTH + i] = std::bit_cast<std::uint32_t>(box.lower[int(axis)] - margin_);
      result_.nodes[at + (3 + axis) * BVH_WIDTH + i] = std::bit_cast<std::uint32_t>(box.upper[int(axis)] + margin_);
    }
    result_.nodes[at + BVH_CHILDREN + i] = word;
  }

  // In ascending order, so that what is found does not depend on how the hierarchy was built.
  std::uint32_t write(LeafNode& leaf) {
    const std::span<std::uint32_t> primitives(leaf.primitives(), leaf.count);
    std::ranges::sort(primitives);
    return write_leaf_(primitives);
  }

  const float margin_;
  const BvhLeafWriter& write_leaf_;
  Bvh result_;
};

// With room for what splits add: the builder splits no more than it has room for.
std::vector<RTCBuildPrimitive> primitives_of(const std::vector<BvhBox>& boxes, std::size_t most_parts) {
  std::vector<RTCBuildPrimitive> primitives;
  primitives.reserve(boxes.size() * most_parts);
  for (const BvhBox& box : boxes) {
    const auto number = unsigned(primitives.size());
    primitives.push_back({box.lower.x, box.lower.y, box.lower.z, 0, box.upper.x, box.upper.y, box.upper.z, number});
  }
  return primitives;
}

BvhBox bounds_of(const std::vector<BvhBox>& boxes) {
  BvhBox bounds{glm::vec3(std::numeric_limits<float>::max()), glm::vec3(std::numeric_limits<float>::lowest())};
  for (const BvhBox& box : boxes) bounds = {glm::min(bounds.lower, box.lower), glm::max(bounds.upper, box.upper)};
  return bounds;
}

}  // namespace

Bvh build_bvh(std::vector<BvhBox> boxes, const BvhOptions& options, const BvhLeafWriter& write_leaf) {
  const std::size_t count = boxes.size();
  if (count == 0) throw Error(ErrorCode::input, "a hierarchy needs one box at least");
  const std::unique_ptr<RTCDeviceTy, DeviceRelease> device(rtcNewDevice(nullptr));
  if (!device) throw Error(ErrorCode::device, "Embree, which builds hierarchies, could not be started");
  const std::unique_ptr<RTCBVHTy, HierarchyRelease> bvh(rtcNewBVH(device.get()));
  const BvhBox bounds = bounds_of(boxes);
  std::vector<RTCBuildPrimitive> primitives = primitives_of(boxes, options.split ? options.most_parts : 1);
  boxes = {};

  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM;
  arguments.maxBranchingFactor = BVH_WIDTH;
  arguments.maxDepth = 48;
  arguments.sahBlockSize = 1;
  arguments.minLeafSize = unsigned(options.fewest_to_split);
  arguments.maxLeafSize = unsigned(std::min(options.most_in_leaf, bvh_most_in_leaf));
  arguments.traversalCost = 1.0f;
  arguments.intersectionCost = options.box_cost;
  arguments.bvh = bvh.get();
  arguments.primitives = primitives.data();
  arguments.primitiveCount = primitives.size();
  arguments.primitiveArrayCapacity = primitives.capacity();
  arguments.createNode = create_node;
  arguments.setNodeChildren = set_children;
  arguments.setNodeBounds = set_bounds;
  arguments.createLeaf = create_leaf;
  if (options.split) {
    arguments.buildQuality = RTC_BUILD_QUALITY_HIGH;
    arguments.splitPrimitive = split;
  }
  Build build{options, {options, count}};
  if (options.progress) arguments.buildProgress = tell;
  arguments.userPtr = &build;
  auto* root = static_cast<BuildNode*>(rtcBuildBVH(&arguments));
  build.progress.rethrow();
  if (!root)
    throw Error(ErrorCode::memory, fmt::format("Embree could not build a hierarchy over {} boxes (its error {})", count,
                                               int(rtcGetDeviceError(device.get()))));
  return Layout(options.margin, write_leaf).lay_out(*root, bounds);
}

}  // namespace smurf
