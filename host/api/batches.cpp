// Interrogation in batches on an executor: cast() below reads from top to bottom as the stages of a batch.
//
// Device memory is bounded by the tile: rays (32 bytes, none where the device reads the host's), slots
// (12 or, with surface coordinates, 24 bytes × capacity), counts and rows. A ray with more hits than the capacity is
// never cut: the true count comes back, and the tile is cast again with room for it, in smaller tiles if need be.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <optional>

#include "api/resolve_hits.hpp"
#include "device/executor.hpp"
#include "kernels/layout/slots.inc"
#include "smurf/error.hpp"
#include "surfaces/property_columns.hpp"
#include "surfaces/queries.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {
namespace {

constexpr std::size_t rays_in_tile = 1 << 20;
constexpr std::size_t rays_in_image_tile = (1 << 21) - 1;  // what kernels/common/ray.inc can tell apart
constexpr std::size_t points_in_tile = 1 << 20;
// Capacity × rays, at 12 or 24 bytes. Threads wait for the last one at the end of a tile, so that halves of this cost a
// quarter more time; larger ones gain little, and take long to be cleared once.
constexpr std::size_t slots_in_tile = 1 << 21;
constexpr int capacity_of_all = 8;         // hits per ray to begin with
constexpr int most_remembered = 64;        // hits per ray that the next batch is expected to have as well
constexpr double spare_rows = 1.05;        // how much more room there is than is expected to be needed
constexpr std::size_t few_rows = 1 << 16;  // room that is not worth giving back
constexpr int tile_rows = 4;               // rows of pixels that kernels take together

struct BlockSum {
  std::int32_t hits, most, invalid, cut;
};

// A tile's rows of one column of results, which kernels write where the host wants them, or to a buffer that is read
// afterwards.
template <class T>
class Rows {
 public:
  // Lengthens `values` by `rows` that the device is to write, with room for `expected` values in all.
  Rows(Executor& executor, TypedBuffer<T>& staged, Values<T>& values, std::size_t rows, std::size_t expected,
       std::string_view purpose)
      : staged_(staged), values_(values), rows_(rows) {
    const std::size_t before = values.size();
    if (values.capacity() < before + rows) values.reserve(std::max({before + rows, expected, before + before / 2}));
    values.resize(before + rows);
    direct_ = executor.share_results(values.data() + before, rows * sizeof(T), purpose);
    if (!direct_ && staged.bytes() < rows * sizeof(T)) staged = TypedBuffer<T>(executor, rows, purpose);
  }
  DeviceBuffer* buffer() const { return direct_ ? direct_.get() : staged_.get(); }
  // Waits until they stand in the values.
  void finish() {
    if (direct_) {
      direct_.reset();
    } else if (rows_ > 0) {
      staged_.read(std::span<T>(values_).last(rows_));
    }
  }

 private:
  TypedBuffer<T>& staged_;
  Values<T>& values_;
  std::size_t rows_;
  std::unique_ptr<DeviceBuffer> direct_;
};

}  // namespace

class DeviceQueries final : public SurfaceQueries {
 public:
  DeviceQueries(const Device& device, const std::shared_ptr<const SurfaceDefinition>& model,
                const PrepareOptions& options)
      : device_(device),
        executor_(device_.executor()),
        model_(model),
        rays_in_block_(block_of(executor_.info().lanes)),
        surface_(model->reside(executor_, options)),
        coordinates_(model->has_coordinates()) {
    compile();
  }

  void cast(const RayBatch& rays, const CastOptions& options, HitList& hits) override {
    find(rays, options, hits);
    if (rays.size() > 0) rows_per_ray_ = double(hits.size()) / double(rays.size());
    give_back_spare(hits);
    FlaggedHitResolver::resolve(
        *model_, rays, options.hits,
        [&](const RayBatch& rest, HitList& found) { find(rest, {.hits = Hits::first, .tile = options.tile}, found); },
        hits);
    if (options.properties != 0)
      measure({hits.locations_, hits.coordinates_, {}}, options.properties, {}, hits.properties_);
  }

  // Where this batch has far fewer hits than the last one had.
  static void give_back_spare(HitList& hits) {
    const auto shrink = [](auto& column) {
      if (column.capacity() / 2 > column.size() + few_rows) column.shrink_to_fit();
    };
    shrink(hits.rays_);
    shrink(hits.t_);
    shrink(hits.uncertainty_);
    shrink(hits.status_);
    shrink(hits.locations_);
    shrink(hits.coordinates_);
  }

