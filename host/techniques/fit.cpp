// Fits a camera to what it sees: a coarse picture of first hits tells how far the surface reaches.
#include <algorithm>
#include <vector>

#include "smurf/render.hpp"

namespace smurf {

Camera fitted_camera(const Interrogator& query, const Camera& camera, Fit fit) {
  constexpr int coarse = 96, rounds = 2;  // once more, for from nearby the outline is another one
  Camera fitted = camera;
  for (int round = 0; round < rounds; round++) {
    Camera scout = fitted;
    const double shrink = std::min(1.0, double(coarse) / std::max(camera.width, camera.height));
    scout.width = std::max(1, int(shrink * camera.width));
    scout.height = std::max(1, int(shrink * camera.height));
    const HitList hits = query.cast(scout.rays(), {.hits = Hits::first, .bad_rays = BadRays::error});
    if (hits.size() == 0) break;
    fitted = fitted_to(fitted, hits.locations(), fit);
  }
  return fitted;
}

}  // namespace smurf
