#include "reference/implicit/roots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "reference/implicit/function_on_ray.hpp"

namespace smurf {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

constexpr double fit = 1e-10;      // of the scale: less than the tolerance, so that a pair of roots is not lost
constexpr double smallest = 1e-9;  // piece, of the span
constexpr double plateau = 1e-3;   // of the span
constexpr int polynomial_pieces = 16, function_pieces = 256;
constexpr int most_pieces = 1 << 16;
// In a rough piece: |f| below this part of its greatest value is on the surface; a kink gets far below it.
constexpr double rough_band = 1e-5;

int sign_of(double v) { return v < 0 ? -1 : 1; }

// What a stretch [a, b] of the ray is judged by.
struct Scales {
  double band;    // |f| up to this is on the surface
  double noise;   // f is not known better than this
  bool doubtful;  // f need not be monotone between its samples
};

// A part [a, b] of the ray, of which the ends tell all: f is monotone between.
struct Part {
  const FunctionOnRay& f;
  const Scales& scales;
  double a, b, fa, fb;

  // Where f is `level`; the nearer end when it is not between fa and fb.
  double at_level(double level) const {
    if ((fa < level) == (fb < level)) return std::abs(fa - level) <= std::abs(fb - level) ? a : b;
    const double u = bracketed_root(
        [&](double u) {
          const double v = f(u) - level;
          return std::isnan(v) ? 0.0 : v;
        },
        a, b, fa - level, fb - level);
    return std::clamp(u, a, b);
  }
  int direction() const { return std::abs(fb - fa) <= scales.noise ? 0 : sign_of(fb - fa); }
};

// Takes the parts of a ray in order and makes hits of them, and margins.
class HitMaker {
 public:
  HitMaker(const FunctionOnRay& f, bool first_only, std::vector<ReferenceHit>& hits)
      : f_(f), first_only_(first_only), hits_(hits), first_hit_(hits.size()) {}

  FunctionRoots::Margins margins{infinity, infinity};
  bool finished() const { return first_only_ && hits_.size() > first_hit_; }

  // Here the domain, or where f is undefined, begins or ends.
  void gap(double u) {
    if (on_surface_) leave(0, u, infinity);
    if (!after_gap_) margins.end = std::min(margins.end, relative(last_value_, last_));
    sign_ = direction_ = 0;
    margin_ = infinity;
    after_gap_ = true;
  }

  void part(const Part& p) {
    if (after_gap_) margins.end = std::min(margins.end, relative(p.fa, p.a));
    after_gap_ = false;
    last_ = p.b;
    last_value_ = p.fb;

    const double band = p.scales.band;
    const bool begins_on = std::abs(p.fa) <= band, ends_on = std::abs(p.fb) <= band;
    if (begins_on && !on_surface_) enter(p.a, last_band_);
    if (!begins_on) arrive(sign_of(p.fa), p.a, band);
    last_band_ = band;
    if (on_surface_) stretch_.doubtful |= p.scales.doubtful;
    turn(p);
    if (!begins_on && !ends_on && sign_of(p.fa) != sign_of(p.fb)) {
      cross(p);
    } else if (!begins_on && ends_on) {
      sign_ = sign_of(p.fa);
      enter(p.at_level(sign_ * band), band);
      stretch_.doubtful = p.scales.doubtful;
    }
    if (on_surface_) note(p);
    if (!ends_on) {
      sign_ = sign_of(p.fb);
      if (on_surface_) leave(sign_, p.at_level(sign_ * band), band);
    }
  }

 private:
  struct Root {
    double u, error;  // in u
    double slope;     // in t
  };
  // A stretch of the ray on the surface, up to now.
  struct Stretch {
    double begin;
    int sign_before;        // 0 when it began with a gap
    double nearest, least;  // the u with the least |f| so far, and that |f|
    double band;            // of the part before it, which was off the surface
    bool turned = false;    // has an extremum
    bool doubtful = false;
    std::optional<Root> root;
  };

  double relative(double value, double u) const {
    const double noise = f_.noise(u);
    if (value == 0 || std::abs(value) <= noise) return 0;
    return noise > 0 ? std::abs(value) / (noise / epsilon) : 1;
  }

  // Comes to a place off the surface on this side.
  void arrive(int sign, double u, double band) {
    if (on_surface_) {
      leave(sign, u, band);
    } else if (sign_ != 0 && sign_ != sign) {  // not even the same u gives the same f
      add(u, epsilon, HitStatus::unresolved, 0, 0);
    }
    sign_ = sign;
  }

