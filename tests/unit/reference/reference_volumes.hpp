// Volumes, fields and random numbers for the tests of the reference.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "reference/grid/field.hpp"

namespace smurf::reference_test {

using glm::dmat3, glm::dvec3, glm::ivec3;
inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
inline constexpr Reconstruction all_reconstructions[] = {Reconstruction::trilinear, Reconstruction::tricubic,
                                                         Reconstruction::catmull_rom};

template <class T = float>
inline Volume make_volume(ivec3 size, const GridPlacement& placement, const std::function<double(int, int, int)>& f) {
  auto samples = std::make_shared<std::vector<T>>();
  for (int k = 0; k < size.z; k++) {
    for (int j = 0; j < size.y; j++) {
      for (int i = 0; i < size.x; i++) samples->push_back(T(f(i, j, k)));
    }
  }
  return Volume(std::shared_ptr<const void>(samples, samples->data()), sample_type_of<T>(), size, placement);
}

// A function of the world sampled on a cube of n³ nodes with corners `lower` and `lower + edge`.
inline Volume sampled(int n, dvec3 lower, double edge, const std::function<double(dvec3)>& f) {
  const double h = edge / (n - 1);
  return make_volume({n, n, n}, {dmat3(h), lower}, [&](int i, int j, int k) { return f(lower + h * dvec3(i, j, k)); });
}

inline Volume noise_volume(ivec3 size, const GridPlacement& placement, unsigned seed) {
  std::mt19937 random(seed);
  return make_volume(size, placement, [&](int, int, int) { return double(int(random() % 2001) - 1000) / 1024; });
}

inline const GridPlacement sheared{dmat3(0.9, 0.1, -0.05, 0.25, 1.3, 0.2, -0.1, 0.3, 0.6), dvec3(3, -7, 11)};

class Uniform {
 public:
  explicit Uniform(unsigned seed) : random_(seed) {}
  double operator()(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  dvec3 vector(double a, double b) { return {(*this)(a, b), (*this)(a, b), (*this)(a, b)}; }
  dvec3 direction() {
    for (;;) {
      const dvec3 v = vector(-1, 1);
      if (const double length = glm::length(v); length > 0.1 && length < 1) return v / length;
    }
  }

 private:
  std::mt19937 random_;
};

inline std::shared_ptr<const GridField> make_field(const Volume& volume, Reconstruction reconstruction) {
  return std::make_shared<GridField>(volume, reconstruction);
}

}  // namespace smurf::reference_test
