#include "truth/sturm.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace smurf::test {
namespace {

using expression::Op;

// Half a unit in the last place of 113 bits, doubled; and what the sums of radii and the narrowing of magnitudes to
// double round by.
constexpr double rounding = 0x1p-112;
constexpr double upwards = 1 + 0x1p-40;
constexpr double infinity = std::numeric_limits<double>::infinity();

Quad absolute(Quad a) { return a < 0 ? -a : a; }
double size_of(Quad a) { return double(absolute(a)) * upwards; }

void trim(BallPolynomial& p) {
  while (!p.empty() && p.back().is_zero()) p.pop_back();
}

// By a power of two, so that the largest coefficient is near 1.
void normalize(BallPolynomial& p) {
  double largest = 0;
  for (const Ball& c : p) largest = std::max(largest, size_of(c.middle));
  if (!(largest > 0)) return;
  const double scale = std::exp2(-std::ilogb(largest));
  for (Ball& c : p) c = {c.middle * Quad(scale), c.radius * scale};
}

BallPolynomial sum(const BallPolynomial& a, const BallPolynomial& b, bool minus) {
  BallPolynomial c(std::max(a.size(), b.size()));
  for (std::size_t i = 0; i < c.size(); i++) {
    const Ball x = i < a.size() ? a[i] : Ball(), y = i < b.size() ? b[i] : Ball();
    c[i] = minus ? x - y : x + y;
  }
  return c;
}

BallPolynomial product(const BallPolynomial& a, const BallPolynomial& b) {
  if (a.empty() || b.empty()) return {};
  BallPolynomial c(a.size() + b.size() - 1);
  for (std::size_t i = 0; i < a.size(); i++)
    for (std::size_t k = 0; k < b.size(); k++) c[i + k] = c[i + k] + a[i] * b[k];
  return c;
}

BallPolynomial power(BallPolynomial base, int exponent) {
  BallPolynomial result{Ball(1.0)};
  for (; exponent > 0; exponent >>= 1) {
    if (exponent & 1) result = product(result, base);
    if (exponent > 1) base = product(base, base);
  }
  return result;
}

BallPolynomial derivative(const BallPolynomial& p) {
  BallPolynomial d;
  for (std::size_t i = 1; i < p.size(); i++) d.push_back(p[i] * Ball(double(i)));
  return d;
}

Ball value(const BallPolynomial& p, const Ball& u) {
  Ball v;
  for (std::size_t i = p.size(); i-- > 0;) v = v * u + p[i];
  return v;
}

// A positive multiple of the remainder of a by b, with its sign changed. The leading coefficient of b has a certain
// sign.
BallPolynomial negative_remainder(BallPolynomial a, const BallPolynomial& b) {
  const Ball leading = b.back();
  const int sign = leading.sign();
  const Ball size = sign > 0 ? leading : -leading;
  while (a.size() >= b.size()) {
    const Ball top = sign > 0 ? a.back() : -a.back();
    const std::size_t shift = a.size() - b.size();
    a.pop_back();  // cancels by construction
    for (Ball& c : a) c = c * size;
    for (std::size_t i = 0; i + 1 < b.size(); i++) a[i + shift] = a[i + shift] - top * b[i];
    normalize(a);
  }
  for (Ball& c : a) c = -c;
  trim(a);
  return a;
}

class Chain {
 public:
  explicit Chain(BallPolynomial p) {
    trim(p);
    if (p.empty() || p.back().sign() == 0) {
      doubtful = true;  // zero all along the ray, or of a degree that cannot be told
      return;
    }
    normalize(p);
    members_ = {p, derivative(p)};
    while (members_.back().size() > 1) {
      BallPolynomial next = negative_remainder(members_[members_.size() - 2], members_.back());
      // Exactly zero: the last member is the greatest common divisor, which the theorem allows for.
      if (next.empty()) break;
      if (next.back().sign() == 0) {
        doubtful = true;
        break;
      }
      members_.push_back(std::move(next));
    }
    if (members_.back().empty()) members_.pop_back();  // the derivative of a constant
  }

  bool doubtful = false;
  bool empty() const { return members_.empty(); }
  const BallPolynomial& polynomial() const { return members_.front(); }
  int sign_at(Quad u) const { return value(members_.front(), {u, 0}).sign(); }

  // Changes of sign along the chain at a place where the polynomial itself is certainly not zero. Between neighbours of
  // opposite signs a member makes one change whatever its own sign is; other uncertain signs make doubts.
  int changes_at(Quad u) {
    std::vector<int> signs;
    for (const BallPolynomial& member : members_) signs.push_back(value(member, {u, 0}).sign());
    int changes = 0, last = 0;
    for (std::size_t i = 0; i < signs.size(); i++) {
      if (signs[i] == 0) {
        if (i == 0 || i + 1 == signs.size() || signs[i - 1] * signs[i + 1] >= 0) doubtful = true;
        continue;
      }
      if (last * signs[i] < 0) changes++;
      last = signs[i];
    }
    return changes;
  }