  void enter(double u, double band) {
    on_surface_ = true;
    stretch_ = {};
    stretch_.begin = stretch_.nearest = u;
    stretch_.sign_before = sign_;
    stretch_.least = infinity;
    stretch_.band = band;
  }

  void turn(const Part& p) {
    const int direction = p.direction();
    if (direction == 0) return;
    if (direction_ != 0 && direction != direction_) {
      margin_ = relative(p.fa, p.a);
      margins.extremum = std::min(margins.extremum, margin_);
      if (hits_.size() > first_hit_) hits_.back().margin = std::min(hits_.back().margin, margin_);
      if (on_surface_) stretch_.turned = true;
    }
    direction_ = direction;
  }

  Root root_of(const Part& p) const {
    const double u = p.at_level(0);
    double slope = f_.slope(u);
    if (std::isnan(slope)) slope = p.b > p.a && f_.length() > 0 ? (p.fb - p.fa) / ((p.b - p.a) * f_.length()) : 0;
    double noise = f_.noise(u);
    if (std::isnan(noise)) noise = p.scales.noise;
    double error = noise / std::abs(slope * f_.length());
    // Where the slope does not tell (it vanishes in triple roots), the function does.
    if (!(error <= 1e-3 * (p.b - p.a))) {
      error = 0;
      for (const double level : {-noise, noise}) error = std::max(error, std::abs(p.at_level(level) - u));
    }
    return {u, error, slope};
  }

  void cross(const Part& p) {
    const Root root = root_of(p);
    if (p.scales.doubtful) {
      add(root.u, std::max(root.u - p.a, p.b - root.u), HitStatus::unresolved, root.slope, 0);
    } else {
      add(root.u, root.error, HitStatus::isolated, root.slope, margin_);
    }
  }

  // Keeps what a part on the surface tells about the roots of the stretch.
  void note(const Part& p) {
    for (const auto& [u, f] : {std::pair(p.a, p.fa), std::pair(p.b, p.fb)}) {
      if (std::abs(f) >= stretch_.least) continue;
      stretch_.least = std::abs(f);
      stretch_.nearest = u;
    }
    if (!stretch_.root && (p.fa < 0) != (p.fb < 0)) stretch_.root = root_of(p);
  }

  // The stretch ends at u; `sign` is that of f beyond, 0 for a gap, and `band` that of the part beyond.
  void leave(int sign, double u, double band) {
    on_surface_ = false;
    const Stretch& s = stretch_;
    const bool closed = s.sign_before != 0 && sign != 0, single = !s.turned && !s.doubtful;
    // The end of a coarse piece, which a finer one next to it knows to be off the surface.
    if (closed && s.sign_before == sign && single && s.least > std::min(s.band, band)) return;
    if (closed && s.sign_before != sign && single && s.root) {
      add(s.root->u, std::min(s.root->error, u - s.begin), HitStatus::isolated, s.root->slope, margin_);
      return;
    }
    const bool flat = u - s.begin > plateau;
    double at = s.root && !s.turned ? s.root->u : s.nearest;
    if (flat) at = 0.5 * (s.begin + u);
    at = std::clamp(at, s.begin, u);
    const double slope = f_.slope(at);
    add(at, std::max(at - s.begin, u - at), closed && !flat && !s.doubtful ? HitStatus::tangent : HitStatus::unresolved,
        std::isnan(slope) ? 0 : slope, 0);
  }

  void add(double u, double error, HitStatus status, double slope, double margin) {
    const double t = f_.t(u);
    hits_.push_back({t, error * f_.length() + 4 * epsilon * std::abs(t), status, slope, margin});
  }

  const FunctionOnRay& f_;
  const bool first_only_;
  std::vector<ReferenceHit>& hits_;
  const std::size_t first_hit_;
  int sign_ = 0;              // of f where the traversal has come to; 0 after a gap
  int direction_ = 0;         // in which f last moved; 0 when unknown
  double margin_ = infinity;  // at the last extremum
  bool after_gap_ = true;
  double last_ = 0, last_value_ = 0, last_band_ = 0;
  bool on_surface_ = false;
  Stretch stretch_{};
};

// Cuts a ray into pieces and hands on the parts of each.
class Traversal {
 public:
  Traversal(const FunctionOnRay& f, double tolerance, HitMaker& out)
      : f_(f), points_(f.compiled().points), tolerance_(tolerance), out_(out) {}

