#include "truth/analytic.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "truth/polynomial.hpp"

namespace smurf::test {
namespace {

constexpr double pi = std::numbers::pi;

std::vector<double> to_double(const std::vector<long double>& roots, long double shift = 0) {
  std::vector<double> out;
  for (long double r : roots) out.push_back(double(r + shift));
  return out;
}

// The jet of a radial distance |q| for q = P p, P a projection (or the identity).
Jet distance_jet(const glm::dvec3& q, const glm::dmat3& projection) {
  const double distance = glm::length(q);
  const glm::dvec3 e = q / distance;
  return {distance, e, (projection - glm::outerProduct(e, e)) / distance};
}

Jet inside_positive(const Jet& distance, double radius) {
  return {radius - distance.value, -distance.gradient, -distance.hessian};
}

// Where |q + t·e| = radius.
std::vector<double> quadratic_roots(const glm::dvec3& q, const glm::dvec3& e, double radius, double lower,
                                    double upper) {
  if (radius <= 0) return {};
  // About the point of closest approach, so that a far origin costs no digits.
  const long double ee = glm::dot(e, e);
  if (ee == 0) return {};
  const long double closest = -glm::dot(q, e) / ee;
  const glm::dvec3 foot = q + double(closest) * e;
  const long double square = ((long double)radius * radius - glm::dot(foot, foot)) / ee;
  if (square < 0) return {};
  const double half = double(std::sqrt(square));
  std::vector<double> out;
  for (double t : {double(closest) - half, double(closest) + half})
    if (t >= lower && t <= upper) out.push_back(t);
  return out;
}

class Sphere : public AnalyticField {
 public:
  Sphere(const glm::dvec3& center, double radius) : center_(center), radius_(radius) {}
  Jet at(const glm::dvec3& p) const override {
    return inside_positive(distance_jet(p - center_, glm::dmat3(1.0)), radius_);
  }
  std::vector<double> roots(double level, const glm::dvec3& o, const glm::dvec3& d, double lower,
                            double upper) const override {
    return quadratic_roots(o - center_, d, radius_ - level, lower, upper);
  }

 private:
  glm::dvec3 center_;
  double radius_;
};

class Cylinder : public AnalyticField {
 public:
  Cylinder(const glm::dvec3& point, const glm::dvec3& axis, double radius)
      : point_(point),
        projection_(glm::dmat3(1.0) - glm::outerProduct(glm::normalize(axis), glm::normalize(axis))),
        radius_(radius) {}
  Jet at(const glm::dvec3& p) const override {
    return inside_positive(distance_jet(projection_ * (p - point_), projection_), radius_);
  }
  std::vector<double> roots(double level, const glm::dvec3& o, const glm::dvec3& d, double lower,
                            double upper) const override {
    return quadratic_roots(projection_ * (o - point_), projection_ * d, radius_ - level, lower, upper);
  }

 private:
  glm::dvec3 point_;
  glm::dmat3 projection_;
  double radius_;
};

class Torus : public AnalyticField {
 public:
  Torus(const glm::dvec3& center, double ring, double tube) : center_(center), ring_(ring), tube_(tube) {}
  Jet at(const glm::dvec3& p) const override {
    const glm::dvec3 q = p - center_;
    const double rho = std::hypot(q.x, q.y);
    const glm::dvec3 outward(q.x / rho, q.y / rho, 0), around(-outward.y, outward.x, 0), up(0, 0, 1);
    const double distance = std::hypot(rho - ring_, q.z);
    const double c = (rho - ring_) / distance, s = q.z / distance;
    const glm::dvec3 gradient = c * outward + s * up, across = -s * outward + c * up;
    const glm::dmat3 hessian =
        glm::outerProduct(across, across) / distance + glm::outerProduct(around, around) * (c / rho);
    return inside_positive({distance, gradient, hessian}, tube_);
  }
  // (|p|² + R² - s²)² = 4R²(x² + y²), about the point of the line closest to the centre.
  std::vector<double> roots(double level, const glm::dvec3& o, const glm::dvec3& d, double lower,
                            double upper) const override {
    const double tube = tube_ - level;
    if (tube <= 0) return {};
    const double closest = -glm::dot(o - center_, d) / glm::dot(d, d);
    const glm::dvec3 q = o - center_ + closest * d;
    const Polynomial x = linear(q.x, d.x), y = linear(q.y, d.y), z = linear(q.z, d.z);
    const Polynomial square = x * x + y * y + z * z + constant((long double)ring_ * ring_ - (long double)tube * tube);
    const Polynomial quartic = square * square - 4.0L * ring_ * ring_ * (x * x + y * y);
    const double reach = (ring_ + tube) / glm::length(d) * 1.01;
    return to_double(quartic.roots(std::max(lower - closest, -reach), std::min(upper - closest, reach)), closest);
  }

