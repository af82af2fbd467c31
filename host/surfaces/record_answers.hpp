// A record of what was answered, to compare two builds of the library: with SMURF_ANSWERS=FILE every cast, probe and
// evaluation of properties adds a line to FILE that names the surface's kind, the device, the question, and hashes of
// what was asked and answered. tests/same-answers compares such files.
#pragma once

#include <memory>
#include <string>

#include "surfaces/queries.hpp"

namespace smurf {

// The interrogation itself, or one that also records its answers when SMURF_ANSWERS is set.
std::shared_ptr<SurfaceQueries> recorded(std::unique_ptr<SurfaceQueries> interrogation, const std::string& kind,
                                         const Device& device);

// Records the properties of points that were asked for outside of an interrogation; nothing when SMURF_ANSWERS is not
// set.
void record_properties(const std::string& kind, const Device& device, const PointSet& points, std::uint32_t wanted,
                       const PointProperties& answer);

}  // namespace smurf
