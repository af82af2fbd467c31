// Vectors on a regular grid on a device: the nodes in fours, for tricubic fields as B-spline coefficients with a node
// more on each side.
//
// Device memory for n nodes: 16·n bytes; tricubic of nx × ny × nz nodes 16·(nx+2)(ny+2)(nz+2), and 16·n more while they
// are set up.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>

#include "flows/grid/definition.hpp"
#include "flows/grid/vectors.hpp"
#include "flows/kinds.hpp"
#include "flows/resident_flow.hpp"
#include "kernels/flow/grid_layout.inc"
#include "kernels/flow/layout.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

// By how many roundings of its coordinates and of the numbers of nodes a point of the border may seem to be outside:
// one of the point itself, and one each of the matrix, the product and the sum.
constexpr double border_roundings = 4;

std::size_t count_of(const glm::ivec3& size) { return std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z); }

// Of each node 1 where its vector cannot be used: of tricubic fields, where the cell that begins at the node has such a
// vector among the 4³ that it is made of. (Further away the field is that of zero vectors at those nodes, which fades
// by 2 - √3 from node to node.)
std::vector<float> marks_of(const GridFlow& flow) {
  const glm::ivec3 size = flow.grid.size;
  std::vector<float> marks(count_of(size), 0.0f);
  const bool cubic = flow.reconstruction == VectorReconstruction::tricubic;
  const auto at = [&](const glm::ivec3& p) {
    return std::size_t(p.x) + std::size_t(size.x) * (std::size_t(p.y) + std::size_t(size.y) * std::size_t(p.z));
  };
  glm::ivec3 node(0);
  for (node.z = 0; node.z < size.z; node.z++) {
    for (node.y = 0; node.y < size.y; node.y++) {
      for (node.x = 0; node.x < size.x; node.x++) {
        if (is_usable(flow.grid.vectors[at(node)])) continue;
        const glm::ivec3 first = cubic ? glm::max(node - 2, 0) : node;
        const glm::ivec3 last = cubic ? glm::min(node + 1, size - 1) : node;
        glm::ivec3 cell;
        for (cell.z = first.z; cell.z <= last.z; cell.z++)
          for (cell.y = first.y; cell.y <= last.y; cell.y++)
            for (cell.x = first.x; cell.x <= last.x; cell.x++) marks[at(cell)] = 1.0f;
      }
    }
  }
  return marks;
}