 private:
  std::vector<BallPolynomial> members_;
};

// The one root in (low, high), where the signs differ: found in long double, and then confirmed by signs on both sides
// of it.
double polished(const Chain& chain, Quad low, Quad high) {
  std::vector<long double> c;
  for (const Ball& ball : chain.polynomial()) c.push_back(static_cast<long double>(ball.middle));
  const int below = chain.sign_at(low);
  long double a = static_cast<long double>(low), b = static_cast<long double>(high), u = (a + b) / 2;
  for (int i = 0; i < 200 && b - a > 1e-17L; i++) {
    long double f = 0, slope = 0;
    for (std::size_t k = c.size(); k-- > 0;) {
      slope = slope * u + f;
      f = f * u + c[k];
    }
    if (f == 0) break;
    ((f < 0) == (below < 0) ? a : b) = u;
    const long double newton = u - f / slope;
    const long double next = newton > a && newton < b ? newton : (a + b) / 2;
    if (std::abs(next - u) < 1e-18L) break;
    u = next;
  }
  for (double apart = 1e-16; apart < 1e-9; apart *= 10) {
    const Quad left = std::max(Quad(u) - Quad(apart), low), right = std::min(Quad(u) + Quad(apart), high);
    if (chain.sign_at(left) != below || chain.sign_at(right) != -below) continue;
    low = left;
    high = right;
    break;
  }
  while (double(high - low) > 3e-16) {
    const Quad middle = (low + high) / 2;
    const int sign = chain.sign_at(middle);
    if (sign == 0) return double(middle);
    (sign == below ? low : high) = middle;
  }
  return double((low + high) / 2);
}

Jet scaled(const Jet& a, double by) { return {by * a.value, by * a.gradient, by * a.hessian}; }

Jet added(const Jet& a, const Jet& b) { return {a.value + b.value, a.gradient + b.gradient, a.hessian + b.hessian}; }

Jet multiplied(const Jet& a, const Jet& b) {
  const glm::dmat3 mixed = glm::outerProduct(a.gradient, b.gradient);
  return {a.value * b.value, a.value * b.gradient + b.value * a.gradient,
          a.value * b.hessian + b.value * a.hessian + mixed + glm::transpose(mixed)};
}

}  // namespace

int Ball::sign() const {
  if (size_of(middle) * (1 - 0x1p-38) <= radius) return 0;
  return middle < 0 ? -1 : 1;
}

Ball operator-(const Ball& a) { return {-a.middle, a.radius}; }

Ball operator+(const Ball& a, const Ball& b) {
  if (a.is_zero()) return b;
  if (b.is_zero()) return a;
  const Quad middle = a.middle + b.middle;
  return {middle, (a.radius + b.radius + rounding * size_of(middle)) * upwards};
}

Ball operator-(const Ball& a, const Ball& b) { return a + -b; }

Ball operator*(const Ball& a, const Ball& b) {
  if (a.is_zero() || b.is_zero()) return {};
  const Quad middle = a.middle * b.middle;
  return {middle,
          (a.radius * (size_of(b.middle) + b.radius) + b.radius * size_of(a.middle) + rounding * size_of(middle)) *
              upwards};
}

Ball operator/(const Ball& a, double b) {
  const Quad middle = a.middle / Quad(b);
  return {middle, (a.radius / std::abs(b) + rounding * size_of(middle)) * upwards};
}

DistinctRoots distinct_roots(BallPolynomial p) {
  Chain chain(std::move(p));
  DistinctRoots roots;
  if (chain.empty()) return {{}, true};
  if (chain.sign_at(-1) == 0 || chain.sign_at(1) == 0) chain.doubtful = true;
  struct Stretch {
    Quad low, high;
    int changes_low, changes_high;
  };
  std::vector<Stretch> open{{-1, 1, chain.changes_at(-1), chain.changes_at(1)}};
  while (!open.empty()) {
    const Stretch s = open.back();
    open.pop_back();
    const int count = s.changes_low - s.changes_high;
    if (count <= 0) {
      chain.doubtful = chain.doubtful || count < 0;
      continue;
    }
    if (count == 1 && chain.sign_at(s.low) * chain.sign_at(s.high) < 0) {
      roots.at.push_back(polished(chain, s.low, s.high));
      continue;
    }
    if (double(s.high - s.low) < 1e-26) {  // no nearer to a multiple root
      roots.at.insert(roots.at.end(), std::size_t(count), double((s.low + s.high) / 2));
      chain.doubtful = chain.doubtful || count > 1;
      continue;
    }
    // Not in the middle, where symmetric surfaces have their roots.
    Quad middle = s.low + (s.high - s.low) * Quad(0.4937);
    if (chain.sign_at(middle) == 0) middle = s.low + (s.high - s.low) * Quad(0.5311);
    if (chain.sign_at(middle) == 0) {
      chain.doubtful = true;
      roots.at.insert(roots.at.end(), std::size_t(count), double(middle));
      continue;
    }
    const int changes = chain.changes_at(middle);
    open.push_back({middle, s.high, changes, s.changes_high});
    open.push_back({s.low, middle, s.changes_low, changes});
  }
  roots.doubtful = chain.doubtful;
  return roots;
}

