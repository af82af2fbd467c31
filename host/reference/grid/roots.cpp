#include "reference/grid/roots.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "reference/grid/traversal.hpp"

namespace smurf {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();
// Rounding of f relative to the scale: differences below it tell nothing about a direction.
constexpr double rounding = 1e-13;
// A stretch on the surface longer than this many cells is a plateau rather than a tangent.
constexpr double plateau_length = 0.01;

int sign_of(double v) { return v < 0 ? -1 : 1; }

double relative(double f, const RaySpan& span) { return std::abs(f) > span.rounding ? std::abs(f) / span.scale : 0; }

// A part [a, b] of a span, in its parameter s, on which f is monotone.
struct Piece {
  const RaySpan& span;
  double a, b, fa, fb;
  double t(double s) const { return span.middle + span.half * s; }
  // Where f is `level`, which lies between fa and fb.
  double at_level(double level) const {
    return bracketed_root([&](double s) { return span.f(s) - level; }, a, b, fa - level, fb - level);
  }
  int direction() const { return std::abs(fb - fa) <= rounding * span.scale ? 0 : sign_of(fb - fa); }
};

// Splits a span at its extrema; calls visit(piece) in order.
template <class Visit>
void for_monotone_pieces(const RaySpan& span, const Visit& visit) {
  const Chebyshev::Points turning = span.f.derivative().sign_changes();
  double a = -1, fa = span.f(a);
  for (int i = 0; i <= turning.count; i++) {
    const double b = i < turning.count ? turning.at[i] : 1.0;
    const double fb = span.f(b);
    visit(Piece{span, a, b, fa, fb});
    a = b;
    fa = fb;
  }
}

class RootVisitor : public RayVisitor {
 public:
  RootVisitor(double tolerance, double cells_per_t, bool first_only, std::vector<ReferenceHit>& hits)
      : tolerance_(tolerance),
        cells_per_t_(cells_per_t),
        first_only_(first_only),
        hits_(hits),
        first_hit_(hits.size()) {}

  double clear_above() const override { return tolerance_; }
  bool finished() const override { return first_only_ && hits_.size() > first_hit_; }

  void clear(int sign, double t) override {
    arrive(sign, t);
    sign_ = sign;
    direction_ = 0;
    margin_ = infinity;
  }

  void gap(double t) override {
    if (on_surface_) leave(0, t);
    sign_ = direction_ = 0;
    margin_ = infinity;
  }

  void span(const RaySpan& span) override {
    if (span.f.distance_from_zero() > band(span)) return clear(sign_of(span.f.constant()), span.begin());
    for_monotone_pieces(span, [this](const Piece& piece) {
      if (!finished()) this->piece(piece);
    });
  }

 private:
  // A stretch of the ray on the surface, up to now.
  struct Stretch {
    double begin;
    int sign_before;        // 0 when it began with a gap
    double nearest, least;  // the t with the least |f| so far, and that |f|
    double slope = 0;       // at `nearest`
    bool turned = false;    // has an extremum
    bool crossed = false;   // `root` was found
    double root = 0, root_slope = 0, root_error = 0;
  };

  // |f| up to this is on the surface.
  double band(const RaySpan& span) const { return std::max(tolerance_ * span.scale, span.rounding); }

  void piece(const Piece& p) {
    const double band = this->band(p.span);
    const bool begins_on = std::abs(p.fa) <= band, ends_on = std::abs(p.fb) <= band;
    if (begins_on && !on_surface_) enter(p.t(p.a));
    if (!begins_on) arrive(sign_of(p.fa), p.t(p.a));
    turn(p);
    if (!begins_on && !ends_on && sign_of(p.fa) != sign_of(p.fb)) {
      cross(p);
    } else if (!begins_on && ends_on) {
      sign_ = sign_of(p.fa);
      enter(p.t(p.at_level(sign_ * band)));
    }
    if (on_surface_) note(p);
    if (!ends_on) {
      sign_ = sign_of(p.fb);
      if (on_surface_) leave(sign_, p.t(p.at_level(sign_ * band)));
    }
  }

  // Comes to a place at t that is off the surface on this side.
  void arrive(int sign, double t) {
    if (on_surface_) {
      leave(sign, t);
    } else if (sign_ != 0 && sign_ != sign) {
      // Neighbouring spans disagree by more than the tolerance: only where t itself is too coarse.
      add({t, epsilon * std::abs(t), HitStatus::unresolved, 0, 0});
    }
    sign_ = sign;
  }

  void enter(double t) {
    on_surface_ = true;
    stretch_ = {t, sign_, t, infinity};
  }

  void turn(const Piece& p) {
    const int direction = p.direction();
    if (direction == 0) return;
    if (direction_ != 0 && direction != direction_) {
      margin_ = relative(p.fa, p.span);
      if (hits_.size() > first_hit_) hits_.back().margin = std::min(hits_.back().margin, margin_);
      if (on_surface_) stretch_.turned = true;
    }
    direction_ = direction;
  }