  void run() {
    const int count = f_.compiled().polynomial ? polynomial_pieces : function_pieces;
    for (int i = 0; i < count; i++) {
      todo_.assign(1, {double(i) / count, double(i + 1) / count});
      while (!todo_.empty()) {
        if (out_.finished()) return;
        const auto [a, b] = todo_.back();
        todo_.pop_back();
        piece(a, b);
      }
    }
    out_.gap(1);
  }

 private:
  void piece(double a, double b) {
    pieces_++;
    const bool last = b - a <= smallest || pieces_ > most_pieces;
    const int n = points_.degree();
    int undefined = 0;
    for (int j = 0; j <= n; j++) {
      const double s = points_[j];
      at_[j] = j == 0 ? a : j == n ? b : a + 0.5 * (1 + s) * (b - a);
      values_[j] = f_(at_[j]);
      undefined += std::isnan(values_[j]);
    }
    if (undefined == n + 1 || (undefined > 0 && last)) return out_.gap(a);
    if (undefined == 0 && take_up(a, b)) return smooth(a, b);
    if (last) return rough();
    if (undefined == 0 && far(a, b)) return out_.part({f_, scales_, a, b, values_[0], values_[n]});
    const double middle = 0.5 * (a + b);
    todo_.push_back({middle, b});
    todo_.push_back({a, middle});
  }

  // Whether f is on one side, whatever keeps it from being a series.
  bool far(double a, double b) {
    scales_ = {0, 0, false};
    const int n = points_.degree();
    for (int j = 1; j <= n; j++) {
      if ((values_[j] < 0) != (values_[0] < 0)) return false;
    }
    const expression::Interval bounds = f_.bounds(a, b);
    return bounds.defined && !bounds.contains(0);
  }

  // Makes the series of the piece; false when it is none.
  bool take_up(double a, double b) {
    std::array<double, greatest_whole_degree + 1> coefficients{};
    points_.coefficients(values_.data(), coefficients.data());
    series_ = Chebyshev(std::min(points_.degree(), Chebyshev::max_degree), coefficients.data()).trimmed();
    double beyond = 0;
    for (int k = Chebyshev::max_degree + 1; k <= points_.degree(); k++) beyond += std::abs(coefficients[k]);
    const double scale = series_.sum() + beyond;
    scales_ = {tolerance_ * scale, -1, false};
    if (!agrees(beyond, scale, a, b)) return false;
    if (!f_.compiled().polynomial) {
      // Away from the nodes, and without their symmetry.
      for (const double s : {0.013, -0.61, 0.58, -0.947, 0.936, -0.24, 0.29, 0.992}) {
        const double value = f_(a + 0.5 * (1 + s) * (b - a));
        if (std::isnan(value) || !agrees(std::abs(value - series_(s)), scale, a, b)) return false;
      }
    }
    find_noise(a, b);
    scales_.band = std::max(scales_.band, scales_.noise);
    return true;
  }

  bool agrees(double difference, double scale, double a, double b) {
    if (difference <= fit * scale) return true;
    find_noise(a, b);
    return difference <= 16 * scales_.noise;
  }

  // The median of three, because next to a step or a pole it may be anything.
  void find_noise(double a, double b) {
    if (scales_.noise >= 0) return;
    std::array<double, 3> noise{};
    int i = 0;
    for (const double part : {0.1873, 0.5319, 0.8241}) {
      const double found = f_.noise(a + part * (b - a));
      noise[i++] = std::isnan(found) ? 0 : found;
    }
    std::sort(noise.begin(), noise.end());
    scales_.noise = noise[1];
  }

  void smooth(double a, double b) {
    const Chebyshev::Points turning = series_.derivative().sign_changes();
    double from = a, value = values_[0];
    for (int i = 0; i <= turning.count && !out_.finished(); i++) {
      const bool end = i == turning.count;
      const double to = end ? b : std::clamp(a + 0.5 * (1 + turning.at[i]) * (b - a), from, b);
      double next = end ? values_[points_.degree()] : f_(to);
      if (std::isnan(next)) next = series_(turning.at[i]);
      out_.part({f_, scales_, from, to, value, next});
      from = to;
      value = next;
    }
  }

