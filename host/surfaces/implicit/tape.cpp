// Surfaces given by long expressions on a device: a tape that kernels interpret (kernels/implicit/tape_cells.inc),
// shortened for each block of cells to what matters there.
//
// The host bounds the expression on boxes, from large to small, in double intervals; where a box can hold a root its
// parts are looked at with what is left of the expression there. So most operations are run on few boxes only (Keeter
// 2020).
//
// Device memory: 1.3 bytes for each cell, 64 for each active one, and 8 for each operation of each tape; equal tapes
// are kept once.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <map>
#include <mutex>
#include <span>
#include <vector>

#include "expression/source.hpp"
#include "expression/tape.hpp"
#include "numerics/parallel.hpp"
#include "smurf/error.hpp"
#include "surfaces/grid/active_cells.hpp"
#include "surfaces/implicit/cells.hpp"

namespace smurf {
namespace {

using expression::Interval;
using expression::Program;
using expression::Tape;

// Cells along the longest side of the domain, at most; what a cell needs is found on the host.
constexpr int most_cells = 96;
constexpr int block_cells = ActiveCells::block_cells;

// Rays that are followed in floats come this far out of a cell (implicit/cells.inc: MODEL_REACH).
constexpr double cell_margin = 1.0 / 64;

constexpr std::string_view no_words;

// Whether the function has creases (kernels/arithmetic/bounded.inc).
bool has_choices(const Program& program) {
  return std::ranges::any_of(program.nodes, [](const expression::Node& node) {
    using expression::Op;
    return node.op == Op::abs || node.op == Op::min || node.op == Op::max || node.op == Op::choose ||
           node.op == Op::sign;
  });
}

std::string device_functions(const Program& program) {
  const auto variables = [](std::string_view prefix) {
    return fmt::format("{0}0; if (more == 1) r = {0}1; if (more == 2) r = {0}2", prefix);
  };
  const std::string as_is = variables("v");
  std::string text =
      "#include \"arithmetic/interval_dual_number.inc\"\n#include \"arithmetic/interval_dual_defined.inc\"\n";
  text += interpreter_source(
      program, {.head = "FN_SHARED Span expression_span(Tape tape, IntervalDual v0, IntervalDual v1, IntervalDual v2)",
                .before = "  mask undefined = mask_none();\n",
                .variable = as_is,
                .select = "    span.field = interval_dual_select(here, r, span.field);\n"
                          "    span.undefined = (here && undefined) || (!here && span.undefined);\n"
                          "    undefined = mask_none();",
                .result = "  Span span;\n  span.field = v0;\n  span.undefined = mask_none();",
                .after = "  return span;\n"});
  text += "#include \"arithmetic/bounded_number.inc\"\nSTRUCT(Bounded3) { Bounded x, y, z; };\n";
  text += interpreter_source(
      program, {.head = "FN_SHARED Bounded expression_point(Tape tape, Bounded v0, Bounded v1, Bounded v2)",
                .before = no_words,
                .variable = as_is,
                .select = "    result = bounded_select(here, r, result);",
                .result = "  Bounded result = v0;",
                .after = "  return result;\n"});
  text += "#include \"arithmetic/dual.inc\"\n";
  text += interpreter_source(program, {.head = "FN_SHARED Dual expression_along(Tape tape, Dual v0, Dual v1, Dual v2)",
                                       .before = no_words,
                                       .variable = as_is,
                                       .select = "    result.value = here ? r.value : result.value;\n"
                                                 "    result.slope = here ? r.slope : result.slope;",
                                       .result = "  Dual result = v0;",
                                       .after = "  return result;\n"});
  text += "#include \"arithmetic/jet.inc\"\nSTRUCT(Jet) { real value; real3 gradient; Symmetric3 hessian; };\n";
  text += interpreter_source(
      program,
      {.head = "FN_SHARED JetNumber expression_jet_number(Tape tape, JetNumber v0, JetNumber v1, JetNumber v2)",
       .before = no_words,
       .variable = as_is,
       .select = "    result = jet_select(here, r, result);",
       .result = "  JetNumber result = v0;",
       .after = "  return result;\n"});
  text +=
      "FN JetNumber expression_jet_at(Tape tape, Bounded x, Bounded y, Bounded z) {\n"
      "  real one = splat(1.0f);\n  real zero = splat(0.0f);\n"
      "  return expression_jet_number(tape, jet_variable(x, one, zero, zero), jet_variable(y, zero, one, zero),\n"
      "                               jet_variable(z, zero, zero, one));\n}\n"
      "FN Jet expression_jet(Tape tape, real x, real y, real z) {\n"
      "  JetNumber n = expression_jet_at(tape, bounded_exact(x), bounded_exact(y), bounded_exact(z));\n  Jet jet;\n"
      "  jet.value = bounded_known(n.value) ? n.value.value : not_a_number();\n"
      "  jet.gradient = make3(n.x.value, n.y.value, n.z.value);\n  jet.hessian = n.bend;\n  return jet;\n}\n"
      "FN Bounded3 expression_gradient(Tape tape, Bounded x, Bounded y, Bounded z) {\n"
      "  JetNumber n = expression_jet_at(tape, x, y, z);\n  Bounded3 g;\n"
      "  g.x = n.x;\n  g.y = n.y;\n  g.z = n.z;\n  return g;\n}\n";
  return text;
}

// Which cells can hold a root, and what is left of the expression in each block that has any.
class CellSearch {
 public:
  CellSearch(const Program& program, const CellGrid& grid, double level)
      : grid_(grid), level_(level), blocks_(ActiveCells::blocks_of(grid.cells)) {
    bits.assign(std::size_t(blocks_.x) * std::size_t(blocks_.y) * std::size_t(blocks_.z), glm::uvec2(0));
    tapes.resize(bits.size());
    // The largest boxes go to the threads.
    const int side = block_cells * block_cells * block_cells;
    const glm::ivec3 parts = (grid.cells + side - 1) / side;
    parallel_for(std::size_t(parts.x) * std::size_t(parts.y) * std::size_t(parts.z), [&](std::size_t i) {
      const int n = int(i);
      std::vector<Interval> values;
      search(program, side * glm::ivec3(n % parts.x, n / parts.x % parts.y, n / parts.x / parts.y), side, values);
    });
  }

