// NRRD files: a header, and samples of one component or of several on a three-dimensional grid.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "smurf/volume.hpp"

namespace smurf {

struct NrrdFile {
  SampleType type = SampleType::uint8;
  std::size_t components = 1;              // along the first axis of four
  bool components_have_direction = false;  // in space: the first axis is no list of components
  glm::ivec3 size{0};
  GridPlacement placement;
  std::optional<glm::dmat3> measurement_frame;  // from components to world axes
  // components * size.x * size.y * size.z samples, components fastest. At most once.
  std::function<std::shared_ptr<const void>()> read;
};

// The header. Throws Error (input), one line that names the file; `read` does so, too.
NrrdFile read_nrrd(const std::filesystem::path& file);

}  // namespace smurf