  // The hits as the device sees them.
  void find(const RayBatch& rays, const CastOptions& options, HitList& hits) {
    const bool first_only = options.hits == Hits::first;
    int capacity = first_only ? 1 : capacity_of_all;
    if (!first_only && hits_seen_ > 0) capacity = int(std::bit_ceil(unsigned(std::min(hits_seen_, most_remembered))));
    upload_shared(rays);
    hits.offsets_.assign(1, 0);
    hits.offsets_.reserve(rays.size() + 1);
    // While the rows of one tile are written, the search in the next one is already queued: threads that wait for the
    // host are idle.
    std::optional<TileRows> writing;
    Tile tile{};
    const auto search = [&](std::size_t first) {
      tile = next_tile(rays, first, options, capacity);
      upload_tile(rays, tile);
      find_hits(tile, capacity, first_only);
      count_blocks(tile);
    };
    const auto take_rows = [&] {
      if (!writing) return;
      finish(*writing, hits);
      const std::size_t done = writing->tile.first + writing->tile.count;
      writing.reset();
      if (options.progress) options.progress(done, rays.size());
    };
    if (rays.size() > 0) search(0);
    while (tile.count > 0) {
      const std::vector<BlockSum> blocks = read_blocks(tile);
      take_rows();
      if (options.bad_rays == BadRays::error) refuse_invalid(rays, blocks, tile);
      require_whole(blocks, tile);
      const int most =
          std::max_element(blocks.begin(), blocks.end(), [](auto& a, auto& b) { return a.most < b.most; })->most;
      if (most > capacity && !first_only) {
        capacity = int(std::bit_ceil(unsigned(most)));
        search(tile.first);
        continue;
      }
      if (!first_only) hits_seen_ = std::max({hits_seen_, most, 1});
      order_rows(blocks, most, tile, rays.size(), hits, writing);
      const std::size_t next = tile.first + tile.count;
      tile.count = 0;
      if (next < rays.size()) search(next);
    }
    take_rows();
    shared_rays_.reset();
  }

  void measure(const PointSet& points, std::uint32_t wanted, const ProbeOptions& options,
               PointProperties& out) override {
    const std::size_t size = points.locations.size();
    surface_->prepare_properties();
    const auto words = std::make_shared<Values<std::uint32_t>>(size * words_per_point(wanted));
    const std::size_t step = options.tile != 0 ? options.tile : points_in_tile;
    // Kernels count words in 32 bits.
    std::unique_ptr<DeviceBuffer> results;
    if (!words->empty() && words->size() <= std::size_t(std::numeric_limits<std::int32_t>::max()))
      results = executor_.share_results(words->data(), words->size() * sizeof(std::uint32_t), "properties");
    std::unique_ptr<DeviceBuffer> locations, coordinates, directions;
    if (results) {
      locations = share(points.locations, "points");
      coordinates = share(points.coordinates, "surface coordinates");
      directions = share(points.directions, "directions");
    }
    const bool find = coordinates_ && points.coordinates.empty();
    if (find && results) ensure(point_coordinates_, size, "surface coordinates");
    Values<SurfaceCoordinates> found(find && contains(wanted, Property::parameters) ? size : 0);
    for (std::size_t first = 0; first < size; first += step) {
      const std::size_t count = std::min(step, size - first);
      if (results) {
        if (find) find_nearest(locations.get(), first, first + count);
        measure_points({locations.get(), find ? point_coordinates_.get() : coordinates.get(), directions.get()},
                       results.get(), first, first + count, size, wanted);
        if (options.progress) executor_.finish();
      } else {
        measure_copies({stretch(points.locations, first, count), stretch(points.coordinates, first, count),
                        stretch(points.directions, first, count)},
                       wanted, first, *words);
      }
      if (!found.empty()) point_coordinates_.read(std::span(found).subspan(first, count), results ? first : 0);
      if (options.progress) options.progress(first + count, size);
    }
    results.reset();
    take_columns(words, size, wanted, out);
    if (!found.empty()) out.coordinates = std::move(found);
  }

