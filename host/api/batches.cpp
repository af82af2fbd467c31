// Interrogation in batches on an executor: cast() below reads from top to bottom as the stages of a batch.
//
// Device memory is bounded by the tile: rays (32 bytes, none where the device reads the host's), slots
// (12 or, with surface coordinates, 24 bytes × capacity), counts and rows. A ray with more hits than the capacity is
// never cut: the true count comes back, and the tile is cast again with room for it, in smaller tiles if need be.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <optional>
#include <stdexcept>

#include "api/properties.hpp"
#include "api/resolve_hits.hpp"
#include "api/rows.hpp"
#include "api/walk.hpp"
#include "device/executor.hpp"
#include "kernels/layout/codes.inc"
#include "kernels/layout/slots.inc"
#include "smurf/error.hpp"
#include "surfaces/hit_columns.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/queries.hpp"
#include "surfaces/resident_surface.hpp"

namespace smurf {
namespace {

constexpr std::size_t rays_in_tile = 1 << 20;
constexpr std::size_t rays_in_image_tile = (1 << 21) - 1;  // what kernels/common/ray.inc can tell apart
// Capacity × rays, at 12 or 24 bytes. Threads wait for the last one at the end of a tile, so that halves of this cost a
// quarter more time; larger ones gain little, and take long to be cleared once.
constexpr std::size_t slots_in_tile = 1 << 21;
constexpr int capacity_of_all = 8;          // hits per ray to begin with
constexpr int most_remembered = 64;         // hits per ray that the next batch is expected to have as well
constexpr std::size_t few_rows = 1 << 16;   // room that is not worth giving back
constexpr int room_of_open = 32;            // hits of an open ray to begin with
constexpr std::size_t most_room = 1 << 24;  // words of room for open rays
constexpr int tile_rows = 4;                // rows of pixels that kernels take together

int search_code(Hits hits) {
  switch (hits) {
    case Hits::all:
      return SEARCH_ALL;
    case Hits::first:
      return SEARCH_FIRST;
    case Hits::any:
      return SEARCH_ANY;
    case Hits::count:
      return SEARCH_COUNT;
  }
  throw std::logic_error("a cast that is asked for nothing");
}

}  // namespace

class DeviceQueries final : public SurfaceQueries {
 public:
  DeviceQueries(const Device& device, const std::shared_ptr<const SurfaceDefinition>& model,
                const PrepareOptions& options)
      : device_(device),
        executor_(device_.executor()),
        model_(model),
        rays_in_block_(block_of(executor_.info().lanes)),
        surface_(reside(*model, executor_, options)),
        coordinates_(model->has_coordinates()) {
    compile();
  }

  void cast(const RayBatch& rays, const CastOptions& options, HitList& hits) override {
    find(rays, options, hits);
    if (only_counts(options.hits)) return count_flagged_rays(*this, rays, options, hits);
    if (rays.size() > 0) rows_per_ray_ = double(hits.size()) / double(rays.size());
    give_back_spare(hits);
    FlaggedHitResolver::resolve(
        *model_, rays, options.hits,
        [&](const RayBatch& rest, HitList& found) { find(rest, {.hits = Hits::first, .tile = options.tile}, found); },
        hits);
    if (surface_->polishes()) polish(rays, hits);
    if (options.properties != 0)
      measure({hits.locations(), hits.coordinates(), {}}, options.properties, {}, HitColumns::properties(hits));
  }

  // Where this batch has far fewer hits than the last one had.
  static void give_back_spare(HitList& hits) {
    HitColumns::each(hits, true, [](auto& column, auto) {
      if (column.capacity() / 2 > column.size() + few_rows) column.shrink_to_fit();
    });
  }

