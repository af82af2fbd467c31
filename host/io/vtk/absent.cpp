// In place of the readers of VTK's files, in a build without VTK.
#include <fmt/format.h>

#include "io/vtk/vtk_files.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file) {
  throw Error(ErrorCode::input,
              fmt::format("\"{}\": this smurf was built without VTK, which reads such files; install VTK 9 (Debian: "
                          "libvtk9-dev) and build smurf with -DSMURF_WITH_VTK=ON",
                          file.string()));
}

}  // namespace

bool built_with_vtk() { return false; }
VtkVectors read_vtk_vectors(const std::filesystem::path& file, std::string_view) { refuse(file); }
Volume read_vtk_volume(const std::filesystem::path& file, std::string_view) { refuse(file); }
bool vtk_has_vectors(const std::filesystem::path& file) { refuse(file); }

}  // namespace smurf