  void update(const std::shared_ptr<const SurfaceDefinition>& model) override {
    model_ = model;
    hits_seen_ = 0;
    if (!surface_->update(*model)) {
      surface_ = model->reside(executor_, {});
      coordinates_ = model->has_coordinates();
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

  // Rays that one work item counts. The host adds up the blocks while the device waits, and each work item that writes
  // rows adds up the rays before its own in their block, which takes little where it has many lanes.
  static int block_of(int lanes) { return lanes > 1 ? 8 * lanes : 16; }

  void compile() {
    const auto program = [&](KernelId kernel, const char* curvature) {
      Program p{kernel, surface_->modules(), surface_->defines()};
      p.defines["COORDINATES"] = coordinates_ ? "1" : "0";
      p.defines["CURVATURE"] = curvature;
      executor_.prepare(p);
      return p;
    };
    find_hits_ = program(KernelId::find_hits, "0");
    measure_first_ = program(KernelId::measure, "0");
    measure_second_ = program(KernelId::measure, "1");
    // Compiled when first launched: few ask for it.
    find_nearest_ = {KernelId::find_nearest, surface_->modules(), surface_->defines()};
    find_nearest_.defines["COORDINATES"] = "1";
    order_rows_ = {KernelId::order_rows, {}, {{"COORDINATES", coordinates_ ? "1" : "0"}}};
    count_blocks_ = {KernelId::count_blocks, {}, {}};
  }

  // A buffer on the host's values; none for none.
  template <class T>
  std::unique_ptr<DeviceBuffer> share(std::span<const T> values, std::string_view purpose) {
    return values.empty() ? nullptr : executor_.share(values.data(), values.size_bytes(), purpose);
  }

  template <class T>
  static std::span<const T> stretch(std::span<const T> values, std::size_t first, std::size_t count) {
    return values.empty() ? values : values.subspan(first, count);
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
    const std::size_t columns = coordinates_ ? 6 : 3;
    ensure(slots_, std::size_t(capacity) * SLOT_STRIDE(tile.count, columns), "hit slots");
    const std::vector<DeviceBuffer*> surface = surface_buffers();
    launch(executor_, find_hits_,
           arguments::find_hits{.uniforms = surface_->uniforms(),
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

  std::size_t blocks_of(const Tile& tile) const {
    return (tile.count + std::size_t(rays_in_block_) - 1) / std::size_t(rays_in_block_);
  }

  void count_blocks(const Tile& tile) {
    ensure(blocks_, blocks_of(tile), "block sums");
    launch(executor_, count_blocks_,
           arguments::count_blocks{
               .counts = counts_.get(), .blocks = blocks_.get(), .count = int(tile.count), .block = rays_in_block_},
           blocks_of(tile));
  }

  std::vector<BlockSum> read_blocks(const Tile& tile) const {
    std::vector<BlockSum> sums(blocks_of(tile));
    blocks_.read(sums);
    return sums;
  }

  // No hit is lost in silence.
  void require_whole(const std::vector<BlockSum>& blocks, const Tile& tile) const {
    for (const BlockSum& block : blocks) {
      if (block.cut < 0) continue;
      throw cut(tile.first + std::size_t(block.cut));
    }
  }

  // The same of rows, which only long ones can suffer (kernels/batch/order.inc).
  void require_rows(int most, const Tile& tile, const HitList& hits) const {
    constexpr int long_row = 12;
    constexpr auto is_cut = RayStatus(2);
    if (most <= long_row) return;
    const auto begin = hits.ray_status_.begin() + std::ptrdiff_t(tile.first);
    const auto found = std::find(begin, begin + std::ptrdiff_t(tile.count), is_cut);
    if (found != begin + std::ptrdiff_t(tile.count)) throw cut(tile.first + std::size_t(found - begin));
  }

  static Error cut(std::size_t ray) {
    return Error(
        ErrorCode::device,
        fmt::format("the driver ended the loop of a kernel while ray {} was on its way (llvmpipe does so after "
                    "65,535 steps of a ray and its neighbours); use another device, or the reference",
                    ray));
  }

  void refuse_invalid(const RayBatch& rays, const std::vector<BlockSum>& blocks, const Tile& tile) const {
    for (const BlockSum& block : blocks) {
      if (block.invalid < 0) continue;
      const std::size_t index = tile.first + std::size_t(block.invalid);
      const Ray ray = rays[index];
      throw Error(ErrorCode::input,
                  fmt::format("ray {} is not valid: origin ({}, {}, {}), direction ({}, {}, {}), t "
                              "in [{}, {}]; numbers must be finite (t_max may be "
                              "infinite), the direction not zero, t_min <= t_max, the origin not 5e11 times as "
                              "far out as a mesh",
                              index, ray.origin.x, ray.origin.y, ray.origin.z, ray.direction.x, ray.direction.y,
                              ray.direction.z, ray.t_min, ray.t_max));
    }
  }

  // The rows of a tile while the device writes them.
  struct TileRows {
    Tile tile;
    int most;  // hits of one ray
    std::vector<std::uint32_t> starts;
    std::unique_ptr<DeviceBuffer> block_offsets;
    Rows<std::uint64_t> offsets;
    Rows<RayStatus> ray_status;
    Rows<std::uint32_t> rays;
    Rows<float> t, uncertainty;
    Rows<HitStatus> status;
    Rows<glm::vec3> locations;
    std::optional<Rows<SurfaceCoordinates>> coordinates;
  };

  // Appends the tile's hits, and its rays, to the list, in which there will be `ray_count` rays: they stand there after
  // finish().
  void order_rows(const std::vector<BlockSum>& blocks, int most, const Tile& tile, std::size_t ray_count, HitList& hits,
                  std::optional<TileRows>& rows) {
    std::vector<std::uint32_t> starts(blocks.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < blocks.size(); i++) {
      starts[i] = std::uint32_t(count);
      count += std::size_t(blocks[i].hits);
    }
    const std::uint64_t before = hits.rays_.size();
    // The rest of the rays may have as many hits each as those so far, or as those of the last batch: longer columns
    // have to be copied, while the device waits.
    const double so_far = double(hits.rays_.size() + count) / double(tile.first + tile.count);
    const auto expected = std::size_t(spare_rows * std::max(so_far, rows_per_ray_) * double(ray_count));
    auto block_offsets = share(std::span<const std::uint32_t>(starts), "block offsets");
    rows.emplace(TileRows{tile, most, std::move(starts), std::move(block_offsets),
                          Rows(executor_, ray_offsets_, hits.offsets_, tile.count, ray_count + 1, "rays"),
                          Rows(executor_, ray_status_, hits.ray_status_, tile.count, ray_count, "rays"),
                          Rows(executor_, row_rays_, hits.rays_, count, expected, "hit rows"),
                          Rows(executor_, row_t_, hits.t_, count, expected, "hit rows"),
                          Rows(executor_, row_uncertainty_, hits.uncertainty_, count, expected, "hit rows"),
                          Rows(executor_, row_status_, hits.status_, count, expected, "hit rows"),
                          Rows(executor_, row_locations_, hits.locations_, count, expected, "hit rows"), std::nullopt});
    if (coordinates_)
      rows->coordinates.emplace(executor_, row_coordinates_, hits.coordinates_, count, expected, "hit rows");
    launch(executor_, order_rows_,
           arguments::order_rows{.rays = tile.rays,
                                 .counts = counts_.get(),
                                 .slots = slots_.get(),
                                 .block_offsets = rows->block_offsets.get(),
                                 .row_rays = rows->rays.buffer(),
                                 .row_t = rows->t.buffer(),
                                 .row_uncertainty = rows->uncertainty.buffer(),
                                 .row_status = rows->status.buffer(),
                                 .row_locations = rows->locations.buffer(),
                                 .row_coordinates = rows->coordinates ? rows->coordinates->buffer() : nullptr,
                                 .ray_offsets = rows->offsets.buffer(),
                                 .ray_status = rows->ray_status.buffer(),
                                 .first = int(tile.offset),
                                 .number = int(tile.first),
                                 .count = int(tile.count),
                                 .stride = int(tile.stride),
                                 .block = rays_in_block_,
                                 .before_low = std::int32_t(std::uint32_t(before)),
                                 .before_high = std::int32_t(before >> 32)},
           tile.count);
  }

  // Waits for the rows of a tile.
  void finish(TileRows& rows, const HitList& hits) const {
    rows.offsets.finish();
    rows.ray_status.finish();
    require_rows(rows.most, rows.tile, hits);
    rows.rays.finish();
    rows.t.finish();
    rows.uncertainty.finish();
    rows.status.finish();
    rows.locations.finish();
    if (rows.coordinates) rows.coordinates->finish();
  }

  struct PointBuffers {
    DeviceBuffer *locations, *coordinates, *directions;
  };

  void measure_points(const PointBuffers& points, DeviceBuffer* columns, std::size_t first, std::size_t end,
                      std::size_t stride, std::uint32_t wanted) {
    const std::uint32_t second =
        Property::gauss | Property::mean | Property::principal | Property::directions | Property::normal_curvature;
    const std::vector<DeviceBuffer*> surface = surface_buffers();
    launch(executor_, (wanted & second) != 0 ? measure_second_ : measure_first_,
           arguments::measure{.uniforms = surface_->uniforms(),
                              .surface_a = surface[0],
                              .surface_b = surface[1],
                              .surface_c = surface[2],
                              .surface_d = surface[3],
                              .points = points.locations,
                              .coordinates = points.coordinates,
                              .directions = points.directions,
                              .columns = columns,
                              .first = int(first),
                              .end = int(end),
                              .stride = int(stride),
                              .wanted = int(wanted)},
           end - first);
  }

  // Surface coordinates of the nearest points, in point_coordinates_.
  void find_nearest(DeviceBuffer* locations, std::size_t first, std::size_t end) {
    const std::vector<DeviceBuffer*> surface = surface_buffers();
    launch(executor_, find_nearest_,
           arguments::find_nearest{.uniforms = surface_->uniforms(),
                                   .surface_a = surface[0],
                                   .surface_b = surface[1],
                                   .surface_c = surface[2],
                                   .surface_d = surface[3],
                                   .points = locations,
                                   .coordinates = point_coordinates_.get(),
                                   .first = int(first),
                                   .end = int(end)},
           end - first);
  }

  // The values on the device, in `buffer`; null for none.
  template <class T>
  DeviceBuffer* copy(std::span<const T> values, TypedBuffer<T>& buffer, std::string_view purpose) {
    if (values.empty()) return nullptr;
    ensure(buffer, values.size(), purpose);
    buffer.write(values);
    return buffer.get();
  }

  // Measures points that are copied to the device, and copies their columns back to where they belong in `words`.
  void measure_copies(const PointSet& points, std::uint32_t wanted, std::size_t first, Values<std::uint32_t>& words) {
    const std::size_t count = points.locations.size(), width = words_per_point(wanted), total = words.size() / width;
    PointBuffers buffers{copy(points.locations, points_, "points"),
                         copy(points.coordinates, point_coordinates_, "surface coordinates"),
                         copy(points.directions, directions_, "directions")};
    if (coordinates_ && points.coordinates.empty()) {
      ensure(point_coordinates_, count, "surface coordinates");
      find_nearest(buffers.locations, 0, count);
      buffers.coordinates = point_coordinates_.get();
    }
    ensure(columns_, count * width, "properties");
    measure_points(buffers, columns_.get(), 0, count, count, wanted);
    std::size_t column = 0;
    for (const std::size_t column_width : column_widths(wanted)) {
      columns_.read(std::span(words).subspan(column * total + first * column_width, count * column_width),
                    column * count);
      column += column_width;
    }
  }

  std::vector<DeviceBuffer*> surface_buffers() const {
    std::vector<DeviceBuffer*> buffers = surface_->buffers();
    buffers.resize(4, nullptr);
    return buffers;
  }

  Device device_;
  Executor& executor_;
  std::shared_ptr<const SurfaceDefinition> model_;
  const int rays_in_block_;
  std::unique_ptr<ResidentSurface> surface_;
  bool coordinates_;         // hits have surface coordinates
  int hits_seen_ = 0;        // most hits of a ray in batches of all hits; 0 before the first
  double rows_per_ray_ = 0;  // of the last batch
  Program find_hits_, find_nearest_, measure_first_, measure_second_, order_rows_, count_blocks_;

  std::unique_ptr<DeviceBuffer> shared_rays_;
  TypedBuffer<float> tile_rays_;
  TypedBuffer<std::int32_t> counts_;
  TypedBuffer<float> slots_;
  TypedBuffer<BlockSum> blocks_;
  TypedBuffer<std::uint32_t> row_rays_;
  TypedBuffer<float> row_t_, row_uncertainty_;
  TypedBuffer<HitStatus> row_status_;
  TypedBuffer<std::uint64_t> ray_offsets_;
  TypedBuffer<RayStatus> ray_status_;
  TypedBuffer<glm::vec3> row_locations_;
  TypedBuffer<SurfaceCoordinates> row_coordinates_, point_coordinates_;
  TypedBuffer<glm::vec3> points_, directions_;
  TypedBuffer<std::uint32_t> columns_;
};

std::unique_ptr<SurfaceQueries> interrogate_on_device(const Device& device,
                                                      const std::shared_ptr<const SurfaceDefinition>& model,
                                                      const PrepareOptions& options) {
  return std::make_unique<DeviceQueries>(device, model, options);
}

}  // namespace smurf