  // The hits as the device sees them.
  void find(const RayBatch& rays, const CastOptions& options, HitList& hits) {
    const int wanted = search_code(options.hits);
    const bool first_only = wanted == SEARCH_FIRST || wanted == SEARCH_ANY, bare = only_counts(options.hits);
    int capacity = first_only ? 1 : capacity_of_all;
    if (!first_only && hits_seen_ > 0) capacity = int(std::bit_ceil(unsigned(std::min(hits_seen_, most_remembered))));
    upload_shared(rays);
    HitColumns::clear(hits);
    HitColumns::offsets(hits).reserve(bare ? 0 : rays.size() + 1);
    // While the rows of one tile are written, the search in the next one is already queued: threads that wait for the
    // host are idle.
    Tile tile{};
    const auto search = [&](std::size_t first) {
      tile = next_tile(rays, first, options, capacity);
      upload_tile(rays, tile);
      find_hits(tile, capacity, wanted);
      count_blocks(tile);
    };
    const auto take_rows = [&] {
      const auto done = rows_->finish(hits);
      if (done && options.progress) options.progress(*done, rays.size());
    };
    // What was begun writes to the list, and ends with it.
    struct EndRows {
      RowWriter& rows;
      ~EndRows() { rows.abandon(); }
    } const end_rows{*rows_};
    if (rays.size() > 0) search(0);
    while (tile.count > 0) {
      const std::vector<BlockSum> blocks = finish_open(tile, capacity, wanted, read_blocks(tile));
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
      if (bare) {
        take_counts(tile, capacity, hits);
        if (options.progress) options.progress(tile.first + tile.count, rays.size());
      } else {
        rows_->begin(tile, {counts_.get(), slots_.get(), most, blocks, rays_in_block_}, rays.size(), rows_per_ray_,
                     hits);
      }
      const std::size_t next = tile.first + tile.count;
      tile.count = 0;
      if (next < rays.size()) search(next);
    }
    take_rows();
    shared_rays_.reset();
  }

  void measure(const PointSet& points, std::uint32_t wanted, const ProbeOptions& options,
               PointProperties& out) override {
    properties_->measure(*surface_, points, wanted, options, out);
  }

  void walk(const WalkStart& start, const WalkOptions& options, const WalkSink& sink) override {
    walks_->walk(*surface_, model_->kind(), start, options, sink);
  }

  void update(const std::shared_ptr<const SurfaceDefinition>& model) override {
    model_ = model;
    hits_seen_ = 0;
    if (!surface_->update(*model)) {
      surface_ = reside(*model, executor_, {});
      coordinates_ = model->has_coordinates();
      compile();
    }
  }

  std::size_t device_bytes() const override { return surface_->bytes(); }

 private:
  // Rays that one work item counts. The host adds up the blocks while the device waits, and each work item that writes
  // rows adds up the rays before its own in their block, which takes little where it has many lanes.
  static int block_of(int lanes) { return lanes > 1 ? 8 * lanes : 16; }

