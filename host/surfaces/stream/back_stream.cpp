// Stream surfaces on a device without a mesh (kernels/stream/back_stream.inc): the nodes of a lattice about the surface
// are traced to the seed curve on the device, and the host makes of them the table of where the surface may be.
//
// Device memory: 52 bytes a node while the table is made; then 4 bytes a cell, 64 a branch (about one for each cell
// that the surface passes), and what the flow's map needs.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "kernels/patch/layout.inc"
#include "kernels/stream/back_layout.inc"
#include "kernels/stream/curtain_layout.inc"
#include "surfaces/stream/curtain.hpp"
#include "surfaces/stream/flow_map.hpp"
#include "surfaces/stream/resident.hpp"

namespace smurf {
namespace {

constexpr int longest_axis = 64;                               // cells
constexpr std::size_t sample_lines = 769, sample_times = 769;  // that tell where the surface is
constexpr std::size_t kept_each = 24;                          // of these one is kept along each direction
constexpr double table_tolerance = 0.01;                       // of a cell, of a step
constexpr double table_longest = 1.0 / 16;                     // of the extent, a step
constexpr double table_margin = 4;                             // cells, beyond the range of τ
constexpr int table_steps = 400;
constexpr std::size_t nodes_in_launch = 1 << 16;

class Words {
 public:
  explicit Words(std::size_t count) : words(count) {}
  void put(std::size_t at, double value) { words[at] = std::bit_cast<std::uint32_t>(float(value)); }
  void put(std::size_t at, const glm::dvec3& v) {
    for (int axis = 0; axis < 3; axis++) put(at + std::size_t(axis), v[axis]);
  }
  void put_integer(std::size_t at, int value) { words[at] = std::uint32_t(value); }
  std::vector<std::uint32_t> words;
};

class ResidentBackStream final : public ResidentSurface {
 public:
  ResidentBackStream(const StreamSurface& surface, Executor& executor, const PrepareOptions& options)
      : map_(surface, executor, options) {
    map_.add_to(modules_, defines_);
    modules_["surface"] = kernel_source("stream/back_stream.inc");
    modules_["walk"] = kernel_source("patch/walk.inc");
    modules_["walk_pieces"] = kernel_source("stream/back_pieces.inc");
    defines_["WALK_PART"] = "0.0625f";
    defines_["WALK_NOTHING"] = "WALK_BOUNDARY";
    const std::unique_ptr<FlowQueries> flow = trace_on_device(executor, surface.share_field(), {});
    const StreamSamples samples = sample_stream(*flow, surface, sample_lines, sample_times);
    const bool closed = map_.seed().closed;
    const Curtain curtain = make_curtain(*flow, surface, closed);
    const Lattice lattice = make_lattice(samples.bounds, longest_axis);
    const BackTable table =
        make_back_table(surface, curtain, closed, lattice, trace_nodes(executor, surface, curtain, lattice), samples);
    upload(executor, table.cells, cells_, "cells of the back-stream table");
    upload(executor, table.branches, branches_, "branches of the back-stream table");
    upload_uniforms(executor, lattice, samples);
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override {
    BufferGroup group{{"uniforms", uniforms_.get()},
                      {"cells", cells_.get()},
                      {"branches", branches_.get()},
                      {"points", points_.get()}};
    map_.add_to(group);
    return group;
  }
  std::size_t bytes() const override {
    return map_.bytes() + uniforms_.bytes() + cells_.bytes() + branches_.bytes() + points_.bytes();
  }
  bool update(const SurfaceDefinition&) override { return false; }

 private:
  using WordBuffer = TypedBuffer<std::uint32_t>;

  static void upload(Executor& executor, const std::vector<std::uint32_t>& words, WordBuffer& buffer,
                     std::string_view purpose) {
    buffer = WordBuffer(executor, words.size(), purpose);
    buffer.write(words);
  }

  std::vector<std::uint32_t> trace_nodes(Executor& executor, const StreamSurface& surface, const Curtain& curtain,
                                         const Lattice& lattice) const {
    const std::size_t starts = curtain.u.size();
    Words words(CURTAIN_STARTS + CURTAIN_WORDS * starts);
    const glm::dvec2 time = surface.options().time;
    const glm::ivec3 nodes = lattice.nodes();
    words.put(CURTAIN_LOWER_T, time.x);
    words.put(CURTAIN_UPPER_T, time.y);
    words.put(CURTAIN_TOLERANCE, table_tolerance * lattice.cell);
    words.put(CURTAIN_LONGEST, table_longest * surface.field_extent());
    words.put(CURTAIN_MARGIN, table_margin * lattice.cell);
    words.put(CURTAIN_CORNER, lattice.corner);
    words.put(CURTAIN_CELL, lattice.cell);
    words.put_integer(CURTAIN_NODES_X, nodes.x);
    words.put_integer(CURTAIN_NODES_Y, nodes.y);
    words.put_integer(CURTAIN_PIECES, int(starts) - 1);
    words.put_integer(CURTAIN_CLOSED, map_.seed().closed ? 1 : 0);
    words.put_integer(CURTAIN_MOST_STEPS, table_steps);
    for (std::size_t i = 0; i < starts; i++) {
      const std::size_t at = CURTAIN_STARTS + CURTAIN_WORDS * i;
      words.put(at + CURTAIN_X, curtain.position[i]);
      words.put(at + CURTAIN_ACROSS, curtain.across[i]);
      words.put(at + CURTAIN_U, curtain.u[i]);
    }
    WordBuffer lines;
    upload(executor, words.words, lines, "curtain");
    const std::size_t count = std::size_t(nodes.x) * std::size_t(nodes.y) * std::size_t(nodes.z);
    std::vector<std::uint32_t> found(count * NODE_WORDS);
    WordBuffer table(executor, found.size(), "nodes of the back-stream table");
    Program program = map_.flow().program(KernelId::trace_curtain);
    program.modules["integrator"] = kernel_source("flow/dormand_prince.inc");
    for (std::size_t first = 0; first < count; first += nodes_in_launch) {
      const std::size_t end = std::min(count, first + nodes_in_launch);
      launch(executor, program,
             arguments::trace_curtain{.flow = map_.flow().buffers(),
                                      .curtain = lines.get(),
                                      .table = table.get(),
                                      .first = int(first),
                                      .end = int(end)},
             end - first);
    }
    table.read(found);
    return found;
  }

  void upload_uniforms(Executor& executor, const Lattice& lattice, const StreamSamples& samples) {
    const double extent = lattice.cell * std::max({lattice.cells.x, lattice.cells.y, lattice.cells.z});
    const double unit = std::ldexp(1.0, -std::clamp(std::ilogb(extent), -120, 120));
    const glm::dvec3 centre(glm::vec3(lattice.corner + 0.5 * lattice.cell * glm::dvec3(lattice.cells)));
    Words words(BACK_UNIFORM_WORDS);
    words.put(PATCH_CENTRE, centre);
    words.put(PATCH_UNIT, unit);
    words.put(BACK_LOWER, (lattice.corner - centre) * unit);
    words.put(BACK_CELL, lattice.cell * unit);
    for (int axis = 0; axis < 3; axis++) words.put_integer(std::size_t(BACK_CELLS + axis), lattice.cells[axis]);
    const std::size_t lines = (samples.lines - 1) / kept_each + 1, times = (samples.times - 1) / kept_each + 1;
    words.put_integer(BACK_LINES, int(lines));
    words.put_integer(BACK_TIMES, int(times));
    words.put_integer(BACK_CLOSED_T, samples.closed_in_time ? 1 : 0);
    upload(executor, words.words, uniforms_, "surface uniforms");
    Words points(BACK_SAMPLE_WORDS * lines * times);
    for (std::size_t i = 0; i < lines; i++) {
      for (std::size_t j = 0; j < times; j++) {
        const std::size_t from = i * kept_each * samples.times + j * kept_each;
        const std::size_t at = BACK_SAMPLE_WORDS * (i * times + j);
        points.put(at + SAMPLE_X, (samples.points[from].position - centre) * unit);
        points.put(at + SAMPLE_U, samples.points[from].u);
        points.put(at + SAMPLE_T, samples.points[from].tau);
        points.put(at + SAMPLE_THERE, samples.there[from] ? 1 : 0);
      }
    }
    upload(executor, points.words, points_, "points of the surface");
  }

  StreamMap map_;
  std::map<std::string, std::string> modules_, defines_;
  WordBuffer uniforms_, cells_, branches_, points_;
};

}  // namespace

std::unique_ptr<ResidentSurface> reside_back_stream(const StreamSurface& surface, Executor& executor,
                                                    const PrepareOptions& options) {
  return std::make_unique<ResidentBackStream>(surface, executor, options);
}

}  // namespace smurf
