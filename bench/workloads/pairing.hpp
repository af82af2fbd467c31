// Pairs the hits of a ray with its roots: both ascend in t, and pairs keep that order. Of all ways to pair them the one
// is taken that leaves the fewest wrong; of these the one whose pairs lie closest together.
//
// Tests judge every kind of surface by it (tests/harness/judge.hpp), and so do the checks of measurements
// (validate.hpp).
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace smurf::workloads {

// The difference of a hit from a root in parts of what is allowed: right up to 1, wrong above, `another_root` where the
// hit cannot be of this root.
inline constexpr double another_root = std::numeric_limits<double>::infinity();

struct PairingRules {
  std::function<double(std::size_t hit, std::size_t root)> off;
  std::function<bool(std::size_t hit)> may_be_alone;     // a hit without a root is no error
  std::function<bool(std::size_t root)> may_be_missing;  // a root without a hit is no error
};

struct Pairing {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;  // hit, root
  std::vector<std::size_t> lone_hits, lone_roots;          // ascending
};

Pairing pair_in_order(std::size_t hits, std::size_t roots, const PairingRules& rules);

}  // namespace smurf::workloads
