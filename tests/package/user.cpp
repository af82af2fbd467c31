// Casts a few rays at a sampled sphere: exits 0 if they hit where they should.
#include <cmath>
#include <cstdio>
#include <smurf/smurf.hpp>
#include <vector>

int main() {
  const int n = 24;
  std::vector<float> samples;
  for (int k = 0; k < n; k++)
    for (int j = 0; j < n; j++)
      for (int i = 0; i < n; i++) samples.push_back(8 - std::hypot(i - 11.5f, j - 11.5f, k - 11.5f));

  const smurf::Volume volume = smurf::borrow_volume<float>(samples, glm::ivec3(n));
  const smurf::Interrogator query(smurf::open_device("reference"), smurf::isosurface(volume, 0));
  smurf::RayBatch rays(1);
  rays.set(0, {{-5, 11.5f, 11.5f}, {1, 0, 0}});
  const smurf::HitList hits = query.cast(rays, {.hits = smurf::Hits::all});
  std::printf("%zu hits\n", hits.size());
  return hits.size() == 2 && std::abs(hits.t()[0] - 8.5f) < 1e-2f ? 0 : 1;
}
