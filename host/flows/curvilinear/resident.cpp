// Vector fields on curvilinear blocks on a device: nodes, vectors, and tables of voxels that name the cells about a
// point.
//
// Device memory: 32 bytes a node, and for the voxels about 50 a cell, more where cells lie askew; tricubic: 48 bytes a
// node, of which 32 also for a margin of one node, and 16 more while they are made.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "fields/curvilinear_cells.hpp"
#include "fields/voxel_tables.hpp"
#include "flows/curvilinear/definition.hpp"
#include "flows/kinds.hpp"
#include "flows/resident_flow.hpp"
#include "kernels/flow/curvilinear_layout.inc"
#include "kernels/flow/layout.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr double seam_tolerance = 1e-6;  // of the extent, as definition.cpp says
// The bound by which devices end Newton's method is that of the worst case. With this part of the tolerance places are,
// by default, about as exact as nodes are in floats.
constexpr double part_of_tolerance = 0.125;
// Rounding of a node, of a point and of the map between them: half a unit in the last place each, and half of it more.
constexpr double roundings = 1.5 * 0x1p-23;

bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// From the world to the coordinates of devices: (p - centre) * unit.
struct Frame {
  glm::vec3 centre{0.0f};
  double unit = 1;
  double size = 0;    // greatest coordinate of a node
  double extent = 0;  // in the world

  glm::vec3 place(const glm::dvec3& point) const { return (point - glm::dvec3(centre)) * unit; }
};

Frame frame_of(const CurvilinearFlow& flow) {
  glm::dvec3 lower(std::numeric_limits<double>::infinity()), upper(-lower);
  for (const CurvilinearBlock& block : flow.blocks)
    for (const glm::dvec3& point : block.points) {
      lower = glm::min(lower, point);
      upper = glm::max(upper, point);
    }
  Frame frame;
  frame.centre = 0.5 * lower + 0.5 * upper;
  const glm::dvec3 half = glm::max(upper - glm::dvec3(frame.centre), glm::dvec3(frame.centre) - lower);
  const double most = std::max({half.x, half.y, half.z});
  frame.unit = std::ldexp(1.0, std::clamp(-std::ilogb(most), -120, 120));
  frame.size = most * frame.unit;
  const Bounds bounds = flow.bounds();
  const glm::dvec3 sides = bounds.upper - bounds.lower;
  frame.extent = std::max({sides.x, sides.y, sides.z});
  return frame;
}

// All that devices are given of the blocks.
struct BlockWords {
  std::vector<std::uint32_t> blocks;
  std::vector<float> nodes, vectors;
  std::vector<CellBox> boxes;
  std::size_t spline_nodes = 0;  // of all blocks, with their margins
};

std::size_t padded_count(const glm::ivec3& size) { return node_count(size + 2); }

// Marks of cells at their first nodes: those that are decided by tetrahedra, and those that share a face with one.
void mark_cells(const glm::ivec3& size, const std::array<bool, 3>& seams, const std::vector<std::uint8_t>& irregular,
                std::span<float> nodes) {
  const glm::ivec3 cells = size - 1;
  const auto mark = [&](const glm::ivec3& cell) -> float& {
    return nodes[4 * node_at(size, cell.x, cell.y, cell.z) + 3];
  };
  const auto is_irregular = [&](const glm::ivec3& cell) {
    return irregular[node_at(cells, cell.x, cell.y, cell.z)] != 0;
  };
  glm::ivec3 cell(0);
  for (cell.z = 0; cell.z < cells.z; cell.z++)
    for (cell.y = 0; cell.y < cells.y; cell.y++)
      for (cell.x = 0; cell.x < cells.x; cell.x++) {
        if (is_irregular(cell)) {
          mark(cell) += float(CURVILINEAR_TETRAHEDRAL);
          continue;
        }
        bool beside = false;
        for (int axis = 0; axis < 3; axis++)
          for (const int step : {-1, 1}) {
            glm::ivec3 other = cell;
            other[axis] += step;
            if (seams[std::size_t(axis)]) other[axis] = (other[axis] + cells[axis]) % cells[axis];
            if (other[axis] >= 0 && other[axis] < cells[axis]) beside = beside || is_irregular(other);
          }
        if (beside) mark(cell) += float(CURVILINEAR_BESIDE);
      }
}

// Marks of cells whose vectors are made of one that is not finite: `reach` 0, the corners of the cell; 1, one node more
// on each side, of which splines are made. Vectors of blanked nodes do not count.
void mark_undefined(const CurvilinearBlock& block, int reach, std::span<float> nodes) {
  const glm::ivec3 size = block.size;
  std::vector<std::uint8_t> marked(node_count(size));
  glm::ivec3 node(0), cell(0);
  for (node.z = 0; node.z < size.z; node.z++)
    for (node.y = 0; node.y < size.y; node.y++)
      for (node.x = 0; node.x < size.x; node.x++) {
        const std::size_t number = node_at(size, node.x, node.y, node.z);
        if (finite(block.vectors[number]) || (!block.blanked.empty() && block.blanked[number] != 0)) continue;
        const glm::ivec3 first = glm::max(node - 1 - reach, 0), last = glm::min(node + reach, size - 2);
        for (cell.z = first.z; cell.z <= last.z; cell.z++)
          for (cell.y = first.y; cell.y <= last.y; cell.y++)
            for (cell.x = first.x; cell.x <= last.x; cell.x++) marked[node_at(size, cell.x, cell.y, cell.z)] = 1;
      }
  for (std::size_t number = 0; number < marked.size(); number++)
    if (marked[number] != 0) nodes[4 * number + 3] += float(CURVILINEAR_UNDEFINED);
}

