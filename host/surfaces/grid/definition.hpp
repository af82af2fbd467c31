// The isosurface of a sampled volume.
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
  std::string why_empty() const override;
  std::optional<InsideOfLevel> inside_of_level() const override { return InsideOfLevel{isovalue, true}; }

  const Volume volume;
  const double isovalue;
  const Reconstruction reconstruction;
};

}  // namespace smurf
