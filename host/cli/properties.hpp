// Properties by name, and their columns in result tables.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "io/result_table.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/surface.hpp"

namespace smurf {

// The properties named in a comma-separated list, in its order, each once; none for an empty list.
// Throws Error (usage) on an unknown name and on what this kind of surface cannot answer.
std::vector<Property> properties_named(std::string_view list, const Surface& surface);

std::uint32_t bits_of(const std::vector<Property>& properties);

// Adds the columns of the contract for these properties, in their order. The table shows `values` itself.
void add_properties(Table& table, const std::vector<Property>& properties, const Surface& surface,
                    const PointProperties& values);

// "regular", or the set bits joined by '+': "umbilic+boundary".
std::string_view point_status_text(std::uint32_t status);

}  // namespace smurf
