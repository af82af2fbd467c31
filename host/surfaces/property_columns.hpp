// Properties as kernels write them (kernels/layout/codes.inc), handed out as columns of results.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "smurf/interrogator.hpp"
#include "smurf/values.hpp"

namespace smurf {

// Words per point of each column.
std::vector<std::size_t> column_widths(std::uint32_t wanted);
std::size_t words_per_point(std::uint32_t wanted);

// Adds the columns in `words`, each `count` points long.
void take_columns(const std::shared_ptr<Values<std::uint32_t>>& words, std::size_t count, std::uint32_t wanted,
                  PointProperties& out);

}  // namespace smurf
