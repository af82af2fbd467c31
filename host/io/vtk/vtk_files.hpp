// Fields and volumes from VTK's files: .vti, .vtr, .vts, and legacy .vtk with structured points, a rectilinear or a
// structured grid. A build without VTK (SMURF_WITH_VTK) has functions of the same names that say so.
//
// Each throws Error (input), one line that names the file. VTK prints nothing.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "numerics/fact.hpp"
#include "smurf/flow.hpp"
#include "smurf/volume.hpp"

namespace smurf {

bool built_with_vtk();

enum class VtkGrid { image, rectilinear, structured };

struct VtkVectors {
  VtkGrid grid = VtkGrid::image;
  glm::ivec3 size{0};
  GridPlacement placement;                  // image
  std::array<std::vector<double>, 3> axes;  // rectilinear
  Values<glm::dvec3> points;                // structured
  Values<glm::vec3> vectors;                // at nodes
  std::vector<std::uint8_t> blanked;        // 1 where a node is hidden, or a corner of a hidden cell; empty: none is
  std::vector<Fact> notes;                  // how it was read, for people
};

// The array of this name; without one the only array of three components (vectors) or of one (scalars). Values of cells
// are brought to the nodes, each the mean of the cells about it; the notes say so. Hidden nodes of volumes are NaN.
VtkVectors read_vtk_vectors(const std::filesystem::path& file, std::string_view array);
Volume read_vtk_volume(const std::filesystem::path& file, std::string_view array);

// Whether there is an array of three components.
bool vtk_has_vectors(const std::filesystem::path& file);

}  // namespace smurf
