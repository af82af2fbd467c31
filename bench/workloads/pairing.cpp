#include "workloads/pairing.hpp"

#include <algorithm>
#include <compare>
#include <cstdint>

namespace smurf::workloads {
namespace {

// What a way to pair costs: errors count first.
struct Cost {
  std::size_t errors = 0;
  double distance = 0;  // of pairs, in parts of what is allowed; 1 for what is left alone

  auto operator<=>(const Cost&) const = default;
};

Cost operator+(Cost a, Cost b) { return {a.errors + b.errors, a.distance + b.distance}; }

enum class Step : std::uint8_t { pair, lone_hit, lone_root };

// As many hits as roots, each in place.
bool all_right(std::size_t hits, std::size_t roots, const PairingRules& rules) {
  if (hits != roots) return false;
  for (std::size_t i = 0; i < hits; i++)
    if (!(rules.off(i, i) <= 1)) return false;
  return true;
}

// By dynamic programming, as texts are compared (Needleman and Wunsch): the best of the first hits and the first roots
// follows from the best of one less of either. Returns the last step for each number of hits and of roots.
std::vector<Step> best_steps(std::size_t hits, std::size_t roots, const PairingRules& rules) {
  const std::size_t width = roots + 1;
  std::vector<Step> steps((hits + 1) * width);
  std::vector<Cost> above(width), row(width);
  std::vector<Cost> missing(roots);
  for (std::size_t r = 0; r < roots; r++) missing[r] = {rules.may_be_missing(r) ? 0u : 1u, 1};
  for (std::size_t h = 0; h <= hits; h++) {
    const Cost alone{h > 0 && !rules.may_be_alone(h - 1) ? 1u : 0u, 1};
    for (std::size_t r = 0; r <= roots; r++) {
      if (h == 0 && r == 0) continue;
      Cost best{std::numeric_limits<std::size_t>::max(), 0};
      const auto offer = [&](Cost cost, Step step) {
        if (!(cost < best)) return;
        best = cost;
        steps[h * width + r] = step;
      };
      if (h > 0 && r > 0) {
        const double off = rules.off(h - 1, r - 1);
        if (off < another_root) offer(above[r - 1] + Cost{off <= 1 ? 0u : 1u, std::min(off, 1.0)}, Step::pair);
      }
      if (h > 0) offer(above[r] + alone, Step::lone_hit);
      if (r > 0) offer(row[r - 1] + missing[r - 1], Step::lone_root);
      row[r] = best;
    }
    std::swap(above, row);
    row[0] = {};
  }
  return steps;
}

}  // namespace

Pairing pair_in_order(std::size_t hits, std::size_t roots, const PairingRules& rules) {
  Pairing found;
  if (all_right(hits, roots, rules)) {
    for (std::size_t i = 0; i < hits; i++) found.pairs.emplace_back(i, i);
    return found;
  }
  const std::vector<Step> steps = best_steps(hits, roots, rules);
  for (std::size_t h = hits, r = roots; h > 0 || r > 0;) {
    switch (steps[h * (roots + 1) + r]) {
      case Step::pair:
        found.pairs.emplace_back(--h, --r);
        break;
      case Step::lone_hit:
        found.lone_hits.push_back(--h);
        break;
      case Step::lone_root:
        found.lone_roots.push_back(--r);
        break;
    }
  }
  std::ranges::reverse(found.pairs);
  std::ranges::reverse(found.lone_hits);
  std::ranges::reverse(found.lone_roots);
  return found;
}

}  // namespace smurf::workloads