  std::vector<glm::uvec2> bits;  // of the active cells in each block
  std::vector<Tape> tapes;       // of the blocks that have any

 private:
  std::size_t block_index(glm::ivec3 cell) const {
    const glm::ivec3 block = cell / block_cells;
    return (std::size_t(block.z) * std::size_t(blocks_.y) + std::size_t(block.y)) * std::size_t(blocks_.x) +
           std::size_t(block.x);
  }

  // Whether the function can be the level in `side`³ cells from `cell` on. Leaves each node's bounds in `values`.
  bool reaches(const Program& program, glm::ivec3 cell, int side, std::vector<Interval>& values) const {
    std::array<Interval, 3> box;
    for (int axis = 0; axis < 3; axis++) {
      const double low = grid_.origin[axis] + grid_.size * (cell[axis] - cell_margin);
      const double high = grid_.origin[axis] + grid_.size * (cell[axis] + side + cell_margin);
      box[std::size_t(axis)] = {low, high, true};
    }
    expression::evaluate(program, box, values);
    const Interval& value = values[program.roots[0]];
    return value.low <= level_ && value.high >= level_;
  }

  void search(const Program& program, glm::ivec3 cell, int side, std::vector<Interval>& values) {
    if (glm::any(glm::greaterThanEqual(cell, grid_.cells)) || !reaches(program, cell, side, values)) return;
    if (side == 1) {
      const glm::ivec3 in = cell % block_cells;
      const int bit = in.x + block_cells * in.y + block_cells * block_cells * in.z;
      bits[block_index(cell)][bit / 32] |= 1u << (bit % 32);
      return;
    }
    const Program rest = expression::pruned(program, values);
    const int part = side / block_cells;
    for (int i = 0; i < 64; i++) search(rest, cell + part * glm::ivec3(i & 3, (i >> 2) & 3, i >> 4), part, values);
    if (side != block_cells) return;
    const glm::uvec2 found = bits[block_index(cell)];
    if (found.x != 0 || found.y != 0) tapes[block_index(cell)] = expression::make_tape(rest);
  }

