// Interrogation in batches on an executor: cast() below reads from top to bottom as the stages of a batch.
//
// Device memory is bounded by the tile: rays (32 bytes, none where the device reads the host's), slots
// (12 bytes × capacity), counts and rows. A ray with more hits than the capacity is never cut: the true count comes back, and
// the tile is cast again with room for it, in smaller tiles if need be.
#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "columns.inc"
#include "executor.hpp"
#include "interrogation.hpp"
#include "smurf/error.hpp"
#include "surfaces/surface_model.hpp"

namespace smurf {
namespace {

constexpr std::size_t rays_in_tile = 1 << 20;
constexpr std::size_t rays_in_image_tile = (1 << 21) - 1;  // what kernels/core/ray.inc can tell apart
constexpr std::size_t points_in_tile = 262144;
constexpr std::size_t slots_in_tile = 1 << 20;  // capacity × rays, at 12 bytes
constexpr int capacity_of_all = 8;              // hits per ray to begin with
constexpr int rays_in_block = 16;  // counted and ordered by one work item
constexpr int tile_rows = 4;  // rows of pixels that kernels take together

struct BlockSum {
  std::int32_t hits, most, invalid;
};

}  // namespace

class DeviceInterrogation final : public Interrogation {
 public:
  DeviceInterrogation(const Device& device, const std::shared_ptr<const SurfaceModel>& model)
      : device_(device), executor_(device_.executor()), surface_(model->reside(executor_)) {
    compile();
  }

  void cast(const RayBatch& rays, const CastOptions& options, HitList& hits) override {
    const bool first_only = options.hits == Hits::first;
    int capacity = first_only ? 1 : capacity_of_all;
    upload_shared(rays);
    hits.offsets_.resize(rays.size() + 1);
    hits.offsets_[0] = 0;
    hits.ray_status_.resize(rays.size());
    std::size_t first = 0;
    while (first < rays.size()) {
      Tile tile = next_tile(rays, first, options, capacity);
      upload_tile(rays, tile);
      find_hits(tile, capacity, first_only);
      const std::vector<BlockSum> blocks = sum_blocks(tile);
      if (options.bad_rays == BadRays::error) refuse_invalid(rays, blocks, tile);
      const int most =
          std::max_element(blocks.begin(), blocks.end(), [](auto& a, auto& b) { return a.most < b.most; })->most;
      if (most > capacity && !first_only) {
        capacity = int(std::bit_ceil(unsigned(most)));
        continue;
      }
      const std::size_t rows = order_rows(blocks, tile, capacity);
      collect(tile, rows, hits);
      if (options.properties != 0)
        measure_buffer(row_locations_.get(), nullptr, rows, options.properties, hits.properties_);
      first += tile.count;
      if (options.progress) options.progress(first, rays.size());
    }
    if (options.properties != 0) hits.properties_.measured |= options.properties;
    shared_rays_.reset();
  }

  void measure(std::span<const glm::vec3> points, std::span<const glm::vec3> directions, std::uint32_t wanted,
               const ProbeOptions& options, PointProperties& out) override {
    out.status.clear();
    reserve(out, wanted, points.size());
    const std::size_t tile = options.tile != 0 ? options.tile : points_in_tile;
    for (std::size_t first = 0; first < points.size(); first += tile) {
      const std::size_t count = std::min(tile, points.size() - first);
      ensure(points_, count, "points");
      points_.write(points.subspan(first, count));
      if (!directions.empty()) {
        ensure(directions_, count, "directions");
        directions_.write(directions.subspan(first, count));
      }
      measure_buffer(points_.get(), directions.empty() ? nullptr : directions_.get(), count, wanted, out);
      if (options.progress) options.progress(first + count, points.size());
    }
    out.measured |= wanted;
  }

  void update(const std::shared_ptr<const SurfaceModel>& model) override {
    if (!surface_->update(*model)) {
      surface_ = model->reside(executor_);
      compile();
    }
  }

  std::size_t device_bytes() const override { return surface_->bytes(); }

