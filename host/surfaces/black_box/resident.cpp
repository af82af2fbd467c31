// Black boxes on a device: the user's source becomes a module of the kernels (kernels/black_box/surface.inc). Device
// memory: a few words.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "kernels/black_box/layout.inc"
#include "smurf/error.hpp"
#include "surfaces/black_box/definition.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/resident_surface.hpp"

namespace smurf {
namespace {

constexpr int first_line_behind = 1000001;  // lines of the assembled program that follow the user's

double largest_coordinate(const Domain& domain) {
  const glm::dvec3 most = glm::max(glm::abs(domain.lower), glm::abs(domain.upper));
  return std::max({most.x, most.y, most.z});
}

// The grid on which stencils are exact: a power of two, such that 1.5·2^23 of it plus or minus any coordinate they
// reach is rounded to it.
double stencil_grid(const BlackBoxSurface& surface) {
  const double reach = largest_coordinate(surface.domain) + 3 * surface.difference_step(2, 24);
  return std::ldexp(1.0, std::ilogb(reach) - 21);
}

std::array<std::uint32_t, BLACK_BOX_UNIFORM_WORDS> uniform_words(const BlackBoxSurface& surface) {
  std::array<std::uint32_t, BLACK_BOX_UNIFORM_WORDS> words{};
  const auto put = [&](int at, double value) { words[std::size_t(at)] = std::bit_cast<std::uint32_t>(float(value)); };
  for (int axis = 0; axis < 3; axis++) {
    put(BLACK_BOX_DOMAIN + axis, surface.domain.lower[axis]);
    put(BLACK_BOX_DOMAIN + 3 + axis, surface.domain.upper[axis]);
  }
  put(BLACK_BOX_DOMAIN + 6, surface.domain.radius);
  put(BLACK_BOX_LEVEL, surface.options.level);
  put(BLACK_BOX_STEP, surface.options.step);
  put(BLACK_BOX_REACH, surface.options.lipschitz > 0 ? 1 / surface.options.lipschitz : 0);
  put(BLACK_BOX_EXTENT, largest_coordinate(surface.domain));
  const double grid = stencil_grid(surface);
  const auto on_grid = [&](double step) { return std::max(1.0, std::round(step / grid)) * grid; };
  put(BLACK_BOX_SNAP, 1.5 * std::ldexp(grid, 23));
  put(BLACK_BOX_FIRST, on_grid(surface.difference_step(1, 24)));
  put(BLACK_BOX_SECOND, on_grid(surface.difference_step(2, 24)));
  return words;
}

class ResidentBlackBox final : public ResidentSurface {
 public:
  ResidentBlackBox(const BlackBoxSurface& surface, Executor& executor)
      : source_(surface.function.source), order_(surface.options.difference_order) {
    modules_["surface"] = kernel_source("black_box/surface.inc");
    modules_["walk"] = kernel_source("walk/section.inc");
    modules_["section"] = kernel_source("black_box/section.inc");
    modules_["black_box"] = fmt::format("#line 1\n{}\n#line {}\n", source_, first_line_behind);
    defines_["DIFFERENCE_ORDER"] = fmt::format("{}", order_);
    compile(surface.function.name, executor);
    uniforms_ = TypedBuffer<std::uint32_t>(executor, BLACK_BOX_UNIFORM_WORDS, "surface uniforms");
    uniforms_.write(uniform_words(surface));
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override { return {{"uniforms", uniforms_.get()}}; }
  std::size_t bytes() const override { return uniforms_.bytes(); }

  bool update(const SurfaceDefinition& model) override {
    const auto* other = dynamic_cast<const BlackBoxSurface*>(&model);
    if (!other || other->function.source != source_ || other->options.difference_order != order_) return false;
    uniforms_.write(uniform_words(*other));
    return true;
  }

 private:
  // The first kernel that the user's source is part of: what the compiler says is said of the source.
  void compile(const std::string& name, Executor& executor) const {
    Program to_try = program(KernelId::measure);
    to_try.defines["COORDINATES"] = "0";
    to_try.defines["CURVATURE"] = "0";
    try {
      executor.prepare(to_try);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::device) throw;
      throw Error(
          ErrorCode::input,
          fmt::format("the source of the black box \"{}\" does not compile (lines are counted in it; those from "
                      "{} on follow it, and find fault with what it leaves open or does not define): {}",
                      name, first_line_behind, error.what()));
    }
  }

  const std::string source_;
  const int order_;
  std::map<std::string, std::string> modules_, defines_;
  TypedBuffer<std::uint32_t> uniforms_;
};

}  // namespace

std::unique_ptr<ResidentSurface> reside_black_box(const SurfaceDefinition& definition, Executor& executor,
                                                  const PrepareOptions&) {
  return std::make_unique<ResidentBlackBox>(dynamic_cast<const BlackBoxSurface&>(definition), executor);
}

}  // namespace smurf
