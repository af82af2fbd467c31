// Black boxes on a device: the user's source becomes a module of the kernels (kernels/black_box/surface.inc). Device
// memory: a few words.
#include "surfaces/black_box/definition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "kernels/black_box/layout.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr double samples_on_diagonal = 512, most_samples = 65536;
constexpr std::size_t longest_source = std::size_t(1) << 20;
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
    modules_["surface"] = embedded_core("black_box/surface.inc");
    modules_["black_box"] = fmt::format("#line 1\n{}\n#line {}\n", source_, first_line_behind);
    defines_["DIFFERENCE_ORDER"] = fmt::format("{}", order_);
    compile(surface.function.name, executor);
    uniforms_ = TypedBuffer<std::uint32_t>(executor, BLACK_BOX_UNIFORM_WORDS, "surface uniforms");
    uniforms_.write(uniform_words(surface));
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  DeviceBuffer* uniforms() const override { return uniforms_.get(); }
  std::vector<DeviceBuffer*> buffers() const override { return {}; }
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
    Program program{KernelId::measure, modules_, defines_};
    program.defines["COORDINATES"] = "0";
    program.defines["CURVATURE"] = "0";
    try {
      executor.prepare(program);
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

void require(bool fits, const std::string& message) {
  if (!fits) throw Error(ErrorCode::input, message);
}

void require_source(const BlackBox& function) {
  const std::string& source = function.source;
  const auto what = [&] { return fmt::format("the source of the black box \"{}\"", function.name); };
  require(source.find_first_not_of(" \t\r\n") != std::string::npos,
          what() + " is empty; it must define FN real black_box(real x, real y, real z)");
  require(source.size() <= longest_source,
          fmt::format("{} has {} bytes; at most {} are possible", what(), source.size(), longest_source));
  require(source.find('\0') == std::string::npos, what() + " holds a zero byte; it must be text");
  require(source.find("black_box") != std::string::npos,
          what() + " does not define the function black_box; it must define FN real black_box(real x, real y, real z)");
  for (std::size_t line = 0; line < source.size(); line = std::min(source.find('\n', line), source.size() - 1) + 1) {
    const std::size_t hash = source.find_first_not_of(" \t", line);
    if (hash == std::string::npos || source[hash] != '#') continue;
    const std::size_t word = source.find_first_not_of(" \t", hash + 1);
    require(word == std::string::npos || source.compare(word, 7, "include") != 0,
            what() + " has an #include; all words that it can use are there without one");
  }
}

BlackBoxOptions checked(BlackBoxOptions options, double diagonal) {
  const auto plain = [](double number) { return std::isfinite(number) && number >= 0; };
  require(std::isfinite(options.level), fmt::format("the level must be finite, not {}", options.level));
  require(diagonal > 0, "the domain of a black box must have an extent, it is a point");
  require(plain(options.step),
          fmt::format("the step along rays must be positive (0 for 1/{} of the domain's diagonal), not {}",
                      samples_on_diagonal, options.step));
  if (options.step == 0) options.step = diagonal / samples_on_diagonal;
  require(options.step >= diagonal / most_samples,
          fmt::format("the step along rays must be at least 1/{} of the domain's diagonal, {:g}, not {}", most_samples,
                      diagonal / most_samples, options.step));
  require(plain(options.lipschitz),
          fmt::format("the bound on the gradient must be positive (0 for none), not {}", options.lipschitz));
  const int order = options.difference_order;
  require(order == 2 || order == 4 || order == 6,
          fmt::format("the order of differences must be 2, 4 or 6, not {}", order));
  require(plain(options.difference_step) && options.difference_step <= diagonal,
          fmt::format("the step of differences must be positive (0 for one that is derived) and at most the domain's "
                      "diagonal, {:g}, not {}",
                      diagonal, options.difference_step));
  return options;
}

}  // namespace

BlackBoxSurface::BlackBoxSurface(const BlackBox& the_function, const Domain& the_domain,
                                 const BlackBoxOptions& the_options)
    : function(the_function),
      domain(require_domain(the_domain)),
      options(checked(the_options, glm::length(the_domain.upper - the_domain.lower))) {
  require_source(function);
}

double BlackBoxSurface::difference_step(int derivative, int bits) const {
  if (options.difference_step > 0) return options.difference_step;
  return diagonal() / 8 * std::exp2(-double(bits) / (options.difference_order + derivative));
}

std::uint32_t BlackBoxSurface::properties() const {
  return Property::value | Property::normal | Property::gauss | Property::mean | Property::principal |
         Property::directions | Property::normal_curvature;
}

std::vector<Fact> BlackBoxSurface::facts() const {
  std::vector<Fact> facts{{"field", "black box"},
                          {"source", fmt::format("{}, {} bytes", function.name, function.source.size())},
                          {"reference", function.value ? "given" : "none: only devices can answer"}};
  if (options.level != 0) facts.push_back({"level", fmt::format("{}", options.level)});
  facts.push_back({"step", fmt::format("{:g}", options.step)});
  facts.push_back({"gradient", options.lipschitz > 0
                                   ? fmt::format("at most {:g}, by the user's word", options.lipschitz)
                                   : "no bound is known"});
  facts.push_back({"proof", "none: roots between samples may be missed"});
  facts.push_back({"differences", fmt::format("order {}, steps {:g} (first), {:g} (second)", options.difference_order,
                                              difference_step(1, 24), difference_step(2, 24))});
  if (domain.radius > 0) facts.push_back({"ball", fmt::format("within {:g} of the origin", domain.radius)});
  return facts;
}

std::unique_ptr<ResidentSurface> BlackBoxSurface::reside(Executor& executor, const PrepareOptions&) const {
  return std::make_unique<ResidentBlackBox>(*this, executor);
}

Surface implicit(const BlackBox& function, const Domain& domain, const BlackBoxOptions& options) {
  return Surface(std::make_shared<const BlackBoxSurface>(function, domain, options));
}

}  // namespace smurf
