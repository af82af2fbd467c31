#include "reference/stream/samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "numerics/parallel.hpp"
#include "reference/flow/extrapolation.hpp"

namespace smurf {
namespace {

using glm::dvec3;

constexpr int first_lines = 24, first_times = 32;
constexpr double twin = 3e-5;  // how far the lines that give derivatives are apart, of the stretch
// How far patches may be off, of the extent; a field that is not smooth has no patches that come as close.
constexpr double wanted_smooth = 2e-7, wanted_else = 1e-5;
constexpr std::size_t most_lines = 1500, most_times = 768, most_cells = 400'000;
constexpr double narrowest = 1e-6;  // strip, of the stretch
constexpr double safety = 4;        // boxes are grown by this multiple of what was measured in the middle of cells
constexpr double closing = 1e-6;    // of the extent

std::array<double, 4> bernstein(double s) {
  const double r = 1 - s;
  return {r * r * r, 3 * r * r * s, 3 * r * s * s, s * s * s};
}
std::array<double, 4> bernstein_first(double s) {
  const double r = 1 - s;
  return {-3 * r * r, 3 * r * r - 6 * r * s, 6 * r * s - 3 * s * s, 3 * s * s};
}
std::array<double, 4> bernstein_second(double s) {
  const double r = 1 - s;
  return {6 * r, -12 * r + 6 * s, 6 * r - 12 * s, 6 * s};
}

}  // namespace

NetPoint evaluate(const StreamNet& net, double a, double b) {
  const auto a0 = bernstein(a), a1 = bernstein_first(a), a2 = bernstein_second(a);
  const auto b0 = bernstein(b), b1 = bernstein_first(b), b2 = bernstein_second(b);
  NetPoint p{dvec3(0.0), dvec3(0.0), dvec3(0.0), dvec3(0.0), dvec3(0.0), dvec3(0.0)};
  for (std::size_t j = 0; j < 4; j++) {
    dvec3 row(0.0), first(0.0), second(0.0);
    for (std::size_t i = 0; i < 4; i++) {
      const dvec3& c = net[i + 4 * j];
      row += a0[i] * c;
      first += a1[i] * c;
      second += a2[i] * c;
    }
    p.x += b0[j] * row;
    p.a += b0[j] * first;
    p.aa += b0[j] * second;
    p.b += b1[j] * row;
    p.ab += b1[j] * first;
    p.bb += b2[j] * row;
  }
  return p;
}

StreamSamples::StreamSamples(const ReferenceStreamMap& map) : map_(map) {
  const glm::dvec2 time = map.time();
  for (int i = 0; i <= first_times; i++)
    times_.push_back(i == first_times ? time.y : time.x + (time.y - time.x) * i / first_times);
  for (const StreamStretch& stretch : map.stretches()) {
    Part part;
    for (int i = 0; i <= first_lines; i++) {
      Bundle line;
      line.u = i == first_lines ? stretch.upper : stretch.lower + stretch.size() * i / first_lines;
      part.lines.push_back(std::move(line));
    }
    part.strips.resize(first_lines);
    parts_.push_back(std::move(part));
  }
  trace_all();
  do {
    measure_extent();
    while (refine_times()) trace_all();
  } while (refine_lines());
  measure_extent();
  close();
  list_cells();
}

std::vector<double> StreamSamples::with_middles() const {
  std::vector<double> all;
  for (std::size_t i = 0; i < times_.size(); i++) {
    if (i > 0) all.push_back(0.5 * (times_[i - 1] + times_[i]));
    all.push_back(times_[i]);
  }
  return all;
}

StreamSamples::Bundle StreamSamples::sample(std::size_t part, double u) const {
  const StreamStretch& stretch = map_.stretches()[part];
  const std::vector<double> times = with_middles();
  SampledLine line = map_.line(stretch, u, times);
  // From both sides, or where there is only one from two lines on it.
  const double h = twin * stretch.size();
  const bool first = u - h<stretch.lower, last = u + h> stretch.upper;
  const double step = first ? h : last ? -h : h;
  const SampledLine next = map_.line(stretch, u + step, times);
  const SampledLine other = map_.line(stretch, first || last ? u + 2 * step : u - step, times);
  Bundle bundle;
  bundle.u = u;
  bundle.from = line.from;
  bundle.until = line.until;
  const auto derivative = [&](const dvec3& at, const dvec3& a, const dvec3& b) {
    return first || last ? (4.0 * a - 3.0 * at - b) / (2 * step) : (a - b) / (2 * step);
  };
  for (std::size_t i = 0; i < times.size(); i++) {
    bundle.s.push_back(derivative(line.x[i], next.x[i], other.x[i]));
    bundle.sv.push_back(derivative(line.v[i], next.v[i], other.v[i]));
  }
  bundle.x = std::move(line.x);
  bundle.v = std::move(line.v);
  return bundle;
}

void StreamSamples::trace_all() {
  for (std::size_t p = 0; p < parts_.size(); p++) {
    std::vector<Bundle>& lines = parts_[p].lines;
    parallel_for(lines.size(), [&](std::size_t i) { lines[i] = sample(p, lines[i].u); });
    for (Strip& strip : parts_[p].strips) strip.settled = false;
  }
}

void StreamSamples::measure_extent() {
  dvec3 lower(std::numeric_limits<double>::infinity()), upper = -lower;
  const std::vector<double> times = with_middles();
  for (const Part& part : parts_) {
    for (const Bundle& line : part.lines) {
      for (std::size_t i = 0; i < times.size(); i++) {
        if (times[i] < line.from || times[i] > line.until) continue;
        lower = glm::min(lower, line.x[i]);
        upper = glm::max(upper, line.x[i]);
      }
    }
  }
  extent_ = greatest(upper - lower);
  if (!(extent_ > 0) || !std::isfinite(extent_)) extent_ = 1;
}

// Halves the times between which some line leaves its cubic.
bool StreamSamples::refine_times() {
  const double wanted = (map_.is_smooth() ? wanted_smooth : wanted_else) * extent_;
  std::vector<bool> bad(times_.size() - 1, false);
  std::size_t added = 0;
  for (std::size_t t = 0; t < bad.size(); t++) {
    const double h = times_[t + 1] - times_[t];
    for (const Part& part : parts_) {
      for (const Bundle& line : part.lines) {
        if (!line.is_alive(times_[t], times_[t + 1])) continue;
        const std::size_t i = 2 * t;
        const dvec3 middle = 0.5 * (line.x[i] + line.x[i + 2]) + 0.125 * h * (line.v[i] - line.v[i + 2]);
        if (!(glm::distance(middle, line.x[i + 1]) <= wanted)) bad[t] = true;
      }
    }
    added += bad[t];
  }
  if (added == 0 || times_.size() + added > most_times) return false;
  std::vector<double> finer;
  for (std::size_t t = 0; t < times_.size(); t++) {
    finer.push_back(times_[t]);
    if (t < bad.size() && bad[t]) finer.push_back(0.5 * (times_[t] + times_[t + 1]));
  }
  times_ = std::move(finer);
  return true;
}

// Puts lines between those whose middle leaves its patches.
bool StreamSamples::refine_lines() {
  const double wanted = (map_.is_smooth() ? wanted_smooth : wanted_else) * extent_;
  std::size_t count = 0;
  for (const Part& part : parts_) count += part.lines.size();
  bool more = false;
  for (std::size_t p = 0; p < parts_.size(); p++) {
    Part& part = parts_[p];
    const std::size_t strips = part.strips.size();
    std::vector<Bundle> middles(strips);
    parallel_for(strips, [&](std::size_t i) {
      if (!part.strips[i].settled) middles[i] = sample(p, 0.5 * (part.lines[i].u + part.lines[i + 1].u));
    });
    std::vector<bool> split(strips, false);
    std::size_t added = 0;
    for (std::size_t i = 0; i < strips; i++) {
      Strip& strip = part.strips[i];
      if (strip.settled) continue;
      const Bundle &left = part.lines[i], &right = part.lines[i + 1], &middle = middles[i];
      strip.off.assign(times_.size() - 1, 0);
      strip.from = middle.from;
      strip.until = middle.until;
      double most = 0;
      for (std::size_t t = 0; t + 1 < times_.size(); t++) {
        const StreamNet net = net_of(p, i, t);
        double off = 0;
        for (std::size_t k = 0; k < 3; k++)
          off = std::max(off, glm::distance(evaluate(net, 0.5, 0.5 * double(k)).x, middle.x[2 * t + k]));
        for (const double a : {0.0, 1.0})
          off = std::max(off, glm::distance(evaluate(net, a, 0.5).x, (a == 0 ? left : right).x[2 * t + 1]));
        if (!std::isfinite(off)) off = extent_;
        strip.off[t] = float(off);
        const bool alive = left.is_alive(times_[t], times_[t + 1]) || right.is_alive(times_[t], times_[t + 1]) ||
                           middle.is_alive(times_[t], times_[t + 1]);
        if (alive) most = std::max(most, off);
      }
      strip.settled = true;
      const bool room = count + added < most_lines && (count + added) * times_.size() < most_cells;
      if (most <= wanted || !room || right.u - left.u < narrowest * map_.stretches()[p].size()) continue;
      split[i] = true;
      added++;
    }
    if (added == 0) continue;
    count += added;
    more = true;
    Part finer;
    for (std::size_t i = 0; i <= strips; i++) {
      finer.lines.push_back(std::move(part.lines[i]));
      if (i == strips) break;
      if (split[i]) {
        finer.lines.push_back(std::move(middles[i]));
        finer.strips.resize(finer.strips.size() + 2);
      } else {
        finer.strips.push_back(std::move(part.strips[i]));
      }
    }
    part = std::move(finer);
  }
  return more;
}

StreamNet StreamSamples::net_of(std::size_t p, std::size_t line, std::size_t time) const {
  const Bundle *left = &parts_[p].lines[line], *right = left + 1;
  const double du = (right->u - left->u) / 3, dt = (times_[time + 1] - times_[time]) / 3;
  StreamNet net;
  for (std::size_t j = 0; j < 2; j++) {
    const std::size_t at = 2 * (time + j);
    const double over = j == 0 ? dt : -dt;
    for (std::size_t i = 0; i < 2; i++) {
      const Bundle& b = i == 0 ? *left : *right;
      const double across = i == 0 ? du : -du;
      const std::size_t corner = 3 * i + 12 * j, beside = (i == 0 ? 1 : 2) + 12 * j, above = 3 * i + (j == 0 ? 4 : 8),
                        within = (i == 0 ? 1 : 2) + (j == 0 ? 4 : 8);
      net[corner] = b.x[at];
      net[beside] = b.x[at] + across * b.s[at];
      net[above] = b.x[at] + over * b.v[at];
      net[within] = b.x[at] + across * b.s[at] + over * b.v[at] + across * over * b.sv[at];
    }
  }
  return net;
}

void StreamSamples::close() {
  const SampledLine first = map_.line(map_.stretches().front(), map_.stretches().front().lower, times_);
  const SampledLine last = map_.line(map_.stretches().back(), map_.stretches().back().upper, times_);
  closed_u_ = true;
  for (std::size_t i = 0; i < times_.size(); i++)
    closed_u_ = closed_u_ && glm::distance(first.x[i], last.x[i]) <= closing * extent_;
  closed_time_ = true;
  for (const Part& part : parts_) {
    for (const Bundle& line : part.lines) {
      closed_time_ = closed_time_ && line.is_alive(times_.back(), times_.back()) &&
                     line.is_alive(times_[0], times_[0]) &&
                     glm::distance(line.x.front(), line.x.back()) <= closing * extent_;
    }
  }
}

void StreamSamples::list_cells() {
  std::vector<BoxTree::Box> boxes;
  for (std::size_t p = 0; p < parts_.size(); p++) {
    const Part& part = parts_[p];
    for (std::size_t i = 0; i < part.strips.size(); i++) {
      const Bundle &left = part.lines[i], &right = part.lines[i + 1];
      const double from = std::min({left.from, right.from, part.strips[i].from}),
                   until = std::max({left.until, right.until, part.strips[i].until});
      for (std::size_t t = 0; t + 1 < times_.size(); t++) {
        // Lines between those that are known may end a little later.
        const double h = times_[t + 1] - times_[t];
        if (until < times_[t] - h || from > times_[t + 1] + h) continue;
        cells_.push_back({std::uint32_t(p), std::uint32_t(i), std::uint32_t(t)});
        const StreamNet net = net_of(p, i, t);
        BoxTree::Box box{net[0], net[0]};
        for (const dvec3& c : net) {
          box.lower = glm::min(box.lower, c);
          box.upper = glm::max(box.upper, c);
        }
        const double off = place(cells_.size() - 1).off;
        box.lower -= off;
        box.upper += off;
        boxes.push_back(box);
      }
    }
  }
  boxes_ = BoxTree(std::move(boxes));
}

StreamCellPlace StreamSamples::place(std::size_t cell) const {
  const Cell& c = cells_[cell];
  const Part& part = parts_[c.part];
  return {c.part,         part.lines[c.line].u, part.lines[c.line + 1].u,
          times_[c.time], times_[c.time + 1],   safety * double(part.strips[c.line].off[c.time]) + 1e-11 * extent_};
}

StreamNet StreamSamples::net(std::size_t cell) const {
  const Cell& c = cells_[cell];
  return net_of(c.part, c.line, c.time);
}

std::size_t StreamSamples::bytes() const {
  std::size_t bytes = cells_.size() * (sizeof(Cell) + 2 * sizeof(BoxTree::Box));
  for (const Part& part : parts_)
    for (const Bundle& line : part.lines) bytes += 4 * line.x.size() * sizeof(dvec3);
  return bytes;
}

}  // namespace smurf