 private:
  // A stretch of rays, and where they stand in the ray buffer that kernels read.
  struct Tile {
    std::size_t first, count;
    DeviceBuffer* rays;
    std::size_t offset, stride;
    int image_width;
  };

  void compile() {
    const auto program = [&](KernelId kernel, const char* curvature) {
      Program p{kernel, surface_->modules(), surface_->defines()};
      p.defines["CURVATURE"] = curvature;
      executor_.prepare(p);
      return p;
    };
    find_hits_ = program(KernelId::find_hits, "0");
    measure_first_ = program(KernelId::measure, "0");
    measure_second_ = program(KernelId::measure, "1");
  }

  template <class T>
  void ensure(TypedBuffer<T>& buffer, std::size_t count, std::string_view purpose) {
    if (!buffer || buffer.bytes() < count * sizeof(T)) buffer = TypedBuffer<T>(executor_, count, purpose);
  }

  void upload_shared(const RayBatch& rays) {
    shared_rays_.reset();
    if (executor_.info().shares_host_memory && rays.size() > 0) {
      shared_rays_ = executor_.share(rays.data(), rays.size() * RayBatch::component_count * sizeof(float), "rays");
    }
  }

  Tile next_tile(const RayBatch& rays, std::size_t first, const CastOptions& options, int capacity) const {
    std::size_t most = options.tile != 0 ? options.tile : rays_in_tile;
    most = std::max<std::size_t>(std::min(most, slots_in_tile / std::size_t(capacity)), 1);
    const std::size_t band = rays.image_width * tile_rows;
    if (rays.image_width > 0) most = std::min(most, rays_in_image_tile);
    const bool image = rays.image_width >= 4 && rays.image_width % 4 == 0 && band <= most && first % band == 0;
    if (image) most -= most % band;
    std::size_t count = std::min(most, rays.size() - first);
    const bool whole_bands = image && count % band == 0;
    return {first, count, nullptr, 0, 0, whole_bands ? int(rays.image_width) : 0};
  }

  void upload_tile(const RayBatch& rays, Tile& tile) {
    if (shared_rays_) {
      tile.rays = shared_rays_.get();
      tile.offset = tile.first;
      tile.stride = rays.size();
      return;
    }
    ensure(tile_rays_, tile.count * RayBatch::component_count, "rays");
    for (int c = 0; c < RayBatch::component_count; c++) {
      tile_rays_.write(rays.component(RayBatch::Component(c)).subspan(tile.first, tile.count),
                       std::size_t(c) * tile.count);
    }
    tile.rays = tile_rays_.get();
    tile.offset = 0;
    tile.stride = tile.count;
  }

  void find_hits(const Tile& tile, int capacity, bool first_only) {
    ensure(counts_, tile.count, "hit counts");
    ensure(slots_, 3 * std::size_t(capacity) * tile.count, "hit slots");
    const std::vector<DeviceBuffer*> surface = surface_buffers();
    launch(executor_, find_hits_,
           arguments::find_hits{.parameters = surface_->parameters(),
                                .surface_a = surface[0],
                                .surface_b = surface[1],
                                .surface_c = surface[2],
                                .surface_d = surface[3],
                                .rays = tile.rays,
                                .counts = counts_.get(),
                                .slots = slots_.get(),
                                .first = int(tile.offset),
                                .count = int(tile.count),
                                .stride = int(tile.stride),
                                .image_width = tile.image_width,
                                .capacity = capacity,
                                .first_only = first_only},
           tile.count);
  }

  std::vector<BlockSum> sum_blocks(const Tile& tile) {
    std::vector<BlockSum> sums((tile.count + rays_in_block - 1) / rays_in_block);
    ensure(blocks_, sums.size(), "block sums");
    launch(executor_, Program{KernelId::count_blocks, {}, {}},
           arguments::count_blocks{
               .counts = counts_.get(), .blocks = blocks_.get(), .count = int(tile.count), .block = rays_in_block},
           sums.size());
    blocks_.read(sums);
    return sums;
  }

