// Scalar volumes from files of every kind.
#include "io/volumes/volume_files.hpp"

#include <fmt/format.h>

#include "io/description.hpp"
#include "io/volumes/nrrd_file.hpp"
#include "io/vtk/vtk_files.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using std::filesystem::path;

Volume load_nrrd_volume(const path& file) {
  const NrrdFile nrrd = read_nrrd(file);
  if (nrrd.components != 1)
    throw Error(ErrorCode::input,
                fmt::format("\"{}\": dimension is 4 with {} values along the first axis; a volume must have dimension "
                            "3, or a single value a sample",
                            file.string(), nrrd.components));
  return {nrrd.read(), nrrd.type, nrrd.size, nrrd.placement};
}

}  // namespace

bool is_vtk_file(const path& file) {
  const std::string ending = description::ending_of(file);
  return ending == ".vtk" || ending == ".vti" || ending == ".vtr" || ending == ".vts";
}

bool is_nifti_file(const path& file) {
  const std::string ending = description::ending_of(file);
  return ending == ".nii" || (ending == ".gz" && description::ending_of(file.stem()) == ".nii");
}

bool is_meta_image_file(const path& file) {
  const std::string ending = description::ending_of(file);
  return ending == ".mha" || ending == ".mhd";
}

Volume load_volume(const path& file, std::string_view array) {
  if (is_vtk_file(file)) return read_vtk_volume(file, array);
  if (!array.empty())
    throw Error(ErrorCode::input, fmt::format("\"{}\": array \"{}\" is asked for, but files of this kind have no "
                                              "arrays by name; VTK files do",
                                              file.string(), array));
  try {
    if (is_meta_image_file(file)) return read_meta_image(file);
    if (is_nifti_file(file)) return read_nifti(file);
    return load_nrrd_volume(file);
  } catch (const Error& error) {
    const std::string message = error.what();
    if (message.find('"' + file.string() + '"') != message.npos || error.code() != ErrorCode::input) throw;
    throw Error(error.code(), fmt::format("\"{}\": {}", file.string(), message));
  }
}

}  // namespace smurf
