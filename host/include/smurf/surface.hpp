// Surfaces: immutable host descriptions that know nothing of devices.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <string_view>

#include "smurf/volume.hpp"

namespace smurf {

class SurfaceModel;  // internal: one class per kind, see host/surfaces/surface_model.hpp

// How a continuous field is made from samples.
//   trilinear    interpolates; derivatives are central differences over one cell (one-sided at the boundary nodes), interpolated
//   tricubic     interpolating cubic B-spline (prefiltered, Unser 1999), C², with its own derivatives
//   catmull_rom  interpolating cubic convolution, C¹, with its own derivatives
// Cubic reconstructions continue the data beyond the boundary mirrored about the outer nodes.
enum class Reconstruction { trilinear, tricubic, catmull_rom };

std::string_view name_of(Reconstruction reconstruction);     // as in descriptions: "catmull-rom"
Reconstruction reconstruction_named(std::string_view name);  // throws Error (input)

struct GridOptions {
  Reconstruction reconstruction = Reconstruction::tricubic;
};

struct Bounds {
  glm::dvec3 lower{0.0};
  glm::dvec3 upper{0.0};
};

// Copies share the description.
class Surface {
 public:
  explicit Surface(std::shared_ptr<const SurfaceModel> model) : model_(std::move(model)) {}
  std::string_view kind() const;
  Bounds bounds() const;  // of the domain, in world coordinates
  const SurfaceModel& model() const { return *model_; }
  const std::shared_ptr<const SurfaceModel>& share() const { return model_; }

 private:
  std::shared_ptr<const SurfaceModel> model_;
};

// The surface f = isovalue of a sampled field. Normals point to smaller values: n = -∇f/|∇f|.
// Throws Error (input) when the isovalue is not finite.
Surface isosurface(const Volume& volume, double isovalue, const GridOptions& options = {});

// Reads a surface description (JSON); file names in it are relative to the description.
// Throws Error (input) that names the file and the member that is wrong.
Surface load_surface(const std::filesystem::path& description);

}  // namespace smurf