  void refuse_invalid(const RayBatch& rays, const std::vector<BlockSum>& blocks, const Tile& tile) const {
    for (const BlockSum& block : blocks) {
      if (block.invalid < 0) continue;
      const std::size_t index = tile.first + std::size_t(block.invalid);
      const Ray ray = rays[index];
      throw Error(ErrorCode::input, fmt::format("ray {} is not valid: origin ({}, {}, {}), direction ({}, {}, {}), t "
                                                "in [{}, {}]; numbers must be finite (t_max may be "
                                                "infinite), the direction not zero, t_min <= t_max",
                                                index, ray.origin.x, ray.origin.y, ray.origin.z, ray.direction.x,
                                                ray.direction.y, ray.direction.z, ray.t_min, ray.t_max));
    }
  }

  std::size_t order_rows(const std::vector<BlockSum>& blocks, const Tile& tile, int capacity) {
    std::vector<std::uint32_t> starts(blocks.size());
    std::size_t rows = 0;
    for (std::size_t i = 0; i < blocks.size(); i++) {
      starts[i] = std::uint32_t(rows);
      rows += std::size_t(blocks[i].hits);
    }
    if (rows == 0) return 0;
    ensure(starts_, starts.size(), "block offsets");
    starts_.write(starts);
    ensure(row_rays_, rows, "hit rows");
    ensure(row_t_, rows, "hit rows");
    ensure(row_uncertainty_, rows, "hit rows");
    ensure(row_status_, rows, "hit rows");
    ensure(row_locations_, rows, "hit rows");
    launch(executor_, Program{KernelId::order_rows, {}, {}},
           arguments::order_rows{.rays = tile.rays,
                                 .counts = counts_.get(),
                                 .slots = slots_.get(),
                                 .block_offsets = starts_.get(),
                                 .row_rays = row_rays_.get(),
                                 .row_t = row_t_.get(),
                                 .row_uncertainty = row_uncertainty_.get(),
                                 .row_status = row_status_.get(),
                                 .row_locations = row_locations_.get(),
                                 .first = int(tile.offset),
                                 .count = int(tile.count),
                                 .stride = int(tile.stride),
                                 .capacity = capacity,
                                 .block = rays_in_block},
           blocks.size());
    return rows;
  }

  // Appends the tile's rows to the hit list.
  void collect(const Tile& tile, std::size_t rows, HitList& hits) {
    // The rest of the rays may have as many hits each.
    const double expected =
        1.05 * double(hits.rays_.size() + rows) / double(tile.first + tile.count) * double(hits.ray_status_.size());
    const auto append = [&](const auto& buffer, auto& values) {
      using T = typename std::decay_t<decltype(values)>::value_type;
      const std::size_t before = values.size();
      if (values.capacity() < before + rows)
        values.reserve(std::max({before + rows, std::size_t(expected), before + before / 2}));
      values.resize(before + rows);
      buffer.read(std::span<T>(values).subspan(before));
    };
    if (rows > 0) {
      append(row_rays_, hits.rays_);
      append(row_t_, hits.t_);
      append(row_uncertainty_, hits.uncertainty_);
      append(row_status_, hits.status_);
      append(row_locations_, hits.locations_);
    }
    const std::size_t row = hits.rays_.size() - rows;
    for (std::size_t i = row; i < hits.rays_.size(); i++) hits.rays_[i] += std::uint32_t(tile.first);
    tile_counts_.resize(tile.count);
    counts_.read(tile_counts_);
    std::uint64_t offset = hits.offsets_[tile.first];
    for (std::size_t i = 0; i < tile.count; i++) {
      const std::int32_t count = tile_counts_[i];
      offset += std::uint64_t(std::max(count, 0));
      hits.offsets_[tile.first + i + 1] = offset;
      hits.ray_status_[tile.first + i] = count < 0 ? RayStatus::invalid : RayStatus::ok;
    }
  }