  double root_error(const Piece& p, double s, double slope) const {
    const double value = 32 * epsilon * p.span.scale / std::max(std::abs(slope), 1e-300);
    return std::min(value, p.span.half * (p.b - p.a)) + 4 * epsilon * std::abs(p.t(s));
  }
  static double slope_at(const Piece& p, double s) {
    return p.span.half > 0 ? p.span.f.derivative()(s) / p.span.half : 0;
  }

  void cross(const Piece& p) {
    const double s = p.at_level(0), slope = slope_at(p, s);
    add({p.t(s), root_error(p, s, slope), HitStatus::isolated, slope, margin_});
  }

  // Keeps what a piece on the surface tells about the roots of the stretch.
  void note(const Piece& p) {
    for (const auto& [s, f] : {std::pair(p.a, p.fa), std::pair(p.b, p.fb)}) {
      if (std::abs(f) >= stretch_.least) continue;
      stretch_.least = std::abs(f);
      stretch_.nearest = p.t(s);
      stretch_.slope = slope_at(p, s);
    }
    if (stretch_.crossed || (p.fa < 0) == (p.fb < 0)) return;
    const double s = p.at_level(0);
    stretch_.crossed = true;
    stretch_.root = p.t(s);
    stretch_.root_slope = slope_at(p, s);
    stretch_.root_error = root_error(p, s, stretch_.root_slope);
  }

  // The stretch ends at t; `sign` is that of f beyond, 0 for a gap.
  void leave(int sign, double t) {
    on_surface_ = false;
    const Stretch& s = stretch_;
    const bool closed = s.sign_before != 0 && sign != 0;
    const double length = (t - s.begin) * cells_per_t_;
    if (closed && s.sign_before != sign && !s.turned) {
      const double at = s.crossed ? s.root : s.nearest;
      const double error = s.crossed ? s.root_error : 4 * epsilon * std::abs(at);
      add({at, error, HitStatus::isolated, s.crossed ? s.root_slope : s.slope, margin_});
      return;
    }
    const bool plateau = length > plateau_length;
    double at = s.crossed && !s.turned ? s.root : s.nearest;
    if (plateau) at = 0.5 * (s.begin + t);
    at = std::clamp(at, s.begin, t);
    const double error = std::max(at - s.begin, t - at) + 4 * epsilon * std::abs(at);
    add({at, error, closed && !plateau ? HitStatus::tangent : HitStatus::unresolved, s.slope, 0});
  }

  void add(const ReferenceHit& hit) { hits_.push_back(hit); }

  const double tolerance_, cells_per_t_;
  const bool first_only_;
  std::vector<ReferenceHit>& hits_;
  const std::size_t first_hit_;
  int sign_ = 0;              // of f - isovalue where the traversal has come to; 0 after a gap
  int direction_ = 0;         // in which f last moved; 0 when unknown
  double margin_ = infinity;  // at the last extremum
  bool on_surface_ = false;
  Stretch stretch_{};
};

class MarginVisitor : public RayVisitor {
 public:
  explicit MarginVisitor(double cells_per_t) : cells_per_t_(cells_per_t) {}
  RayRoots::Margins margins{infinity, infinity};

  // A clear span cannot lower the margins.
  double clear_above() const override { return std::max(margins.extremum, margins.end); }
  bool finished() const override { return false; }

  void clear(int, double) override { restart(false); }

  void gap(double) override {
    margins.end = std::min(margins.end, last_);
    restart(true);
  }

  void span(const RaySpan& span) override {
    const bool substantial = 2 * span.half * cells_per_t_ > 1e-6;
    for_monotone_pieces(span, [&](const Piece& p) {
      if (after_gap_) margins.end = std::min(margins.end, relative(p.fa, span));
      after_gap_ = false;
      const int direction = p.direction();
      const bool turns = direction != 0 && direction_ != 0 && direction != direction_;
      const bool constant = direction == 0 && substantial;
      if (turns || constant) margins.extremum = std::min(margins.extremum, relative(p.fa, span));
      if (direction != 0) direction_ = direction;
      last_ = relative(p.fb, span);
    });
  }

 private:
  void restart(bool after_gap) {
    direction_ = 0;
    last_ = infinity;
    after_gap_ = after_gap;
  }

  const double cells_per_t_;
  int direction_ = 0;
  double last_ = infinity;  // |f| / scale where the traversal has come to
  bool after_gap_ = false;
};

}  // namespace

RayRoots::RayRoots(std::shared_ptr<const GridField> field, double isovalue, double tolerance)
    : field_(std::move(field)), isovalue_(isovalue), tolerance_(tolerance) {}

void RayRoots::find(const ReferenceRay& ray, bool first_only, std::vector<ReferenceHit>& hits) const {
  const double cells_per_t = glm::length(field_->direction_to_index(ray.direction));
  RootVisitor visitor(tolerance_, cells_per_t, first_only, hits);
  traverse_ray(*field_, isovalue_, ray, visitor);
}

RayRoots::Margins RayRoots::margins(const ReferenceRay& ray) const {
  MarginVisitor visitor(glm::length(field_->direction_to_index(ray.direction)));
  traverse_ray(*field_, isovalue_, ray, visitor);
  return visitor.margins;
}

}  // namespace smurf
