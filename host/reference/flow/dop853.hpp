// One step of Dormand and Prince's method of order 8 with an error estimate of orders 5 and 3, and dense output of
// order 7 (Hairer, Nørsett, Wanner 1993, II.5, II.6), for y' = f(y) in four dimensions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>

namespace smurf {

namespace dop853 {

// Row 12 gives the result; rows 13 to 15 are stages of the dense output alone.
extern const std::array<std::array<double, 15>, 16> stage;
extern const std::array<double, 12> fifth;  // weights of the error of fifth order
extern const std::array<double, 12> third;  // weights of the embedded method of third order
extern const std::array<std::array<double, 16>, 4> dense;

}  // namespace dop853

class Dop853Step {
 public:
  using State = glm::dvec4;

  // `f(y, slope)` gives false where it has no value; so does this. `slope` is that at y.
  template <class F>
  bool take(const F& f, const State& y, const State& slope, double h) {
    start_ = y;
    h_ = h;
    slopes_[0] = slope;
    for (int i = 1; i < 12; i++)
      if (!f(stage_at(i), slopes_[std::size_t(i)])) return false;
    end_ = stage_at(12);
    return f(end_, slopes_[12]);
  }

  // Of the first three components, in units of `scale`: no more than 1 where the step will do.
  double error(double scale) const {
    State fifth(0.0), third(0.0), result(0.0);
    for (std::size_t i = 0; i < 12; i++) {
      fifth += dop853::fifth[i] * slopes_[i];
      third += dop853::third[i] * slopes_[i];
      result += dop853::stage[12][i] * slopes_[i];
    }
    third = result - third;
    const double five = glm::length(glm::dvec3(fifth)) / scale, three = glm::length(glm::dvec3(third)) / scale;
    if (five == 0) return 0;
    return std::abs(h_) * five * five / std::sqrt(five * five + 0.01 * three * three);
  }

  // Makes at() ready.
  template <class F>
  bool densify(const F& f) {
    for (int i = 13; i < 16; i++)
      if (!f(stage_at(i), slopes_[std::size_t(i)])) return false;
    const State change = end_ - start_;
    terms_[0] = change;
    terms_[1] = h_ * slopes_[0] - change;
    terms_[2] = 2.0 * change - h_ * (slopes_[12] + slopes_[0]);
    for (std::size_t k = 0; k < 4; k++) {
      State sum(0.0);
      for (std::size_t i = 0; i < 16; i++) sum += dop853::dense[k][i] * slopes_[i];
      terms_[k + 3] = h_ * sum;
    }
    return true;
  }

  // theta: 0 at the start, 1 at the end.
  State at(double theta) const {
    State y(0.0);
    for (int k = 6; k >= 0; k--) y = (y + terms_[std::size_t(k)]) * (k % 2 == 0 ? theta : 1 - theta);
    return start_ + y;
  }

  const State& start() const { return start_; }
  const State& end() const { return end_; }
  const State& end_slope() const { return slopes_[12]; }
  double length() const { return h_; }

 private:
  State stage_at(int i) const {
    State sum(0.0);
    const auto& row = dop853::stage[std::size_t(i)];
    for (std::size_t j = 0; j < std::size_t(std::min(i, 15)); j++)
      if (row[j] != 0) sum += row[j] * slopes_[j];
    return start_ + h_ * sum;
  }

  State start_{0.0}, end_{0.0};
  double h_ = 0;
  std::array<State, 16> slopes_{};
  std::array<State, 7> terms_{};
};

}  // namespace smurf
