#include "surfaces/mesh/neighbors.hpp"

#include <algorithm>
#include <limits>

namespace smurf {
namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

// A side of a face, by its vertices.
struct Side {
  std::uint64_t edge;  // lower vertex in the upper half, higher vertex in the lower half
  std::uint32_t face, side;
};

}  // namespace

std::vector<std::uint32_t> mesh_neighbors(const Mesh& mesh) {
  const auto faces = mesh.faces();
  std::vector<Side> sides;
  sides.reserve(3 * faces.size());
  for (std::size_t f = 0; f < faces.size(); f++) {
    for (int s = 0; s < 3; s++) {
      const std::uint32_t a = faces[f][s], b = faces[f][(s + 1) % 3];
      sides.push_back({(std::uint64_t(std::min(a, b)) << 32) | std::max(a, b), std::uint32_t(f), std::uint32_t(s)});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.face != b.face ? a.face < b.face : a.side < b.side;
  });
  std::vector<std::uint32_t> words(3 * faces.size(), none);
  for (std::size_t i = 0, next = 0; i < sides.size(); i = next) {
    while (next < sides.size() && sides[next].edge == sides[i].edge) next++;
    if (next - i != 2) continue;
    const Side &a = sides[i], &b = sides[i + 1];
    words[3 * std::size_t(a.face) + a.side] = 4 * b.face + b.side;
    words[3 * std::size_t(b.face) + b.side] = 4 * a.face + a.side;
  }
  return words;
}

}  // namespace smurf
