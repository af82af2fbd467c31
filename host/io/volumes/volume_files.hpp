// Readers of scalar volumes beside NRRD and VTK, and which reader a file is for. Each throws Error (input), one line
// that names the file.
#pragma once

#include <filesystem>

#include "smurf/volume.hpp"

namespace smurf {

// From the name's ending.
bool is_vtk_file(const std::filesystem::path& file);         // .vtk .vti .vtr .vts
bool is_nifti_file(const std::filesystem::path& file);       // .nii .nii.gz
bool is_meta_image_file(const std::filesystem::path& file);  // .mha .mhd

// MetaImage: header and data in one file (.mha) or two (.mhd), raw or compressed by zlib.
Volume read_meta_image(const std::filesystem::path& file);

// NIfTI-1 and NIfTI-2, one file, compressed by gzip or not. The world is that of the sform, else of the qform, else of
// the spacing alone. Samples are scaled by slope and intercept where the header has them, and are floats then.
Volume read_nifti(const std::filesystem::path& file);

}  // namespace smurf