 private:
  glm::dvec3 center_;
  double ring_, tube_;
};

// ((1 - sin(pi z/2)) + a (1 + cos(2 pi f cos(pi r/2)))) / (2 (1 + a))
class MarschnerLobb : public AnalyticField {
 public:
  Jet at(const glm::dvec3& p) const override {
    const double a = 0.25, frequency = 6, norm = 2 * (1 + a);
    const double r = std::hypot(p.x, p.y);
    // rho(r) = cos(w cos(pi r/2)) with its first and second derivative; rho'/r tends to rho'' on the axis.
    const double w = 2 * pi * frequency, c = std::cos(pi * r / 2), s = std::sin(pi * r / 2);
    const double rho = std::cos(w * c);
    const double first = std::sin(w * c) * w * s * pi / 2;
    const double second = (-std::cos(w * c) * w * w * s * s + std::sin(w * c) * w * c) * pi * pi / 4;
    const bool on_axis = r < 1e-9;
    const glm::dvec3 e = on_axis ? glm::dvec3(1, 0, 0) : glm::dvec3(p.x / r, p.y / r, 0);
    const glm::dvec3 around(-e.y, e.x, 0);
    const double turn = on_axis ? second : first / r;

    Jet jet;
    jet.value = ((1 - std::sin(pi * p.z / 2)) + a * (1 + rho)) / norm;
    jet.gradient = (a * first * e + glm::dvec3(0, 0, -pi / 2 * std::cos(pi * p.z / 2))) / norm;
    jet.hessian = a * (second * glm::outerProduct(e, e) + turn * glm::outerProduct(around, around));
    jet.hessian[2][2] += pi * pi / 4 * std::sin(pi * p.z / 2);
    jet.hessian = jet.hessian / norm;
    return jet;
  }
};

class Layers : public AnalyticField {
 public:
  explicit Layers(const glm::dvec3& k) : k_(k) {}
  Jet at(const glm::dvec3& p) const override {
    const double phase = glm::dot(k_, p);
    return {std::sin(phase), std::cos(phase) * k_, -std::sin(phase) * glm::outerProduct(k_, k_)};
  }
  // sin(phase0 + t·rate) = level
  std::vector<double> roots(double level, const glm::dvec3& o, const glm::dvec3& d, double lower,
                            double upper) const override {
    const double start = glm::dot(k_, o), rate = glm::dot(k_, d);
    if (std::abs(level) >= 1 || rate == 0) return {};
    std::vector<double> out;
    const double low = std::min(start + lower * rate, start + upper * rate);
    const double high = std::max(start + lower * rate, start + upper * rate);
    for (double turn = std::floor(low / (2 * pi)) - 1; turn * 2 * pi <= high + 2 * pi; turn++)
      for (double angle : {std::asin(level), pi - std::asin(level)}) {
        const double phase = angle + turn * 2 * pi;
        if (phase >= low && phase <= high) out.push_back((phase - start) / rate);
      }
    std::sort(out.begin(), out.end());
    return out;
  }

