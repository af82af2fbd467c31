// Isosurfaces of sampled volumes on a device: samples or B-spline coefficients, bounds per block of 4³
// cells, a bit per cell that can hold a root, and for every cell its distance to the nearest such cell.
//
// Device memory for n³ samples of b bytes: b·n³ (4·(n+2)³ for tricubic, and as much again while it is set up), and for
// each block of 64 cells 8 bytes of bounds and what active_cells.hpp says.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "kernels/grid/layout.inc"
#include "smurf/error.hpp"
#include "surfaces/grid/active_cells.hpp"
#include "surfaces/grid/definition.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/resident_surface.hpp"

namespace smurf {
namespace {

// Sample types that kernels read as they are; all others become float on the device.
bool native_on_device(SampleType type) {
  switch (type) {
    case SampleType::uint8:
    case SampleType::int8:
    case SampleType::uint16:
    case SampleType::int16:
    case SampleType::float32:
      return true;
    default:
      return false;
  }
}

// Writes the volume as floats less `offset`, slab by slab; samples that are not finite become `fill` if there is one.
void write_as_floats(const Volume& volume, Executor& executor, DeviceBuffer& buffer, float offset,
                     std::optional<float> fill) {
  const std::size_t slab = std::size_t(1) << 20;
  std::vector<float> values(std::min(slab, volume.count()));
  for (std::size_t first = 0; first < volume.count(); first += slab) {
    const std::size_t count = std::min(slab, volume.count() - first);
    for (std::size_t i = 0; i < count; i++) {
      const float value = static_cast<float>(volume.at(first + i));
      values[i] = (fill && !std::isfinite(value) ? *fill : value) - offset;
    }
    executor.write(buffer, first * sizeof(float), values.data(), count * sizeof(float));
  }
}

// Puts NaN where samples are not finite, so that every cell that reads them is known to have no surface.
void restore_non_finite(const Volume& volume, Executor& executor, DeviceBuffer& buffer) {
  const std::size_t slab = std::size_t(1) << 20;
  std::vector<float> values(std::min(slab, volume.count()));
  for (std::size_t first = 0; first < volume.count(); first += slab) {
    const std::size_t count = std::min(slab, volume.count() - first);
    executor.read(buffer, first * sizeof(float), values.data(), count * sizeof(float));
    for (std::size_t i = 0; i < count; i++) {
      if (!std::isfinite(static_cast<float>(volume.at(first + i)))) values[i] = std::numeric_limits<float>::quiet_NaN();
    }
    executor.write(buffer, first * sizeof(float), values.data(), count * sizeof(float));
  }
}

// A volume of one sample along an axis has no cells. On the device it gets a second, equal layer there, while its
// domain stays flat: rays within it are answered as on any other.
Volume thickened(const Volume& volume) {
  const glm::ivec3 size = volume.size(), thick = glm::max(size, glm::ivec3(2));
  if (thick == size) return volume;
  const std::size_t bytes = size_of(volume.type());
  const auto copy = std::make_shared<std::vector<std::byte>>(std::size_t(thick.x) * std::size_t(thick.y) *
                                                             std::size_t(thick.z) * bytes);
  const auto* from = static_cast<const std::byte*>(volume.samples());
  std::byte* to = copy->data();
  for (int z = 0; z < thick.z; z++) {
    for (int y = 0; y < thick.y; y++) {
      for (int x = 0; x < thick.x; x++, to += bytes) {
        const glm::ivec3 at = glm::min(glm::ivec3(x, y, z), size - 1);
        std::memcpy(to,
                    from + ((std::size_t(at.z) * std::size_t(size.y) + std::size_t(at.y)) * std::size_t(size.x) +
                            std::size_t(at.x)) *
                               bytes,
                    bytes);
      }
    }
  }
  return Volume(std::shared_ptr<const void>(copy, copy->data()), volume.type(), thick, volume.placement());
}

class ResidentGridIsosurface final : public ResidentSurface {
 public:
  ResidentGridIsosurface(const GridIsosurface& surface, Executor& executor)
      : executor_(executor),
        original_(surface.volume),
        volume_(thickened(original_)),
        reconstruction_(surface.reconstruction) {
    choose_modules();
    upload_uniforms();
    upload_samples();
    bound_blocks();
    activate(surface.isovalue);
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override {
    return {{"uniforms", uniforms_.get()}, {"samples", samples_.get()}, {"distances", cells_->distances()}};
  }
  std::size_t bytes() const override {
    return samples_->bytes() + bounds_.bytes() + cells_->bytes() + uniforms_.bytes();
  }

  bool update(const SurfaceDefinition& model) override {
    const auto* other = dynamic_cast<const GridIsosurface*>(&model);
    if (!other || other->reconstruction != reconstruction_) return false;
    const Volume& volume = other->volume;
    if (volume.samples() != original_.samples() || volume.size() != original_.size() ||
        volume.type() != original_.type())
      return false;
    if (volume.placement().axes != original_.placement().axes ||
        volume.placement().origin != original_.placement().origin)
      return false;
    activate(other->isovalue);
    return true;
  }

 private:
  void choose_modules() {
    const bool cubic = reconstruction_ != Reconstruction::trilinear;
    const bool native = native_on_device(volume_.type()) && reconstruction_ != Reconstruction::tricubic;
    modules_["surface"] = kernel_source("grid/surface.inc");
    modules_["walk"] = kernel_source("walk/section.inc");
    modules_["section"] = kernel_source("grid/section.inc");
    modules_["cells"] = kernel_source("grid/cells.inc");
    modules_["field"] = kernel_source(cubic ? "grid/cubic.inc" : "grid/trilinear.inc");
    if (cubic)
      modules_["weights"] = kernel_source(reconstruction_ == Reconstruction::tricubic ? "grid/weights_bspline.inc"
                                                                                      : "grid/weights_catmull_rom.inc");
    modules_["samples"] =
        kernel_source(fmt::format("grid/samples_{}.inc", name_of(native ? volume_.type() : SampleType::float32)));
    defines_["DEGREE"] = cubic ? "9" : "3";
    // A buffer of our own has room for a margin; the host's samples are read where they are.
    defines_["PADDED"] = reconstruction_ == Reconstruction::tricubic ? "1" : "0";
    const glm::dmat3& axes = volume_.placement().axes;
    const bool aligned =
        axes == glm::dmat3(glm::dvec3(axes[0].x, 0, 0), glm::dvec3(0, axes[1].y, 0), glm::dvec3(0, 0, axes[2].z));
    ActiveCells::define_traversal(defines_, volume_.size() - 1, aligned);
  }

  void upload_uniforms() {
    std::array<std::uint32_t, GRID_UNIFORM_WORDS> words{};
    const auto put_integer = [&](int at, int value) { words[std::size_t(at)] = std::uint32_t(value); };
    const auto put_real = [&](int at, float value) { std::memcpy(&words[std::size_t(at)], &value, sizeof value); };
    const auto put_double = [&](int high_at, int low_at, double value) {
      const float high = float(value);
      put_real(high_at, high);
      put_real(low_at, float(value - double(high)));
    };
    const glm::ivec3 blocks = ActiveCells::blocks_of(volume_.size() - 1);
    put_integer(GRID_BLOCKS, blocks.x);
    put_integer(GRID_BLOCKS + 1, blocks.y);
    const glm::dmat3 world_to_index = glm::inverse(volume_.placement().axes);
    for (int i = 0; i < 3; i++) {
      put_integer(GRID_SIZE + i, volume_.size()[i]);
      put_real(GRID_EXTENT + i, float(original_.size()[i] - 1));
      put_double(GRID_ORIGIN_HIGH + i, GRID_ORIGIN_LOW + i, volume_.placement().origin[i]);
      for (int j = 0; j < 3; j++) {
        put_double(GRID_MATRIX_HIGH + 3 * i + j, GRID_MATRIX_LOW + 3 * i + j, world_to_index[j][i]);
      }
    }
    uniforms_ = TypedBuffer<std::uint32_t>(executor_, words.size(), "surface uniforms");
    uniforms_.write(words);
  }

  void upload_samples() {
    const glm::ivec3 size = volume_.size();
    if (reconstruction_ != Reconstruction::tricubic) {
      if (native_on_device(volume_.type())) {
        samples_ = executor_.share(volume_.samples(), volume_.bytes(), "volume samples");
      } else {
        samples_ = executor_.allocate(volume_.count() * sizeof(float), "volume samples as float");
        write_as_floats(volume_, executor_, *samples_, 0.0f, std::nullopt);
      }
      return;
    }
    // A filter of samples far from 0 would round to their size, not to their differences.
    offset_ = float(0.5 * (volume_.minimum() + volume_.maximum()));
    executor_.write(*uniforms_.get(), GRID_OFFSET * 4, &offset_, sizeof offset_);
    const auto coefficients = executor_.allocate(volume_.count() * sizeof(float), "B-spline coefficients");
    write_as_floats(volume_, executor_, *coefficients, offset_, 0.0f);
    prefilter(*coefficients);
    if (volume_.non_finite() > 0) restore_non_finite(volume_, executor_, *coefficients);
    const glm::ivec3 padded = size + 2;
    const std::size_t count = std::size_t(padded.x) * std::size_t(padded.y) * std::size_t(padded.z);
    if (count > std::size_t(std::numeric_limits<std::int32_t>::max()))
      throw Error(ErrorCode::memory, fmt::format("{} x {} x {} B-spline coefficients are more than a kernel can count; "
                                                 "at most 2^31-1 are possible, margin included",
                                                 padded.x, padded.y, padded.z));
    samples_ = executor_.allocate(count * sizeof(float), "B-spline coefficients with a margin");
    launch(executor_, Program{KernelId::grid_pad, modules_, defines_},
           arguments::grid_pad{
               .uniforms = uniforms_.get(), .from = coefficients.get(), .to = samples_.get(), .count = int(count)},
           count);
    executor_.finish();
  }

  void prefilter(DeviceBuffer& coefficients) {
    const glm::ivec3 size = volume_.size();
    const auto low_parts = executor_.allocate(coefficients.bytes(), "low parts of B-spline coefficients");
    clear(*low_parts);
    for (int axis = 0; axis < 3; axis++) {
      launch(executor_, Program{KernelId::bspline_prefilter, {}, {}},
             arguments::bspline_prefilter{.coefficients = &coefficients,
                                          .low_parts = low_parts.get(),
                                          .size_x = size.x,
                                          .size_y = size.y,
                                          .size_z = size.z,
                                          .axis = axis},
             volume_.count() / std::size_t(size[axis]));
    }
    executor_.finish();
  }

  void clear(DeviceBuffer& buffer) {
    const std::vector<float> zeros(std::min<std::size_t>(buffer.bytes() / sizeof(float), std::size_t(1) << 20), 0.0f);
    for (std::size_t first = 0; first < buffer.bytes(); first += zeros.size() * sizeof(float)) {
      executor_.write(buffer, first, zeros.data(), std::min(zeros.size() * sizeof(float), buffer.bytes() - first));
    }
  }

  void activate(double isovalue) {
    const float value = float(isovalue - double(offset_));
    executor_.write(*uniforms_.get(), GRID_ISOVALUE * 4, &value, sizeof value);
    const std::vector<glm::uvec2> none(cells_->block_count(), glm::uvec2(0));
    // Rays are clipped to the box of active cells, which ends with the domain.
    cells_->activate(std::isfinite(value) ? cells_->find() : none, glm::vec3(original_.size() - 1));
  }

  void bound_blocks() {
    const glm::ivec3 cells = volume_.size() - 1;
    const glm::ivec3 blocks = ActiveCells::blocks_of(cells);
    const std::size_t count = std::size_t(blocks.x) * std::size_t(blocks.y) * std::size_t(blocks.z);
    bounds_ = TypedBuffer<glm::vec2>(executor_, count, "block bounds");
    launch(executor_, Program{KernelId::grid_bounds, modules_, defines_},
           arguments::grid_bounds{
               .uniforms = uniforms_.get(), .samples = samples_.get(), .bounds = bounds_.get(), .count = int(count)},
           count);
    cells_ = std::make_unique<ActiveCells>(executor_, cells, modules_, defines_, *uniforms_.get(), *samples_,
                                           *bounds_.get());
  }

  Executor& executor_;
  const Volume original_;
  const Volume volume_;  // with at least two samples along each axis
  const Reconstruction reconstruction_;
  float offset_ = 0;  // taken off the samples on the device
  std::map<std::string, std::string> modules_, defines_;
  std::unique_ptr<DeviceBuffer> samples_;
  TypedBuffer<std::uint32_t> uniforms_;
  TypedBuffer<glm::vec2> bounds_;  // the least and greatest value in each block of cells
  std::unique_ptr<ActiveCells> cells_;
};

}  // namespace

std::unique_ptr<ResidentSurface> reside_grid(const SurfaceDefinition& definition, Executor& executor,
                                             const PrepareOptions&) {
  return std::make_unique<ResidentGridIsosurface>(dynamic_cast<const GridIsosurface&>(definition), executor);
}

}  // namespace smurf
