// The last stage of a batch: from the slots that a tile's hits wait in to the rows of a hit list
// (kernels/batch/order.inc).
//
// The device writes the rows where the host wants them, as far as it can; while it writes those of one tile, the search
// in the next one may be queued already.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "device/executor.hpp"
#include "smurf/error.hpp"
#include "surfaces/hit_columns.hpp"

namespace smurf {

// A stretch of rays, and where they stand in the ray buffer that kernels read.
struct Tile {
  std::size_t first = 0, count = 0;
  DeviceBuffer* rays = nullptr;
  std::size_t offset = 0, stride = 0;
  int image_width = 0;
};

// What kernels/batch/count.inc tells of a block of rays.
struct BlockSum {
  std::int32_t hits, most, invalid, cut, open;
};

// The hits of a tile on the device.
struct TileHits {
  DeviceBuffer *counts, *slots;
  int most;                          // hits of one ray
  std::span<const BlockSum> blocks;  // of `rays_in_block` rays each
  int rays_in_block;
};

// A tile's rows of one column, which kernels write where the host wants them, or to a buffer that is read afterwards.
template <class T>
class ColumnRows {
 public:
  // Lengthens `values` by `rows` that the device is to write, with room for `expected` values in all.
  ColumnRows(Executor& executor, TypedBuffer<T>& staged, Values<T>& values, std::size_t rows, std::size_t expected,
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

class RowWriter {
 public:
  RowWriter(Executor& executor, bool coordinates);
  ~RowWriter();

  // Appends the tile's hits, and its rays, to the list, in which there will be `ray_count` rays and about `expected`
  // hits a ray: they stand there after finish().
  void begin(const Tile& tile, const TileHits& found, std::size_t ray_count, double expected, HitList& hits);
  // Waits for the rows that were begun. Returns how many rays of the list are done; nothing where none were begun.
  // Throws Error (device) where the driver ended the loop that writes a ray's rows.
  std::optional<std::size_t> finish(HitList& hits);
  // Gives up what was begun, if anything was: the list is incomplete then.
  void abandon();

 private:
  struct Writing;
  static void require_rows(const Writing& writing, const HitList& hits);

  Executor& executor_;
  const bool has_coordinates_;  // hits have surface coordinates
  Program program_;
#define HIT_COLUMN(name, type, names, place) TypedBuffer<type> name##_;
#include "smurf/hit_columns.def"
  TypedBuffer<std::uint64_t> offsets_;
  TypedBuffer<RayStatus> ray_status_;
  std::unique_ptr<Writing> writing_;
};

// A ray that the driver left alone.
Error cut_ray(std::size_t ray);

}  // namespace smurf