 private:
  glm::dvec3 k_;
};

class TrivariatePolynomial : public AnalyticField {
 public:
  TrivariatePolynomial(const std::array<double, 64>& c, const glm::dmat3& to_unit, const glm::dvec3& shift)
      : c_(c), to_unit_(to_unit), shift_(shift) {}
  Jet at(const glm::dvec3& p) const override {
    const glm::dvec3 u = to_unit_ * p + shift_;
    // Powers and their derivatives per axis: power[axis][derivative][exponent].
    double power[3][3][4];
    for (int axis = 0; axis < 3; axis++) {
      const double x = u[axis];
      const double rows[3][4] = {{1, x, x * x, x * x * x}, {0, 1, 2 * x, 3 * x * x}, {0, 0, 2, 6 * x}};
      for (int d = 0; d < 3; d++)
        for (int e = 0; e < 4; e++) power[axis][d][e] = rows[d][e];
    }
    const auto sum = [&](int dx, int dy, int dz) {
      double value = 0;
      for (int k = 0; k < 4; k++)
        for (int j = 0; j < 4; j++)
          for (int i = 0; i < 4; i++)
            value += c_[std::size_t(i + 4 * j + 16 * k)] * power[0][dx][i] * power[1][dy][j] * power[2][dz][k];
      return value;
    };
    Jet jet;
    jet.value = sum(0, 0, 0);
    jet.gradient = {sum(1, 0, 0), sum(0, 1, 0), sum(0, 0, 1)};
    const double xy = sum(1, 1, 0), xz = sum(1, 0, 1), yz = sum(0, 1, 1);
    jet.hessian = {{sum(2, 0, 0), xy, xz}, {xy, sum(0, 2, 0), yz}, {xz, yz, sum(0, 0, 2)}};
    return pulled_back(jet, to_unit_);
  }
  std::vector<double> roots(double level, const glm::dvec3& o, const glm::dvec3& d, double lower,
                            double upper) const override {
    // About the middle of the range, where the powers are smallest.
    const double middle = 0.5 * (lower + upper);
    const glm::dvec3 u = to_unit_ * (o + middle * d) + shift_, v = to_unit_ * d;
    std::array<std::array<Polynomial, 4>, 3> power;
    for (int axis = 0; axis < 3; axis++) {
      power[std::size_t(axis)][0] = constant(1);
      for (std::size_t e = 1; e < 4; e++)
        power[std::size_t(axis)][e] = power[std::size_t(axis)][e - 1] * linear(u[axis], v[axis]);
    }
    Polynomial f = constant(-level);
    for (std::size_t k = 0; k < 4; k++)
      for (std::size_t j = 0; j < 4; j++)
        for (std::size_t i = 0; i < 4; i++)
          if (c_[i + 4 * j + 16 * k] != 0)
            f = f + (long double)c_[i + 4 * j + 16 * k] * (power[0][i] * power[1][j] * power[2][k]);
    return to_double(f.roots(lower - middle, upper - middle), middle);
  }

