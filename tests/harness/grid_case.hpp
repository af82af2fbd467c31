// Cases of grids: a sampled field, an isovalue, a reconstruction and a number of rays, as descriptors of the general
// form (case.hpp).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/case.hpp"
#include "smurf/surface.hpp"
#include "truth/grid_truth.hpp"
#include "truth/jet.hpp"
#include "truth/rays.hpp"

namespace smurf::test {

struct GridCase {
  std::string name;
  Volume volume;
  double isovalue = 0;
  Reconstruction reconstruction = Reconstruction::tricubic;
  std::size_t random_rays = 20000;  // chords of the domain; as many camera rays
  std::size_t hostile_rays = 200;   // of each hostile family
  std::size_t slow_share = 20;      // devices that are slow see one ray in so many
  std::size_t properties = 5000;    // hits whose properties are compared
  unsigned seed = 1;
};

// Chords, camera rays and hostile families; the roots and properties of the same reconstruction in double precision.
Case case_of(const GridCase& grid_case);
// Of rays that cases make themselves.
Case case_of(const GridCase& grid_case, std::vector<RayFamily> families);
inline std::map<std::string, Totals> run(const GridCase& grid_case) { return run(case_of(grid_case)); }

GridTolerances tolerances_of(const GridCase& grid_case);
// The properties of hits by the field's jet; nothing where the field or its derivatives are undefined.
using JetAt = std::function<std::optional<Jet>(const glm::dvec3&)>;
PointOracle points_of(const GridCase& grid_case, const JetAt& jet_at);
JetAt jets_of(const std::shared_ptr<const GridField>& field);

}  // namespace smurf::test
