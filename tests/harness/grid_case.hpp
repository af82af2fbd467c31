// One descriptor per case: a sampled field, an isovalue, a reconstruction and a number of rays. It is run on every
// device, and everything that a hit list says is compared with the truth in double precision.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/compare.hpp"
#include "harness/devices.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/surface.hpp"
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

struct Totals {
  Verdict random, hostile;
};

// Checks, on every device: hits of all rays against the truth (compare.hpp); first hits; properties against the
// reference's; and that runs, tiles and numbers of lanes agree to the bit. Returns what was counted, by the device's
// label.
std::map<std::string, Totals> run(const GridCase& grid_case);
// The same on some devices only.
std::map<std::string, Totals> run(const GridCase& grid_case, std::span<TestDevice> devices);

// The parts of it, for cases that need only some.
std::vector<RayFamily> families_of(const GridCase& grid_case);
// `known` is a list that was judged before, on another device: hits that equal it need no second judgement.
struct Judged {
  HitList hits;
  Verdict verdict;
};
Judged expect_hits(const GridCase& grid_case, const std::shared_ptr<const GridField>& field, const RayFamily& family,
                   const Truth& truth, TestDevice& device, const Interrogator& query, const Judged* known = nullptr);
// The properties of hits by the field's jet; nothing where the field or its derivatives are undefined.
using JetAt = std::function<std::optional<Jet>(const glm::dvec3&)>;
void expect_properties(const GridCase& grid_case, const JetAt& jet_at, const HitList& hits, const std::string& where);
JetAt jets_of(const std::shared_ptr<const GridField>& field);
Judging judging_of(const GridCase& grid_case);

// Every column of two hit lists, to the bit.
bool same_bytes(const HitList& a, const HitList& b);
// The first `count` rays, whole rows of an image.
RayBatch first_rays(const RayBatch& rays, std::size_t count);

}  // namespace smurf::test