 private:
  std::array<double, 64> c_;
  glm::dmat3 to_unit_;
  glm::dvec3 shift_;
};

template <class T>
Volume sampled_as(const std::vector<double>& values, const Sampling& s) {
  auto samples = std::make_shared<std::vector<T>>();
  samples->reserve(values.size());
  for (double f : values) {
    const double stored = s.scale * f + s.offset;
    if constexpr (std::is_integral_v<T>) {
      const double low = double(std::numeric_limits<T>::min()), high = double(std::numeric_limits<T>::max());
      // The upper bound of a 64-bit type is not a double; stay below it.
      const double clamped = std::clamp(std::round(stored), low, sizeof(T) == 8 ? high * (1 - 1e-15) : high);
      samples->push_back(T(clamped));
    } else {
      samples->push_back(T(stored));
    }
  }
  return Volume(std::shared_ptr<const void>(samples, samples->data()), sample_type_of<T>(), s.size, s.placement);
}

}  // namespace

std::vector<double> AnalyticField::roots(double level, const glm::dvec3& o, const glm::dvec3& d, double lower,
                                         double upper) const {
  const auto below = [&](double t) { return at(o + t * d).value < level; };
  std::vector<double> out;
  const double step = (upper - lower) / default_steps;
  bool previous = below(lower);
  for (int i = 1; i <= default_steps; i++) {
    double a = lower + (i - 1) * step, b = lower + i * step;
    const bool next = below(b);
    if (next != previous) {
      const bool start = previous;
      for (double middle = 0.5 * (a + b); middle > a && middle < b; middle = 0.5 * (a + b))
        (below(middle) == start ? a : b) = middle;
      out.push_back(0.5 * (a + b));
    }
    previous = next;
  }
  return out;
}

FieldPointer sphere_field(const glm::dvec3& center, double radius) { return std::make_shared<Sphere>(center, radius); }
FieldPointer cylinder_field(const glm::dvec3& point, const glm::dvec3& axis, double radius) {
  return std::make_shared<Cylinder>(point, axis, radius);
}
FieldPointer torus_field(const glm::dvec3& center, double ring_radius, double tube_radius) {
  return std::make_shared<Torus>(center, ring_radius, tube_radius);
}
FieldPointer marschner_lobb_field() { return std::make_shared<MarschnerLobb>(); }
FieldPointer layers_field(const glm::dvec3& k) { return std::make_shared<Layers>(k); }
FieldPointer polynomial_field(const std::array<double, 64>& coefficients, const glm::dmat3& to_unit,
                              const glm::dvec3& shift) {
  return std::make_shared<TrivariatePolynomial>(coefficients, to_unit, shift);
}

FieldPointer random_polynomial_field(int degree, glm::ivec3 size, const GridPlacement& placement, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::array<double, 64> c{};
  for (int k = 0; k <= degree; k++)
    for (int j = 0; j <= degree; j++)
      for (int i = 0; i <= degree; i++) c[std::size_t(i + 4 * j + 16 * k)] = uniform(random);
  // Index coordinates 0 … n-1 to -1 … 1.
  const glm::dvec3 half = glm::max(0.5 * glm::dvec3(size - 1), 0.5);
  const glm::dmat3 scale(1 / half.x, 0, 0, 0, 1 / half.y, 0, 0, 0, 1 / half.z);
  const glm::dmat3 to_unit = scale * glm::inverse(placement.axes);
  return polynomial_field(c, to_unit, -to_unit * placement.origin - glm::dvec3(1.0));
}

Volume sample(const AnalyticField& field, const Sampling& s) {
  std::vector<double> values;
  values.reserve(std::size_t(s.size.x) * std::size_t(s.size.y) * std::size_t(s.size.z));
  for (int k = 0; k < s.size.z; k++)
    for (int j = 0; j < s.size.y; j++)
      for (int i = 0; i < s.size.x; i++)
        values.push_back(field.at(s.placement.origin + s.placement.axes * glm::dvec3(i, j, k)).value);
  switch (s.type) {
    case SampleType::uint8:
      return sampled_as<std::uint8_t>(values, s);
    case SampleType::int8:
      return sampled_as<std::int8_t>(values, s);
    case SampleType::uint16:
      return sampled_as<std::uint16_t>(values, s);
    case SampleType::int16:
      return sampled_as<std::int16_t>(values, s);
    case SampleType::uint32:
      return sampled_as<std::uint32_t>(values, s);
    case SampleType::int32:
      return sampled_as<std::int32_t>(values, s);
    case SampleType::uint64:
      return sampled_as<std::uint64_t>(values, s);
    case SampleType::int64:
      return sampled_as<std::int64_t>(values, s);
    case SampleType::float32:
      return sampled_as<float>(values, s);
    case SampleType::float64:
      return sampled_as<double>(values, s);
  }
  throw std::logic_error("no such sample type");
}

GridPlacement centered(GridPlacement placement, glm::ivec3 size, const glm::dvec3& center) {
  placement.origin = center - placement.axes * (0.5 * glm::dvec3(size - 1));
  return placement;
}

GridPlacement sheared_placement(double step, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  // An orthonormal frame from two random directions, anisotropic steps, then a shear of up to a third.
  const glm::dvec3 a = glm::normalize(glm::dvec3(uniform(random), uniform(random), uniform(random) + 2));
  const glm::dvec3 b = glm::normalize(glm::cross(a, glm::dvec3(uniform(random) + 2, uniform(random), uniform(random))));
  const glm::dvec3 c = glm::cross(a, b) * (seed % 2 == 1 ? -1.0 : 1.0);
  const glm::dvec3 steps = step * glm::dvec3(1 + 0.4 * uniform(random), 1 + 0.4 * uniform(random), 1.5);
  const double xy = uniform(random) / 3, xz = uniform(random) / 3, yz = uniform(random) / 3;
  const glm::dmat3 shear(1, 0, 0, xy, 1, 0, xz, yz, 1);
  return {glm::dmat3(a * steps.x, b * steps.y, c * steps.z) * shear, glm::dvec3(uniform(random), 2.5, -1)};
}

}  // namespace smurf::test