// Boxes of cells; where splines count, as far as these may bulge.
void append_boxes(const glm::ivec3& size, bool cubic, std::span<const float> nodes, std::vector<CellBox>& boxes) {
  for (int k = 0; k + 1 < size.z; k++)
    for (int j = 0; j + 1 < size.y; j++)
      for (int i = 0; i + 1 < size.x; i++) {
        CellBox box{glm::vec3(std::numeric_limits<float>::infinity()), {}};
        box.upper = -box.lower;
        for (int corner = 0; corner < 8; corner++) {
          const float* node = &nodes[4 * node_at(size, i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2))];
          const glm::vec3 place(node[0], node[1], node[2]);
          box.lower = glm::min(box.lower, place);
          box.upper = glm::max(box.upper, place);
        }
        const glm::vec3 sides = box.upper - box.lower;
        const float bulge = cubic ? CURVILINEAR_BULGE * std::max({sides.x, sides.y, sides.z}) : 0.0f;
        boxes.push_back({box.lower - bulge, box.upper + bulge});
      }
}

void append_block(const CurvilinearBlock& block, const Frame& frame, bool cubic, BlockWords& words) {
  const glm::ivec3 size = block.size;
  const std::array<bool, 3> seams = find_seams(size, block.points, seam_tolerance * frame.extent);
  const auto inverse = [](int cells) { return std::bit_cast<std::uint32_t>(1.0f / float(cells)); };
  words.blocks.insert(words.blocks.end(),
                      {std::uint32_t(words.boxes.size()), std::uint32_t(words.nodes.size() / FLOW_NODE_WORDS),
                       std::uint32_t(size.x), std::uint32_t(size.y), std::uint32_t(size.z),
                       std::uint32_t(seams[0]) + 2 * std::uint32_t(seams[1]) + 4 * std::uint32_t(seams[2]),
                       inverse(size.x - 1), inverse(size.y - 1), std::uint32_t(words.spline_nodes), 0, 0, 0});
  words.spline_nodes += padded_count(size);
  const std::size_t first = words.nodes.size();
  std::vector<glm::dvec3> rounded;  // cells are judged as devices see them
  rounded.reserve(block.points.size());
  for (std::size_t node = 0; node < block.points.size(); node++) {
    const glm::vec3 place = frame.place(block.points[node]);
    const bool blanked = !block.blanked.empty() && block.blanked[node] != 0;
    rounded.emplace_back(place);
    words.nodes.insert(words.nodes.end(), {place.x, place.y, place.z, blanked ? float(CURVILINEAR_BLANKED) : 0.0f});
    const glm::vec3 vector = block.vectors[node];
    const glm::vec3 stored = finite(vector) ? vector : glm::vec3(0.0f);
    words.vectors.insert(words.vectors.end(), {stored.x, stored.y, stored.z, 0.0f});
  }
  const std::span<float> nodes(words.nodes.data() + first, words.nodes.size() - first);
  mark_cells(size, seams, examine_cells(size, rounded).irregular, nodes);
  mark_undefined(block, cubic ? 1 : 0, nodes);
  append_boxes(size, cubic, nodes, words.boxes);
}

