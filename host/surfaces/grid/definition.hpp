// The isosurface of a sampled volume: the host description that the device side
// (grid_isosurface.cpp) and the reference (host/reference/grid/surface.cpp) share.
#pragma once

#include "surfaces/surface_definition.hpp"

namespace smurf {

class GridIsosurface : public SurfaceDefinition {
 public:
  GridIsosurface(const Volume& volume, double isovalue, const GridOptions& options);
  std::string_view kind() const override { return "isosurface"; }
  Bounds bounds() const override;
  std::uint32_t properties() const override;
  std::vector<Fact> facts() const override;
  std::unique_ptr<ResidentSurface> reside(Executor& executor, const PrepareOptions& options) const override;
  std::unique_ptr<SurfaceQueries> reference() const override;  // host/reference/grid/surface.cpp

  const Volume volume;
  const double isovalue;
  const Reconstruction reconstruction;
};

}  // namespace smurf