  void compile() {
    const auto program = [&](KernelId kernel, const char* curvature) {
      Program p = surface_->program(kernel);
      p.defines["COORDINATES"] = coordinates_ ? "1" : "0";
      p.defines["CURVATURE"] = curvature;
      executor_.prepare(p);
      return p;
    };
    find_hits_ = program(KernelId::find_hits, "0");
    properties_.emplace(executor_, *surface_, coordinates_);
    walks_.emplace(executor_, *surface_, coordinates_);
    rows_.emplace(executor_, coordinates_);
    if (surface_->room_words() > 0) finish_hits_ = program(KernelId::finish_hits, "0");
    if (surface_->polishes()) polish_hits_ = program(KernelId::polish_hits, "0");
    count_blocks_ = {KernelId::count_blocks, {}, {}};
    count_flagged_ = {KernelId::count_flagged, {}, {{"COORDINATES", coordinates_ ? "1" : "0"}}};
    list_open_ = {KernelId::list_open, {}, {}};
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

  void find_hits(const Tile& tile, int capacity, int wanted) {
    ensure(counts_, tile.count, "hit counts");
    const std::size_t columns = SLOT_COLUMNS_OF(coordinates_ ? 1u : 0u);
    ensure(slots_, std::size_t(capacity) * SLOT_STRIDE(tile.count, columns), "hit slots");
    launch(executor_, find_hits_,
           arguments::find_hits{.surface = surface_->buffers(),
                                .rays = tile.rays,
                                .counts = counts_.get(),
                                .slots = slots_.get(),
                                .first = int(tile.offset),
                                .count = int(tile.count),
                                .stride = int(tile.stride),
                                .image_width = tile.image_width,
                                .capacity = capacity,
                                .wanted_hits = wanted},
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

  // Appends how many hits the tile's rays have, and how many of them are flagged.
  void take_counts(const Tile& tile, int capacity, HitList& hits) {
    auto &totals = HitColumns::counts(hits), &flagged = HitColumns::flagged(hits);
    auto& status = HitColumns::ray_status(hits);
    const std::size_t before = totals.size();
    totals.resize(before + tile.count);
    flagged.resize(before + tile.count, 0);
    status.resize(before + tile.count);
    if (surface_->flags_hits()) {
      ensure(flagged_, tile.count, "flagged hits");
      launch(executor_, count_flagged_,
             arguments::count_flagged{.counts = counts_.get(),
                                      .slots = slots_.get(),
                                      .flagged = flagged_.get(),
                                      .count = int(tile.count),
                                      .capacity = capacity},
             tile.count);
      flagged_.read(std::span(flagged).subspan(before));
    }
    std::vector<std::int32_t> counted(tile.count);
    counts_.read(counted);
    for (std::size_t i = 0; i < tile.count; i++) {
      totals[before + i] = std::uint32_t(std::max(counted[i], 0));
      status[before + i] = counted[i] == RAY_INVALID ? RayStatus::invalid : RayStatus::ok;
    }
  }

  // Finishes the rays that the search has left open, with as much room as they turn out to need; the sums of blocks as
  // they are then.
  std::vector<BlockSum> finish_open(const Tile& tile, int capacity, int wanted, std::vector<BlockSum> blocks) {
    for (int room_hits = room_of_open;; room_hits *= 4) {
      std::vector<std::uint32_t> starts(blocks.size());
      std::size_t open = 0;
      for (std::size_t i = 0; i < blocks.size(); i++) {
        starts[i] = std::uint32_t(open);
        open += std::size_t(blocks[i].open);
      }
      if (open == 0) return blocks;
      ensure(open_starts_, starts.size(), "block offsets");
      open_starts_.write(starts);
      ensure(open_rays_, open, "open rays");
      launch(executor_, list_open_,
             arguments::list_open{.counts = counts_.get(),
                                  .block_offsets = open_starts_.get(),
                                  .list = open_rays_.get(),
                                  .count = int(tile.count),
                                  .block = rays_in_block_},
             blocks.size());
      finish_listed(tile, capacity, wanted, open, room_hits);
      count_blocks(tile);
      blocks = read_blocks(tile);
    }
  }

  // As many at a time as there is room for.
  void finish_listed(const Tile& tile, int capacity, int wanted, std::size_t open, int room_hits) {
    const std::size_t words = std::size_t(surface_->room_words()) * std::size_t(room_hits);
    if (words == 0) throw std::logic_error("a kind without room for open rays has left some");
    if (words > most_room)
      throw Error(ErrorCode::memory,
                  fmt::format("a ray has more than {} hits that must be told apart: there is no room "
                              "for more",
                              room_hits / 4));
    const std::size_t together = std::min(open, std::max<std::size_t>(most_room / words, 1));
    ensure(room_, together * words, "room of open rays");
    for (std::size_t begin = 0; begin < open; begin += together) {
      const std::size_t end = std::min(open, begin + together);
      launch(executor_, finish_hits_,
             arguments::finish_hits{.surface = surface_->buffers(),
                                    .rays = tile.rays,
                                    .list = open_rays_.get(),
                                    .room = room_.get(),
                                    .counts = counts_.get(),
                                    .slots = slots_.get(),
                                    .first = int(tile.offset),
                                    .count = int(tile.count),
                                    .stride = int(tile.stride),
                                    .capacity = capacity,
                                    .begin = int(begin),
                                    .end = int(end),
                                    .room_words = surface_->room_words(),
                                    .room_hits = room_hits,
                                    .wanted_hits = wanted},
             end - begin);
    }
  }

  // Moves single roots to where they are more exactly.
  void polish(const RayBatch& rays, HitList& hits) {
    std::vector<std::size_t> rows;
    for (std::size_t h = 0; h < hits.size(); h++) {
      const HitStatus status = hits.status()[h];
      if (status == HitStatus::isolated || status == HitStatus::sampled) rows.push_back(h);
    }
    for (std::size_t first = 0; first < rows.size(); first += rays_in_tile)
      polish_rows(rays, std::span(rows).subspan(first, std::min(rays_in_tile, rows.size() - first)), hits);
  }

  void polish_rows(const RayBatch& rays, std::span<const std::size_t> rows, HitList& hits) {
    constexpr std::size_t place_columns = 4;
    const std::size_t count = rows.size();
    std::vector<float> of_rays(count * RayBatch::component_count), places(count * place_columns);
    const auto each = [&](auto&& visit) {
      for (std::size_t i = 0; i < count; i++) {
        HitRow row = HitColumns::row(hits, coordinates_, rows[i]);
        visit(i, row);
      }
    };
    each([&](std::size_t i, const HitRow& row) {
      for (std::size_t c = 0; c < std::size_t(RayBatch::component_count); c++)
        of_rays[c * count + i] = rays.component(RayBatch::Component(c))[row.rays];
      places[i] = row.t;
      places[count + i] = row.uncertainty;
      places[2 * count + i] = row.coordinates.u;
      places[3 * count + i] = row.coordinates.v;
    });
    TypedBuffer<float> ray_buffer(executor_, of_rays.size(), "rays of hits"),
        place_buffer(executor_, places.size(), "places of hits");
    ray_buffer.write(of_rays);
    place_buffer.write(places);
    launch(executor_, polish_hits_,
           arguments::polish_hits{.surface = surface_->buffers(),
                                  .rays = ray_buffer.get(),
                                  .places = place_buffer.get(),
                                  .count = int(count)},
           count);
    place_buffer.read(places);
    each([&](std::size_t i, HitRow& row) {
      row.t = places[i];
      row.uncertainty = places[count + i];
      row.coordinates.u = places[2 * count + i];
      row.coordinates.v = places[3 * count + i];
      const Ray ray = rays[row.rays];
      row.locations = glm::vec3(glm::dvec3(ray.origin) + double(row.t) * glm::dvec3(ray.direction));
      HitColumns::set(hits, coordinates_, rows[i], row);
    });
    sort_rows(rows, hits);
  }

  // Neighbours of which one has passed the other change places.
  void sort_rows(std::span<const std::size_t> rows, HitList& hits) const {
    for (const std::size_t moved : rows) {
      for (std::size_t h = moved; h > hits.offsets()[hits.rays()[moved]] && hits.t()[h] < hits.t()[h - 1]; h--) {
        const HitRow a = HitColumns::row(hits, coordinates_, h - 1), b = HitColumns::row(hits, coordinates_, h);
        HitColumns::set(hits, coordinates_, h - 1, b);
        HitColumns::set(hits, coordinates_, h, a);
      }
    }
  }

  // No hit is lost in silence.
  void require_whole(const std::vector<BlockSum>& blocks, const Tile& tile) const {
    for (const BlockSum& block : blocks) {
      if (block.cut < 0) continue;
      throw cut_ray(tile.first + std::size_t(block.cut));
    }
  }

  void refuse_invalid(const RayBatch& rays, const std::vector<BlockSum>& blocks, const Tile& tile) const {
    for (const BlockSum& block : blocks) {
      if (block.invalid < 0) continue;
      const std::size_t index = tile.first + std::size_t(block.invalid);
      const Ray ray = rays[index];
      throw Error(
          ErrorCode::input,
          fmt::format("ray {} is not valid: origin ({}, {}, {}), direction ({}, {}, {}), t in [{}, {}]; numbers "
                      "must be finite (t_max may be infinite), the direction not zero, t_min <= t_max{}",
                      index, ray.origin.x, ray.origin.y, ray.origin.z, ray.direction.x, ray.direction.y,
                      ray.direction.z, ray.t_min, ray.t_max, model_->ray_limits()));
    }
  }

  Device device_;
  Executor& executor_;
  std::shared_ptr<const SurfaceDefinition> model_;
  const int rays_in_block_;
  std::unique_ptr<ResidentSurface> surface_;
  bool coordinates_;         // hits have surface coordinates
  int hits_seen_ = 0;        // most hits of a ray in batches of all hits; 0 before the first
  double rows_per_ray_ = 0;  // of the last batch
  Program find_hits_, finish_hits_, polish_hits_, count_blocks_, count_flagged_, list_open_;
  std::optional<RowWriter> rows_;
  std::optional<PropertyMeasurement> properties_;
  std::optional<WalkSteps> walks_;

  std::unique_ptr<DeviceBuffer> shared_rays_;
  TypedBuffer<float> tile_rays_;
  TypedBuffer<std::int32_t> counts_;
  TypedBuffer<float> slots_;
  TypedBuffer<BlockSum> blocks_;
  TypedBuffer<std::uint32_t> open_starts_, open_rays_, room_, flagged_;
};

std::unique_ptr<SurfaceQueries> interrogate_on_device(const Device& device,
                                                      const std::shared_ptr<const SurfaceDefinition>& model,
                                                      const PrepareOptions& options) {
  return std::make_unique<DeviceQueries>(device, model, options);
}

}  // namespace smurf
