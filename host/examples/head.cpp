// head VOLUME.nrrd [DEVICE]: every hit of a picture's rays with a CT head, and how the skin is curved there.
#include <cstdio>
#include <smurf/smurf.hpp>

int main(int, char** arguments) {
  auto device = smurf::open_device(arguments[2] ? arguments[2] : "opencl");
  auto surface = smurf::isosurface(smurf::load_volume(arguments[1]), 500);
  auto query = smurf::Interrogator(device, surface);

  auto camera = smurf::fitted_camera(surface.bounds(), 256, 256);
  auto hits = query.cast(camera.rays(), {.hits = smurf::Hits::all});

  auto normals = hits.normals();             // evaluated on the device now, kept for later
  auto kappa = hits.principal_curvatures();  // k1 >= k2
  std::size_t ray = 256 * 100 + 128, hit = hits.offsets()[ray];
  for (; hit < hits.offsets()[ray + 1]; hit++) {
    std::printf("t %g (%s)  normal %g %g %g  curvature %g %g\n", hits.t()[hit], name_of(hits.status()[hit]).data(),
                normals[hit].x, normals[hit].y, normals[hit].z, kappa[hit].x, kappa[hit].y);
  }
  std::printf("%zu rays, %zu hits\n", hits.ray_count(), hits.size());
  return hits.size() > 0 ? 0 : 1;
}