  // A piece with a kink, a step, a pole, or more than there was time for.
  void rough() {
    const int n = points_.degree();
    int changes = 0, least = 0;
    for (int j = 0; j <= n; j++) {
      if (std::isnan(values_[j])) return out_.gap(at_[0]);
      if (j > 0) changes += (values_[j] < 0) != (values_[j - 1] < 0);
      if (std::abs(values_[j]) < std::abs(values_[least])) least = j;
    }
    scales_.noise = -1;
    find_noise(at_[0], at_[n]);
    // Next to a pole values have no bounds, across a step the rounding has none: the lesser end is what can be trusted.
    const double size = std::min(std::abs(values_[0]), std::abs(values_[n]));
    scales_.noise = std::min(scales_.noise, std::abs(values_[0] - values_[n]));
    scales_.band = std::max(rough_band * size, scales_.noise);
    scales_.doubtful = changes > 1 || pieces_ > most_pieces;
    // Where a crease may touch the surface without a change of sign, its tip is between the samples.
    double tip = nan, tip_value = 0;
    if (changes == 0 && least > 0 && least < n) std::tie(tip, tip_value) = lowest(at_[least - 1], at_[least + 1]);
    for (int j = 1; j <= n && !out_.finished(); j++) {
      if (tip > at_[j - 1] && tip < at_[j]) {
        rough_part(at_[j - 1], tip, values_[j - 1], tip_value);
        rough_part(tip, at_[j], tip_value, values_[j]);
      } else {
        rough_part(at_[j - 1], at_[j], values_[j - 1], values_[j]);
      }
    }
  }

  void rough_part(double a, double b, double fa, double fb) {
    if ((fa < 0) == (fb < 0)) return out_.part({f_, scales_, a, b, fa, fb});
    double low = a, high = b, flow = fa, fhigh = fb;
    for (;;) {
      const double middle = 0.5 * (low + high);
      if (!(middle > low && middle < high)) break;
      const double value = f_(middle);
      if (std::isnan(value)) return out_.gap(middle);
      if ((value < 0) == (flow < 0)) {
        low = middle, flow = value;
      } else {
        high = middle, fhigh = value;
      }
    }
    const double left = std::max(std::abs(flow), std::abs(fhigh)), greatest = std::max(std::abs(fa), std::abs(fb));
    if (left > std::max(0.1 * greatest, scales_.noise)) {  // does not go to zero
      out_.gap(low);
      return;
    }
    out_.part({f_, scales_, a, b, fa, fb});
  }

  // The least |f| between, where it has one minimum, by golden sections.
  std::pair<double, double> lowest(double a, double b) const {
    constexpr double golden = 0.6180339887498949;
    const auto size = [this](double u) {
      const double v = f_(u);
      return std::isnan(v) ? infinity : std::abs(v);
    };
    double c = b - golden * (b - a), d = a + golden * (b - a), fc = size(c), fd = size(d);
    for (int i = 0; i < 60; i++) {
      if (fc < fd) {
        b = d, d = c, fd = fc;
        c = b - golden * (b - a), fc = size(c);
      } else {
        a = c, c = d, fc = fd;
        d = a + golden * (b - a), fd = size(d);
      }
    }
    const double at = fc < fd ? c : d, value = f_(at);
    return std::isnan(value) ? std::pair(nan, nan) : std::pair(at, value);
  }

  const FunctionOnRay& f_;
  const ChebyshevPoints& points_;
  const double tolerance_;
  HitMaker& out_;
  std::vector<std::pair<double, double>> todo_;
  int pieces_ = 0;
  // Of the piece that the traversal is at.
  std::array<double, greatest_whole_degree + 1> at_{}, values_{};
  Chebyshev series_;
  Scales scales_{};
};

}  // namespace

FunctionRoots::FunctionRoots(std::shared_ptr<const ImplicitFunction> function, const Domain& domain, double level,
                             double tolerance)
    : FunctionRoots(std::make_shared<const CompiledFunction>(std::move(function)), domain, level, tolerance) {}

FunctionRoots FunctionRoots::with(const Domain& domain, double level) const {
  return {compiled_, domain, level, tolerance_};
}

const std::shared_ptr<const ImplicitFunction>& FunctionRoots::function() const { return compiled_->function; }

std::size_t FunctionRoots::bytes() const { return compiled_->bytes; }

void FunctionRoots::find(const ReferenceRay& ray, bool first_only, std::vector<ReferenceHit>& hits) const {
  if (const auto f = FunctionOnRay::clipped(*compiled_, domain_, level_, ray)) {
    HitMaker maker(*f, first_only, hits);
    Traversal(*f, tolerance_, maker).run();
  }
}

FunctionRoots::Margins FunctionRoots::margins(const ReferenceRay& ray) const {
  const auto f = FunctionOnRay::clipped(*compiled_, domain_, level_, ray);
  if (!f) return {infinity, infinity};
  std::vector<ReferenceHit> hits;
  HitMaker maker(*f, false, hits);
  Traversal(*f, tolerance_, maker).run();
  return maker.margins;
}

}  // namespace smurf
