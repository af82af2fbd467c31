// Surfaces of every kind, for questions that are the same for all of them.
#pragma once

#include <numbers>
#include <string>
#include <vector>

#include "smurf/black_box.hpp"
#include "smurf/flow.hpp"
#include "smurf/stream.hpp"
#include "smurf/surface.hpp"
#include "smurf/volume.hpp"
#include "truth/meshes.hpp"

namespace smurf::test {

struct NamedSurface {
  std::string name;
  Surface surface;
};

// Of x, y, z, at size³ nodes on [-extent, extent]³.
template <class Function>
Volume sampled(int size, double extent, const Function& f) {
  auto samples = std::make_shared<std::vector<float>>();
  const double h = 2 * extent / (size - 1);
  for (int k = 0; k < size; k++) {
    for (int j = 0; j < size; j++) {
      for (int i = 0; i < size; i++) samples->push_back(float(f(i * h - extent, j * h - extent, k * h - extent)));
    }
  }
  const float* first = samples->data();
  GridPlacement placement = spacing(h, h, h);
  placement.origin = glm::dvec3(-extent);
  return Volume(std::shared_ptr<const void>(samples, first), SampleType::float32, glm::ivec3(size), placement);
}

inline Surface sphere_black_box(double radius, double extent) {
  const std::string square = std::to_string(radius * radius) + "f";
  const BlackBox ball{
      .source = "FN real black_box(real x, real y, real z) { return x*x + y*y + z*z - " + square + "; }",
      .value = [radius](const glm::dvec3& p) { return glm::dot(p, p) - radius * radius; },
      .name = "ball"};
  return implicit(ball, {glm::dvec3(-extent), glm::dvec3(extent)});
}

// A sphere of radius 1 about 0 of each kind.
inline std::vector<NamedSurface> spheres() {
  const Domain box{glm::dvec3(-1.5), glm::dvec3(1.5)};
  const double pi = std::numbers::pi;
  return {
      {"grid",
       isosurface(sampled(33, 1.5, [](double x, double y, double z) { return 1 - x * x - y * y - z * z; }), 0.0)},
      {"implicit", implicit("x^2+y^2+z^2-1", box)},
      {"black box", sphere_black_box(1, 1.5)},
      {"mesh", mesh_surface(sphere_mesh(1, 5))},
      {"parametric", parametric({"cos(u)*cos(v)", "sin(u)*cos(v)", "sin(v)"}, {0, 2 * pi}, {-pi / 2, pi / 2})},
  };
}

}  // namespace smurf::test
