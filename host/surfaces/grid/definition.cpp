#include "surfaces/grid/definition.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "smurf/error.hpp"

namespace smurf {

GridIsosurface::GridIsosurface(const Volume& the_volume, double the_isovalue, const GridOptions& options)
    : SurfaceDefinition(SurfaceKind::grid),
      volume(the_volume),
      isovalue(the_isovalue),
      reconstruction(options.reconstruction) {
  if (!std::isfinite(isovalue))
    throw Error(ErrorCode::input, fmt::format("the isovalue must be finite, not {}", isovalue));
}

Bounds GridIsosurface::bounds() const {
  const GridPlacement& placement = volume.placement();
  Bounds bounds{glm::dvec3(std::numeric_limits<double>::infinity()),
                glm::dvec3(-std::numeric_limits<double>::infinity())};
  for (int corner = 0; corner < 8; corner++) {
    const glm::dvec3 index((corner & 1) ? volume.size().x - 1 : 0, (corner & 2) ? volume.size().y - 1 : 0,
                           (corner & 4) ? volume.size().z - 1 : 0);
    const glm::dvec3 point = placement.origin + placement.axes * index;
    bounds.lower = glm::min(bounds.lower, point);
    bounds.upper = glm::max(bounds.upper, point);
  }
  return bounds;
}

std::uint32_t GridIsosurface::properties() const {
  return Property::value | Property::normal | Property::gauss | Property::mean | Property::principal |
         Property::directions | Property::normal_curvature | Property::distance | Property::inside;
}

std::vector<Fact> GridIsosurface::facts() const {
  const glm::ivec3 size = volume.size();
  std::vector<Fact> facts{
      {"field", "grid"},
      {"reconstruction", std::string(name_of(reconstruction))},
      {"isovalue", fmt::format("{}", isovalue)},
      {"samples", fmt::format("{} x {} x {} {}", size.x, size.y, size.z, name_of(volume.type()))},
      {"spacing", fmt::format("{:g} {:g} {:g}", glm::length(volume.placement().axes[0]),
                              glm::length(volume.placement().axes[1]), glm::length(volume.placement().axes[2]))},
      {"range", fmt::format("{:g} to {:g}", volume.minimum(), volume.maximum())},
  };
  if (volume.non_finite() > 0) {
    facts.push_back({"not finite", fmt::format("{} samples are NaN or infinite: there is no surface within their reach",
                                               volume.non_finite())});
  }
  return facts;
}

std::string GridIsosurface::why_empty() const {
  // Cubic reconstructions overshoot the samples, by less than their range.
  const double least = volume.minimum(), greatest = volume.maximum();
  const double slack = reconstruction == Reconstruction::trilinear ? 0 : greatest - least;
  if (isovalue >= least - slack && isovalue <= greatest + slack) return {};
  return fmt::format("the isovalue {:g} is outside of the data's range, {:g} to {:g}", isovalue, least, greatest);
}

}  // namespace smurf