  static void reserve(PointProperties& out, std::uint32_t wanted, std::size_t count) {
    const auto room = [&](Property property, auto&... columns) {
      if (contains(wanted, property)) (columns.reserve(count), ...);
    };
    room(Property::value, out.value);
    room(Property::normal, out.normal);
    room(Property::gauss, out.gauss);
    room(Property::mean, out.mean);
    room(Property::principal, out.k1, out.k2);
    room(Property::directions, out.d1, out.d2);
    room(Property::normal_curvature, out.normal_curvature);
    out.status.reserve(count);
  }

  // Measures `count` points that stand on the device and appends the columns.
  void measure_buffer(DeviceBuffer* points, DeviceBuffer* directions, std::size_t count, std::uint32_t wanted,
                      PointProperties& out) {
    if (count == 0) return;
    const std::uint32_t second =
        Property::gauss | Property::mean | Property::principal | Property::directions | Property::normal_curvature;
    const std::vector<DeviceBuffer*> surface = surface_buffers();
    ensure(columns_, count * words_per_point(wanted), "properties");
    launch(executor_, (wanted & second) != 0 ? measure_second_ : measure_first_,
           arguments::measure{.parameters = surface_->parameters(),
                              .surface_a = surface[0],
                              .surface_b = surface[1],
                              .surface_c = surface[2],
                              .surface_d = surface[3],
                              .points = points,
                              .directions = directions,
                              .columns = columns_.get(),
                              .count = int(count),
                              .wanted = int(wanted)},
           count);
    std::size_t column = 0;
    const auto append = [&](auto& values) {
      using T = typename std::decay_t<decltype(values)>::value_type;
      const std::size_t before = values.size();
      if (values.capacity() < before + count) values.reserve(std::max(before + before / 2, before + count));
      values.resize(before + count);
      executor_.read(*columns_.get(), column * sizeof(float), values.data() + before, count * sizeof(T));
      column += count * sizeof(T) / sizeof(float);
    };
    if (contains(wanted, Property::value)) append(out.value);
    if (contains(wanted, Property::normal)) append(out.normal);
    if (contains(wanted, Property::gauss)) append(out.gauss);
    if (contains(wanted, Property::mean)) append(out.mean);
    if (contains(wanted, Property::principal)) append(out.k1), append(out.k2);
    if (contains(wanted, Property::directions)) append(out.d1), append(out.d2);
    if (contains(wanted, Property::normal_curvature)) append(out.normal_curvature);
    append(out.status);
  }

  static std::size_t words_per_point(std::uint32_t wanted) {
    std::size_t words = 1;
    if (contains(wanted, Property::value)) words += 1;
    if (contains(wanted, Property::normal)) words += 3;
    if (contains(wanted, Property::gauss)) words += 1;
    if (contains(wanted, Property::mean)) words += 1;
    if (contains(wanted, Property::principal)) words += 2;
    if (contains(wanted, Property::directions)) words += 6;
    if (contains(wanted, Property::normal_curvature)) words += 1;
    return words;
  }

  std::vector<DeviceBuffer*> surface_buffers() const {
    std::vector<DeviceBuffer*> buffers = surface_->buffers();
    buffers.resize(4, nullptr);
    return buffers;
  }

  Device device_;
  Executor& executor_;
  std::unique_ptr<ResidentSurface> surface_;
  Program find_hits_, measure_first_, measure_second_;

  std::unique_ptr<DeviceBuffer> shared_rays_;
  TypedBuffer<float> tile_rays_;
  TypedBuffer<std::int32_t> counts_;
  TypedBuffer<float> slots_;
  TypedBuffer<BlockSum> blocks_;
  TypedBuffer<std::uint32_t> starts_;
  TypedBuffer<std::uint32_t> row_rays_;
  TypedBuffer<float> row_t_, row_uncertainty_;
  TypedBuffer<HitStatus> row_status_;
  TypedBuffer<glm::vec3> row_locations_;
  TypedBuffer<glm::vec3> points_, directions_;
  TypedBuffer<float> columns_;
  std::vector<std::int32_t> tile_counts_;
};

std::unique_ptr<Interrogation> interrogate_on_device(const Device& device,
                                                     const std::shared_ptr<const SurfaceModel>& model) {
  return std::make_unique<DeviceInterrogation>(device, model);
}

}  // namespace smurf