class ResidentCurvilinear final : public ResidentFlow {
 public:
  ResidentCurvilinear(const CurvilinearFlow& flow, Executor& executor) {
    const bool cubic = flow.reconstruction == VectorReconstruction::tricubic;
    modules_["flow"] = kernel_source("flow/curvilinear.inc");
    defines_["FLOW_CUBIC"] = cubic ? "1" : "0";
    const Frame frame = frame_of(flow);
    BlockWords words;
    for (const CurvilinearBlock& block : flow.blocks) append_block(block, frame, cubic, words);
    const auto slack = float(roundings * frame.size);
    const VoxelTables tables = build_voxel_tables(words.boxes, slack);
    upload_uniforms(flow, executor, frame, slack, tables);
    upload(executor, words.blocks, blocks_, "blocks of a curvilinear field");
    upload(executor, words.nodes, nodes_, "nodes of a curvilinear field");
    upload(executor, tables.tables, tables_, "tables of voxels");
    upload(executor, tables.voxels, voxels_, "voxels of a curvilinear field");
    upload(executor, tables.cells, cells_, "cells of voxels");
    if (cubic) {
      make_spline(executor, words, words.nodes, spline_nodes_, "coefficients of nodes");
      make_spline(executor, words, words.vectors, spline_vectors_, "coefficients of vectors");
    } else {
      upload(executor, words.vectors, vectors_, "vectors of a curvilinear field");
    }
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override {
    return {{"uniforms", uniforms_.get()},
            {"blocks", blocks_.get()},
            {"nodes", nodes_.get()},
            {"vectors", vectors_.get()},
            {"spline_nodes", spline_nodes_.get()},
            {"spline_vectors", spline_vectors_.get()},
            {"tables", tables_.get()},
            {"voxels", voxels_.get()},
            {"cells", cells_.get()}};
  }
  std::size_t bytes() const override {
    return uniforms_.bytes() + blocks_.bytes() + nodes_.bytes() + vectors_.bytes() + spline_nodes_.bytes() +
           spline_vectors_.bytes() + tables_.bytes() + voxels_.bytes() + cells_.bytes();
  }

 private:
  template <class T>
  static void upload(Executor& executor, const std::vector<T>& words, TypedBuffer<T>& buffer,
                     std::string_view purpose) {
    buffer = TypedBuffer<T>(executor, words.size(), purpose);
    buffer.write(words);
  }

  // Samples of all blocks -> coefficients, with a node more on each side. Kernels do one block at a time.
  static void make_spline(Executor& executor, const BlockWords& words, const std::vector<float>& samples,
                          TypedBuffer<float>& splines, std::string_view purpose) {
    const std::size_t most = std::size_t(std::numeric_limits<std::int32_t>::max()) / FLOW_NODE_WORDS;
    if (words.spline_nodes > most)
      throw Error(
          ErrorCode::memory,
          fmt::format("{} nodes of a tricubic curvilinear field, with a margin of one, are more than a kernel can "
                      "count; at most {} are possible",
                      words.spline_nodes, most));
    splines = TypedBuffer<float>(executor, FLOW_NODE_WORDS * words.spline_nodes, purpose);
    for (std::size_t at = 0; at < words.blocks.size(); at += CURVILINEAR_BLOCK_WORDS) {
      const std::uint32_t* block = words.blocks.data() + at;
      const glm::ivec3 size{int(block[2]), int(block[3]), int(block[4])};
      const std::size_t nodes = node_count(size), padded = padded_count(size);
      TypedBuffer<float> from(executor, FLOW_NODE_WORDS * nodes, purpose),
          to(executor, FLOW_NODE_WORDS * padded, purpose);
      from.write({samples.data() + FLOW_NODE_WORDS * std::size_t(block[1]), FLOW_NODE_WORDS * nodes});
      const int seams = int(block[5]);
      for (int axis = 0; axis < 3; axis++)
        launch(executor, Program{KernelId::vector_prefilter, {}, {}},
               arguments::vector_prefilter{.samples = from.get(),
                                           .size_x = size.x,
                                           .size_y = size.y,
                                           .size_z = size.z,
                                           .axis = axis,
                                           .periodic = seams >> axis & 1},
               3 * (nodes / std::size_t(size[axis])));
      launch(executor, Program{KernelId::vector_pad, {}, {}},
             arguments::vector_pad{.from = from.get(),
                                   .to = to.get(),
                                   .size_x = size.x,
                                   .size_y = size.y,
                                   .size_z = size.z,
                                   .periodic = seams},
             padded);
      std::vector<float> made(FLOW_NODE_WORDS * padded);
      to.read(made);
      splines.write(made, FLOW_NODE_WORDS * std::size_t(block[CURVILINEAR_BLOCK_SPLINE]));
    }
  }

  void upload_uniforms(const CurvilinearFlow& flow, Executor& executor, const Frame& frame, float slack,
                       const VoxelTables& tables) {
    std::vector<std::uint32_t> words(CURVILINEAR_UNIFORM_WORDS);
    const auto put = [&](int at, float value) { words[std::size_t(at)] = std::bit_cast<std::uint32_t>(value); };
    for (int axis = 0; axis < 3; axis++) {
      put(CURVILINEAR_CENTRE + axis, frame.centre[axis]);
      put(CURVILINEAR_LOWER + axis, tables.lower[axis]);
      put(CURVILINEAR_UPPER + axis, tables.upper[axis]);
    }
    put(CURVILINEAR_UNIT, float(frame.unit));
    put(CURVILINEAR_TOLERANCE, float(part_of_tolerance * flow.tolerance * frame.unit));
    put(CURVILINEAR_SLACK, slack);
    words[CURVILINEAR_BLOCKS] = std::uint32_t(flow.blocks.size());
    words[CURVILINEAR_HALVINGS] = std::uint32_t(std::bit_width(flow.blocks.size() - 1));
    upload(executor, words, uniforms_, "uniforms of a curvilinear field");
  }

  std::map<std::string, std::string> modules_, defines_;
  TypedBuffer<std::uint32_t> uniforms_, blocks_, tables_, voxels_, cells_;
  TypedBuffer<float> nodes_, vectors_, spline_nodes_, spline_vectors_;
};

}  // namespace

std::unique_ptr<ResidentFlow> reside_curvilinear_flow(const VectorFieldDefinition& definition, Executor& executor,
                                                      const PrepareOptions&) {
  return std::make_unique<ResidentCurvilinear>(dynamic_cast<const CurvilinearFlow&>(definition), executor);
}

}  // namespace smurf
