#include "expression/line_roots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "expression/series.hpp"

namespace smurf::expression {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double epsilon = std::numeric_limits<double>::epsilon();

constexpr int most_models = 64;                   // of one call of find,
constexpr std::size_t most_operations = 100'000;  // of long expressions
constexpr double least_part = 0x1p-20;            // of a model's stretch: bisection ends there
constexpr double split_at = 0.48828125;           // of a part: not in its middle, where roots of simple surfaces are
constexpr double shrinking = 0.7;                 // a part that is modelled again must be shorter by this factor
constexpr double least_stretch = 0x1p-20;         // of the whole: poles and jumps are followed so far
constexpr double float_rounding = 0x1p-26;        // of t: closer than this nobody can see

struct Model {
  enum class Kind { none, polynomial, unknown } kind = Kind::unknown;
  // Of s in [-1, 1]: the function is within error of the polynomial, its slope within slope_error of the polynomial's.
  std::array<double, 4> c{};
  double error = 0, slope_error = 0;
  double rounding = 0;  // what of the error is rounding: shorter stretches do not lessen it
};

struct Stretch {
  double low, high;
  bool low_certain, high_certain;  // the function has a certain sign at the end
};

struct Part {
  double low, high;  // of s
  enum class Kind { one, open } kind;
  bool low_certain, high_certain;
  double slope;  // of one: the flattest there, with its sign
};

// Polar form of the polynomial: its Bernstein coefficients on any part.
double polar(const std::array<double, 4>& c, double u, double v, double w) {
  return c[0] + c[1] * ((u + v + w) / 3) + c[2] * ((u * v + u * w + v * w) / 3) + c[3] * (u * v * w);
}
double slope_polar(const std::array<double, 4>& c, double u, double v) {
  return c[1] + c[2] * (u + v) + 3 * c[3] * (u * v);
}

int sign_of(double value, double error) { return value > error ? 1 : value < -error ? -1 : 0; }

// Bisects a model's polynomial into parts in order; parts without a root are left out, open ones that touch are joined.
class Bisection {
 public:
  explicit Bisection(const Model& model) : c_(model.c), error_(model.error), slope_error_(model.slope_error) {}

  // The slope that is nearest to 0 on a part, with its sign; 0 where it may have both.
  double flattest(double low, double high) const {
    const auto [least, most] =
        std::minmax({slope_polar(c_, low, low), slope_polar(c_, low, high), slope_polar(c_, high, high)});
    return least > slope_error_ ? least - slope_error_ : most < -slope_error_ ? most + slope_error_ : 0;
  }

  std::vector<Part> parts(bool low_certain, bool high_certain) {
    parts_.clear();
    split(-1, 1);
    for (Part& part : parts_) {
      if (part.kind == Part::Kind::one) continue;
      part.low_certain = part.low > -1 || low_certain || sign_at(-1) != 0;
      part.high_certain = part.high < 1 || high_certain || sign_at(1) != 0;
    }
    return parts_;
  }

 private:
  int sign_at(double s) const { return sign_of(polar(c_, s, s, s), error_); }

  void split(double low, double high) {
    const std::array<double, 4> b = {polar(c_, low, low, low), polar(c_, low, low, high), polar(c_, low, high, high),
                                     polar(c_, high, high, high)};
    const auto [least, most] = std::minmax_element(b.begin(), b.end());
    if (*least > error_ || *most < -error_) return;
    const int first = sign_of(b[0], error_), last = sign_of(b[3], error_);
    if (first * last != 0) {
      const double slope = flattest(low, high);
      if (slope != 0 && first == last) return;
      if (slope != 0) return parts_.push_back({low, high, Part::Kind::one, true, true, slope});
    }
    const bool within = *least >= -error_ && *most <= error_;
    if (within || high - low < 2 * least_part) {
      open(low, high);
      return;
    }
    const double middle = low + split_at * (high - low);
    split(low, middle);
    split(middle, high);
  }

  void open(double low, double high) {
    if (!parts_.empty() && parts_.back().kind == Part::Kind::open && parts_.back().high == low) {
      parts_.back().high = high;
    } else {
      parts_.push_back({low, high, Part::Kind::open, false, false, 0});
    }
  }

  const std::array<double, 4>& c_;
  const double error_, slope_error_;
  std::vector<Part> parts_;
};

// The work on one line.
class Line {
 public:
  Line(const Program& program, double level, const glm::dvec3& origin, const glm::dvec3& direction, double low,
       double high, std::vector<LineRoot>& roots)
      : program_(program),
        level_(level),
        origin_(origin),
        direction_(direction),
        roots_(roots),
        shortest_(std::max(least_stretch * (high - low), float_rounding * std::max(std::abs(low), std::abs(high)))),
        most_models_(std::clamp(int(most_operations / program.nodes.size()), 6, most_models)) {}

