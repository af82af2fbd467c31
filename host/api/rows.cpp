#include "api/rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "kernels/layout/codes.inc"
#include "kernels/layout/slots.inc"
#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr double spare_rows = 1.05;  // how much more room there is than is expected to be needed
constexpr auto is_cut = RayStatus(RAY_STATUS_CUT);

}  // namespace

// The rows of a tile while the device writes them.
struct RowWriter::Writing {
  Tile tile;
  int most;  // hits of one ray
  std::vector<std::uint32_t> starts;
  std::unique_ptr<DeviceBuffer> block_offsets;
  ColumnRows<std::uint64_t> offsets;
  ColumnRows<RayStatus> ray_status;
#define HIT_COLUMN(name, type, names, place) std::optional<ColumnRows<type>> name = {};
#include "smurf/hit_columns.def"
};

RowWriter::RowWriter(Executor& executor, bool coordinates) : executor_(executor), has_coordinates_(coordinates) {
  program_ = {KernelId::order_rows, {}, {{"COORDINATES", coordinates ? "1" : "0"}}};
#define HIT_COLUMN(name, type, names, place) program_.groups["row"].push_back(#name);
#include "smurf/hit_columns.def"
}

RowWriter::~RowWriter() = default;

void RowWriter::begin(const Tile& tile, const TileHits& found, std::size_t ray_count, double expected, HitList& hits) {
  std::vector<std::uint32_t> starts(found.blocks.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < found.blocks.size(); i++) {
    starts[i] = std::uint32_t(count);
    count += std::size_t(found.blocks[i].hits);
  }
  const std::uint64_t before = hits.size();
  // The rest of the rays may have as many hits each as those so far, or as is expected: longer columns have to be
  // copied, while the device waits.
  const double so_far = double(before + count) / double(tile.first + tile.count);
  const auto room = std::size_t(spare_rows * std::max(so_far, expected) * double(ray_count));
  auto block_offsets =
      starts.empty() ? nullptr : executor_.share(starts.data(), starts.size() * sizeof starts[0], "block offsets");
  writing_ = std::make_unique<Writing>(
      Writing{tile, found.most, std::move(starts), std::move(block_offsets),
              ColumnRows(executor_, offsets_, HitColumns::offsets(hits), tile.count, ray_count + 1, "rays"),
              ColumnRows(executor_, ray_status_, HitColumns::ray_status(hits), tile.count, ray_count, "rays")});
  BufferGroup columns;
#define HIT_COLUMN(name, type, names, place)                                                     \
  if (HitColumns::has_rows(#name, has_coordinates_))                                             \
    writing_->name.emplace(executor_, name##_, HitColumns::name(hits), count, room, "hit rows"); \
  columns.push_back({#name, writing_->name ? writing_->name->buffer() : nullptr});
#include "smurf/hit_columns.def"
  launch(executor_, program_,
         arguments::order_rows{.rays = tile.rays,
                               .counts = found.counts,
                               .slots = found.slots,
                               .block_offsets = writing_->block_offsets.get(),
                               .row = columns,
                               .ray_offsets = writing_->offsets.buffer(),
                               .ray_status = writing_->ray_status.buffer(),
                               .first = int(tile.offset),
                               .number = int(tile.first),
                               .count = int(tile.count),
                               .stride = int(tile.stride),
                               .block = found.rays_in_block,
                               .before_low = std::int32_t(std::uint32_t(before)),
                               .before_high = std::int32_t(before >> 32)},
         tile.count);
}

std::optional<std::size_t> RowWriter::finish(HitList& hits) {
  if (!writing_) return std::nullopt;
  const auto writing = std::move(writing_);
  writing->offsets.finish();
  writing->ray_status.finish();
  require_rows(*writing, hits);
#define HIT_COLUMN(name, type, names, place) \
  if (writing->name) writing->name->finish();
#include "smurf/hit_columns.def"
  return writing->tile.first + writing->tile.count;
}

void RowWriter::abandon() { writing_.reset(); }

// Only long rows can suffer (kernels/batch/order.inc).
void RowWriter::require_rows(const Writing& writing, const HitList& hits) {
  if (writing.most <= ORDER_FEW) return;
  const auto begin = hits.ray_status().begin() + std::ptrdiff_t(writing.tile.first);
  const auto end = begin + std::ptrdiff_t(writing.tile.count);
  const auto found = std::find(begin, end, is_cut);
  if (found != end) throw cut_ray(writing.tile.first + std::size_t(found - begin));
}

Error cut_ray(std::size_t ray) {
  return Error(ErrorCode::device,
               fmt::format("the driver ended the loop of a kernel while ray {} was on its way (llvmpipe does so after "
                           "65,535 steps of a ray and its neighbours); use another device, or the reference",
                           ray));
}

}  // namespace smurf