class ResidentGridFlow final : public ResidentFlow {
 public:
  ResidentGridFlow(const GridFlow& flow, Executor& executor) : executor_(executor), size_(flow.grid.size) {
    const bool cubic = flow.reconstruction == VectorReconstruction::tricubic;
    const bool holes = std::ranges::any_of(flow.grid.vectors, [](const glm::vec3& v) { return !is_usable(v); });
    const glm::dmat3& axes = flow.grid.placement.axes;
    const bool aligned =
        axes == glm::dmat3(glm::dvec3(axes[0].x, 0, 0), glm::dvec3(0, axes[1].y, 0), glm::dvec3(0, 0, axes[2].z));
    modules_["flow"] = kernel_source("flow/grid.inc");
    defines_["FLOW_CUBIC"] = cubic ? "1" : "0";
    defines_["FLOW_ALIGNED"] = aligned ? "1" : "0";
    defines_["FLOW_HOLES"] = holes ? "1" : "0";
    upload_uniforms(flow);
    upload_vectors(flow, holes ? marks_of(flow) : std::vector<float>());
    if (cubic) make_coefficients();
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override { return {{"uniforms", uniforms_.get()}, {"samples", samples_.get()}}; }
  std::size_t bytes() const override { return uniforms_.bytes() + samples_->bytes(); }

 private:
  void upload_uniforms(const GridFlow& flow) {
    std::array<std::uint32_t, FLOW_GRID_WORDS> words{};
    const auto put = [&](int at, double value) { words[std::size_t(at)] = std::bit_cast<std::uint32_t>(float(value)); };
    const GridPlacement& placement = flow.grid.placement;
    const Bounds bounds = flow.bounds();
    const glm::dvec3 centre(glm::vec3(0.5 * (bounds.lower + bounds.upper)));
    const glm::dmat3 world_to_index = glm::inverse(placement.axes);
    const glm::dvec3 shift = world_to_index * (centre - placement.origin);
    const glm::dvec3 farthest = glm::max(glm::abs(bounds.lower), glm::abs(bounds.upper));
    for (int i = 0; i < 3; i++) {
      words[std::size_t(FLOW_GRID_SIZE + i)] = std::uint32_t(size_[i]);
      put(FLOW_GRID_CENTRE + i, centre[i]);
      put(FLOW_GRID_SHIFT + i, shift[i]);
      double reach = size_[i];
      for (int j = 0; j < 3; j++) {
        put(FLOW_GRID_MATRIX + 3 * i + j, world_to_index[j][i]);
        reach += std::abs(world_to_index[j][i]) * farthest[j];
      }
      put(FLOW_GRID_SLACK + i, std::min(border_roundings * 0x1p-24 * reach, 0.5));
    }
    uniforms_ = TypedBuffer<std::uint32_t>(executor_, words.size(), "numbers of a vector field");
    uniforms_.write(words);
  }

  // `marks` is empty where every vector can be used.
  void upload_vectors(const GridFlow& flow, const std::vector<float>& marks) {
    const Values<glm::vec3>& vectors = flow.grid.vectors;
    samples_ = allocate(size_, "vectors of a field");
    const std::size_t slab = std::size_t(1) << 18;
    std::vector<glm::vec4> nodes(std::min(slab, vectors.size()));
    for (std::size_t first = 0; first < vectors.size(); first += slab) {
      const std::size_t count = std::min(slab, vectors.size() - first);
      for (std::size_t i = 0; i < count; i++) {
        const glm::vec3& v = vectors[first + i];
        nodes[i] = glm::vec4(marks.empty() || is_usable(v) ? v : glm::vec3(0), marks.empty() ? 0 : marks[first + i]);
      }
      executor_.write(*samples_, first * sizeof(glm::vec4), nodes.data(), count * sizeof(glm::vec4));
    }
  }

  void make_coefficients() {
    const std::size_t count = count_of(size_);
    for (int axis = 0; axis < 3; axis++) {
      launch(executor_, Program{KernelId::vector_prefilter, {}, {}},
             arguments::vector_prefilter{.samples = samples_.get(),
                                         .size_x = size_.x,
                                         .size_y = size_.y,
                                         .size_z = size_.z,
                                         .axis = axis,
                                         .periodic = 0},
             3 * (count / std::size_t(size_[axis])));
    }
    std::unique_ptr<DeviceBuffer> padded = allocate(size_ + 2, "B-spline coefficients of a vector field");
    launch(executor_, Program{KernelId::vector_pad, {}, {}},
           arguments::vector_pad{.from = samples_.get(),
                                 .to = padded.get(),
                                 .size_x = size_.x,
                                 .size_y = size_.y,
                                 .size_z = size_.z,
                                 .periodic = 0},
           count_of(size_ + 2));
    executor_.finish();
    samples_ = std::move(padded);
  }

  std::unique_ptr<DeviceBuffer> allocate(const glm::ivec3& size, std::string_view purpose) {
    const std::size_t count = count_of(size);
    const std::size_t most = std::size_t(std::numeric_limits<std::int32_t>::max()) / FLOW_NODE_WORDS;
    if (count > most)
      throw Error(ErrorCode::memory,
                  fmt::format("{} x {} x {} nodes of a vector field are more than a kernel can count; "
                              "at most {} are possible, with the margin of a tricubic one",
                              size.x, size.y, size.z, most));
    return executor_.allocate(count * sizeof(glm::vec4), purpose);
  }

  Executor& executor_;
  const glm::ivec3 size_;
  std::map<std::string, std::string> modules_, defines_;
  TypedBuffer<std::uint32_t> uniforms_;
  std::unique_ptr<DeviceBuffer> samples_;
};

}  // namespace

std::unique_ptr<ResidentFlow> reside_grid_flow(const VectorFieldDefinition& definition, Executor& executor,
                                               const PrepareOptions&) {
  return std::make_unique<ResidentGridFlow>(dynamic_cast<const GridFlow&>(definition), executor);
}

}  // namespace smurf
