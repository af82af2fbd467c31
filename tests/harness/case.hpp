// One descriptor per case, for surfaces of every kind: a surface, rays, an oracle for their roots and one for what is
// measured where they hit. Tolerances are those of the one table (tolerances.hpp), which oracles look up by their kind.
// Kinds make descriptors (grid_case.hpp; the cases themselves) and nothing else: what is asked of devices and how it is
// judged is said here once.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "harness/devices.hpp"
#include "harness/judge.hpp"
#include "harness/points.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/surface.hpp"
#include "truth/rays.hpp"

namespace smurf::test {

struct Case {
  std::string name;
  Surface surface;
  std::vector<RayFamily> rays = {};
  // What is known of the roots on a family's rays.
  std::function<std::shared_ptr<const Oracle>(const RayFamily&)> oracle = {};
  // What is known of the surface where rays of random families hit it; empty where nothing is.
  PointOracle points = {};
  // The command that casts one ray again; the name is that of the files that it writes.
  std::function<std::string(const std::string& name, const Ray& ray, const std::string& device)> replay = {};
  std::size_t slow_share = 20;    // devices that are slow see one ray in so many
  std::size_t properties = 5000;  // hits whose properties are compared
  unsigned seed = 1;              // of the directions that normal curvatures are asked for
};

struct Totals {
  Verdict random, hostile;
};

// Checks, on every device: hits of all rays against the oracle (judge.hpp); first hits; properties against the points'
// oracle (points.hpp); and that runs, tiles and numbers of lanes agree to the bit. Returns what was counted, by the
// device's label.
std::map<std::string, Totals> run(const Case& one);
// The same on some devices only.
std::map<std::string, Totals> run(const Case& one, std::span<TestDevice> devices);

// The parts of it, for cases that need only some.

// The hits of a family's rays, judged. `known` is a list that was judged before, on another device: hits that equal it
// need no second judgement.
struct Judged {
  HitList hits;
  Verdict verdict;
};
Judged expect_hits(const Case& one, const RayFamily& family, const Oracle& oracle, const TestDevice& device,
                   const Interrogator& query, const Judged* known = nullptr);
// A list that was cast before.
Verdict expect_hits(const Case& one, const std::string& family, const RayBatch& rays, const Oracle& oracle,
                    const TestDevice& device, const HitList& hits);
void expect_properties(const Case& one, const PointOracle& points, const HitList& hits, const std::string& where);

// The first `count` rays, whole rows of an image.
RayBatch first_rays(const RayBatch& rays, std::size_t count);

}  // namespace smurf::test