  void settle(const Stretch& stretch) {
    const double length = stretch.high - stretch.low;
    if (models_ >= most_models_) return report(stretch);
    const double middle = stretch.low + 0.5 * length;
    const double half = std::nextafter(std::max(stretch.high - middle, middle - stretch.low), infinity);
    const Model model = model_of(middle, half);
    if (model.kind == Model::Kind::none) return;
    if (model.kind == Model::Kind::unknown) return halve(stretch);
    for (const Part& part : Bisection(model).parts(stretch.low_certain, stretch.high_certain)) {
      const Stretch place{std::max(stretch.low, middle + part.low * half),
                          std::min(stretch.high, middle + part.high * half), part.low_certain, part.high_certain};
      if (part.kind == Part::Kind::one) {
        refine(model, part, middle, half);
      } else if (place.high - place.low < shrinking * length) {
        settle(place);
      } else if (model.rounding < 0.5 * model.error) {
        halve(place);  // the model can be better
      } else {
        report(place);
      }
    }
  }

 private:
  // At one place, of t = at + half s.
  Series series_at(double at, double half) { return with_level(evaluate(program_, points(at, at, half), middle_)); }
  // All over the stretch about the latest place.
  Series series_over(double low, double high, double half) {
    return with_level(evaluate(program_, points(low, high, half), middle_, over_));
  }
  Series with_level(Series f) const {
    f.at[0] = f.at[0] + Bound{-level_, -level_};
    return f;
  }
  // All points of the line with t in [low, high].
  std::span<const Series> points(double low, double high, double half) {
    const Bound along{low, high};
    for (int axis = 0; axis < 3; axis++) {
      Series& x = variables_[std::size_t(axis)];
      const Bound start{origin_[axis], origin_[axis]}, slope{direction_[axis], direction_[axis]};
      x.at[0] = start + along * slope;
      x.at[1] = Bound{half, half} * slope;
    }
    return std::span(variables_).first(std::size_t(program_.variables));
  }

  // Of t = middle + half s.
  Model model_of(double middle, double half) {
    models_++;
    Model model;
    const Series here = series_at(middle, half);
    const Series all =
        series_over(std::nextafter(middle - half, -infinity), std::nextafter(middle + half, infinity), half);
    if (all.nowhere || !all.at[0].contains_zero()) {
      model.kind = Model::Kind::none;
      return model;
    }
    if (!all.defined || !all.continuous || !all.at[1].is_finite()) return model;
    std::array<Bound, 4> c{here.at[0], all.at[1]};
    double rest = 0, slope_rest = 0;
    if (all.at[series_order].is_finite()) {
      std::copy_n(here.at.begin(), 4, c.begin());
      rest = all.at[series_order].magnitude();
      slope_rest = series_order * rest;
    }
    double terms = 0, slope_terms = 0, sizes = 0;
    const bool linear = !all.at[series_order].is_finite();
    for (std::size_t k = 0; k < c.size(); k++) {
      if (!c[k].is_finite()) return model;
      model.c[k] = 0.5 * c[k].low + 0.5 * c[k].high;
      const double radius = std::max(c[k].high - model.c[k], model.c[k] - c[k].low);
      (linear && k == 1 ? rest : terms) += radius;  // a slope over the stretch is no matter of rounding
      slope_terms += double(k) * radius;
      sizes += double(k + 1) * std::abs(model.c[k]);
    }
    // What the polynomial's own values are rounded by.
    const double rounding = 32 * epsilon * sizes + std::numeric_limits<double>::min();
    constexpr double outward = 1 + 32 * epsilon;
    model.rounding = (terms + rounding) * outward;
    model.error = (terms + rest + rounding) * outward;
    model.slope_error = (slope_terms + slope_rest + rounding) * outward;
    model.kind = std::isfinite(model.error + model.slope_error) ? Model::Kind::polynomial : Model::Kind::unknown;
    return model;
  }

  // On to shorter models, split where the sign is certain.
  void halve(const Stretch& stretch) {
    const double length = stretch.high - stretch.low;
    if (length > shortest_ && models_ + 2 <= most_models_) {
      for (const double part : {split_at, 0.34, 0.67}) {
        const double at = stretch.low + part * length;
        const Series here = series_at(at, 0);
        if (!(at > stretch.low && at < stretch.high)) break;
        if (!here.defined || here.at[0].contains_zero()) continue;
        settle({stretch.low, at, stretch.low_certain, true});
        settle({at, stretch.high, true, stretch.high_certain});
        return;
      }
    }
    report(stretch);
  }