AlgebraicSurface::AlgebraicSurface(const expression::Graph& graph, expression::NodeId f)
    : program_(expression::make_program(graph, std::span(&f, 1))), degree_(expression::polynomial_degree(graph, f)) {
  if (degree_ < 0) throw std::invalid_argument("no polynomial");
}

RayPart part_of(const Domain& domain, const Ray& ray, double margin) {
  // In long double, which leaves the rounding far below any margin.
  using Real = long double;
  Real first = ray.t_min, last = ray.t_max;
  for (int axis = 0; axis < 3; axis++) {
    const Real o = ray.origin[axis], d = ray.direction[axis];
    const Real low = Real(domain.lower[axis]) - Real(margin), high = Real(domain.upper[axis]) + Real(margin);
    if (d == 0) {
      if (o < low || o > high) return {infinity, -infinity};
      continue;
    }
    first = std::max(first, std::min((low - o) / d, (high - o) / d));
    last = std::min(last, std::max((low - o) / d, (high - o) / d));
  }
  if (domain.radius > 0) {
    Real dd = 0, od = 0, oo = 0;
    for (int axis = 0; axis < 3; axis++) {
      const Real o = ray.origin[axis], d = ray.direction[axis];
      dd += d * d;
      od += o * d;
      oo += o * o;
    }
    const Real radius = std::max(Real(domain.radius) + Real(margin), Real(0));
    const Real room = od * od - dd * (oo - radius * radius);
    if (room < 0) return {infinity, -infinity};
    first = std::max(first, (-od - std::sqrt(room)) / dd);
    last = std::min(last, (-od + std::sqrt(room)) / dd);
  }
  return {double(first), double(last)};
}

BallPolynomial AlgebraicSurface::along(const Ray& ray, const RayPart& part) const {
  const double middle = 0.5 * (part.first + part.last), half = 0.5 * (part.last - part.first);
  std::vector<BallPolynomial> made(program_.nodes.size());
  for (std::size_t id = 0; id < made.size(); id++) {
    const expression::Node& node = program_.nodes[id];
    const auto& from = node.arguments;
    BallPolynomial& p = made[id];
    switch (node.op) {
      case Op::constant:
        p = {Ball(node.value)};
        break;
      case Op::variable: {
        const int axis = int(node.value);
        const Ball direction(double(ray.direction[axis]));
        p = {Ball(double(ray.origin[axis])) + direction * Ball(middle), direction * Ball(half)};
        break;
      }
      case Op::negate:
        p = sum({}, made[from[0]], true);
        break;
      case Op::add:
      case Op::subtract:
        p = sum(made[from[0]], made[from[1]], node.op == Op::subtract);
        break;
      case Op::multiply:
        p = product(made[from[0]], made[from[1]]);
        break;
      case Op::divide:  // by a constant, or it were no polynomial
        for (const Ball& c : made[from[0]]) p.push_back(c / program_.nodes[from[1]].value);
        break;
      case Op::power_integer:
        p = power(made[from[0]], int(node.value));
        break;
      default:
        throw std::invalid_argument("no polynomial");
    }
    trim(p);
  }
  return made[program_.roots[0]];
}

DistinctRoots AlgebraicSurface::roots(const Ray& ray, const RayPart& part) const {
  if (!(part.first < part.last)) return {};
  DistinctRoots found = distinct_roots(along(ray, part));
  const double middle = 0.5 * (part.first + part.last), half = 0.5 * (part.last - part.first);
  for (double& root : found.at) root = middle + half * root;
  return found;
}

Jet AlgebraicSurface::jet(const glm::dvec3& point) const {
  std::vector<Jet> made(program_.nodes.size());
  for (std::size_t id = 0; id < made.size(); id++) {
    const expression::Node& node = program_.nodes[id];
    const auto& from = node.arguments;
    switch (node.op) {
      case Op::constant:
        made[id].value = node.value;
        break;
      case Op::variable: {
        const int axis = int(node.value);
        made[id].value = point[axis];
        made[id].gradient[axis] = 1;
        break;
      }
      case Op::negate:
        made[id] = scaled(made[from[0]], -1);
        break;
      case Op::add:
        made[id] = added(made[from[0]], made[from[1]]);
        break;
      case Op::subtract:
        made[id] = added(made[from[0]], scaled(made[from[1]], -1));
        break;
      case Op::multiply:
        made[id] = multiplied(made[from[0]], made[from[1]]);
        break;
      case Op::divide:
        made[id] = scaled(made[from[0]], 1 / program_.nodes[from[1]].value);
        break;
      default:
        made[id].value = 1;
        for (int i = 0; i < int(node.value); i++) made[id] = multiplied(made[id], made[from[0]]);
        break;
    }
  }
  return made[program_.roots[0]];
}

double AlgebraicSurface::distance_of_singularity(const glm::dvec3& point) const {
  const Jet at = jet(point);
  double size = 0;
  for (int i = 0; i < 3; i++) size += glm::dot(at.hessian[i], at.hessian[i]);
  return size > 0 ? glm::length(at.gradient) / std::sqrt(size) : infinity;
}

}  // namespace smurf::test