  const CellGrid& grid_;
  const double level_;
  const glm::ivec3 blocks_;
};

class ResidentTape final : public ResidentSurface {
 public:
  ResidentTape(const ImplicitSurface& surface, Executor& executor)
      : executor_(executor),
        domain_(surface.domain),
        grid_(domain_, most_cells),
        function_(surface.function),
        program_(expression::device_program(function_->graph, function_->value)),
        whole_(expression::make_tape(program_)) {
    modules_["surface"] = kernel_source("implicit/surface.inc");
    modules_["models"] = kernel_source("implicit/tape_cells.inc");
    modules_["expression"] = device_functions(program_);
    defines_["PADDED"] = "0";
    ActiveCells::define_traversal(defines_, grid_.cells, true);
    defines_["SIDES"] = "1";
    defines_["CHOICES"] = has_choices(program_) ? "1" : "0";
    // Programs are shared by expressions of about the same size.
    defines_["TAPE_REGISTERS"] = fmt::format("{}", std::max(32u, std::bit_ceil(unsigned(whole_.registers))));
    uniforms_ = TypedBuffer<std::uint32_t>(executor, IMPLICIT_UNIFORM_WORDS, "surface uniforms");
    cells_ = std::make_unique<ImplicitCells>(executor, grid_, modules_, defines_, *uniforms_.get());
    make(surface);
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override { return cells_->buffers(tapes_.get()); }
  std::size_t bytes() const override { return uniforms_.bytes() + cells_->bytes() + tapes_.bytes(); }

  bool update(const SurfaceDefinition& model) override {
    const auto* other = dynamic_cast<const ImplicitSurface*>(&model);
    if (!other || other->function != function_ || !(other->domain == domain_)) return false;
    make(*other);
    return true;
  }

 private:
  void make(const ImplicitSurface& surface) {
    uniforms_.write(uniform_words(surface, grid_));
    const CellSearch search(program_, grid_, surface.level);
    // The whole tape stands first, for points in blocks without a root.
    std::vector<std::uint32_t> words = whole_.words;
    std::map<std::vector<std::uint32_t>, std::uint32_t> known;
    std::vector<std::uint32_t> places;
    for (std::size_t i = 0; i < search.bits.size(); i++) {
      std::uint32_t at = 0;
      if (!search.tapes[i].words.empty()) {
        const auto [entry, fresh] = known.emplace(search.tapes[i].words, std::uint32_t(words.size()));
        at = entry->second;
        if (fresh) words.insert(words.end(), search.tapes[i].words.begin(), search.tapes[i].words.end());
      }
      places.push_back(at);
    }
    if (words.size() > std::size_t(std::numeric_limits<std::int32_t>::max()))
      throw Error(ErrorCode::memory,
                  fmt::format("the tapes of an expression take {} words; at most 2^31-1 are possible", words.size()));
    tapes_ = TypedBuffer<std::uint32_t>(executor_, words.size(), "tapes");
    tapes_.write(words);
    cells_->make(search.bits, places, tapes_.get());
  }

  Executor& executor_;
  const Domain domain_;
  const CellGrid grid_;
  std::shared_ptr<const ImplicitFunction> function_;
  const Program program_;
  const Tape whole_;
  std::map<std::string, std::string> modules_, defines_;
  TypedBuffer<std::uint32_t> uniforms_;
  std::unique_ptr<ImplicitCells> cells_;
  TypedBuffer<std::uint32_t> tapes_;
};

}  // namespace

std::unique_ptr<ResidentSurface> reside_as_tape(const ImplicitSurface& surface, Executor& executor) {
  return std::make_unique<ResidentTape>(surface, executor);
}

}  // namespace smurf