  void report(const Stretch& stretch) {
    const auto kind =
        stretch.low_certain && stretch.high_certain ? LineRoot::Kind::touching : LineRoot::Kind::undecided;
    // What touches is one: so it is where the models are used up.
    if (!roots_.empty() && roots_.back().kind != LineRoot::Kind::one && roots_.back().high == stretch.low) {
      roots_.back().high = stretch.high;
      roots_.back().kind = std::max(roots_.back().kind, kind);
    } else {
      roots_.push_back({stretch.low, stretch.high, kind});
    }
  }

  struct Enclosure {
    double low, high;
    double middle() const { return low + 0.5 * (high - low); }
    double half() const { return std::nextafter(std::max(high - middle(), middle() - low), infinity); }
  };

  // The root of a part that holds exactly one, as closely as floats can say.
  void refine(const Model& model, const Part& part, double middle, double half) {
    Enclosure e = root_of(model, part, middle, half);
    const auto shrinks = [&](const Enclosure& next) { return next.high - next.low < shrinking * (e.high - e.low); };
    while (e.high - e.low > float_rounding * std::max(std::abs(e.low), std::abs(e.high)) && models_ < most_models_) {
      const Model close = model_of(e.middle(), e.half());
      const double slope = close.kind == Model::Kind::polynomial ? Bisection(close).flattest(-1, 1) : 0;
      Enclosure next = e;
      if (slope != 0) next = root_of(close, {-1, 1, Part::Kind::one, true, true, slope}, e.middle(), e.half());
      if (!shrinks(next)) next = halved(e, part.slope > 0);
      if (!shrinks(next)) break;
      e = {std::max(e.low, next.low), std::min(e.high, next.high)};
    }
    roots_.push_back({e.low, e.high, LineRoot::Kind::one});
  }

  // By the model: where its polynomial vanishes, and how far off the function can do so.
  static Enclosure root_of(const Model& model, const Part& part, double middle, double half) {
    const double s = polynomial_root(model, part);
    const double off = (model.error + std::abs(polar(model.c, s, s, s))) / std::abs(part.slope) + 4 * epsilon;
    return {std::nextafter(middle + std::max(part.low, s - off) * half, -infinity),
            std::nextafter(middle + std::min(part.high, s + off) * half, infinity)};
  }

  // By the sign in the middle, if it is certain.
  Enclosure halved(const Enclosure& e, bool rising) {
    const Series here = series_at(e.middle(), 0);
    if (!here.defined || here.at[0].contains_zero()) return e;
    return (here.at[0].low > 0) == rising ? Enclosure{e.low, e.middle()} : Enclosure{e.middle(), e.high};
  }

  // Newton's method, kept between ends of different sign.
  static double polynomial_root(const Model& model, const Part& part) {
    double low = part.low, high = part.high, s = 0.5 * (low + high);
    for (int i = 0; i < 100 && high - low > 2 * epsilon; i++) {
      const double value = polar(model.c, s, s, s), slope = slope_polar(model.c, s, s);
      ((value < 0) == (part.slope > 0) ? low : high) = s;
      const double newton = s - value / slope;
      const bool inside = newton > low && newton < high && i % 4 != 3;  // now and then by bisection
      const double next = inside ? newton : 0.5 * (low + high);
      if (inside && std::abs(next - s) < 2 * epsilon) return next;
      s = next;
    }
    return s;
  }

  const Program& program_;
  const double level_;
  const glm::dvec3 origin_, direction_;
  std::vector<LineRoot>& roots_;
  std::array<Series, 3> variables_;
  std::vector<Series> middle_, over_;  // of each node
  const double shortest_;
  const int most_models_;
  int models_ = 0;
};

Program program_of(const Graph& graph, NodeId f) {
  const std::array<NodeId, 1> roots{f};
  return make_program(graph, roots);
}

}  // namespace

LineRoots::LineRoots(const Graph& graph, NodeId f, double level) : program_(program_of(graph, f)), level_(level) {}

void LineRoots::find(const glm::dvec3& origin, const glm::dvec3& direction, double low, double high,
                     std::vector<LineRoot>& roots) const {
  if (low <= high) Line(program_, level_, origin, direction, low, high, roots).settle({low, high, false, false});
}

}  // namespace smurf::expression
