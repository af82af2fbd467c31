#include "surfaces/stream/cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "numerics/parallel.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr std::int32_t fewest_bases = 32, most_columns = 1 << 30;
constexpr int cells_in_section = 8, cells_in_piece = 2;  // to begin with: of one piece, of each of several
constexpr int fewest_rows = 256, most_rows = 8192;
constexpr int fewest_rows_of_piece = 64, most_pieces = 24;
constexpr int soon = 16;           // rows
constexpr double way_of_rest = 1;  // tolerances, that are left to go where a streamline rests
// Deviations are measured at some places; elsewhere they may be a little greater.
constexpr double safety = 0.5;
constexpr double of_stretched = 1.0 / 16;  // of the tolerance, what the error of one step may grow to
constexpr double least_tolerance = 2e-9;   // of a step, of the extent: floats do no better
constexpr double steps_in_noise = 2;
constexpr double most_noise = 1e-3;  // of the extent; where the flow stretches the surface more, it is torn
constexpr double widest_border = 2e-3, widest_border_box = 0.05;  // of the extent
constexpr std::size_t most_nodes = std::size_t(1) << 22;          // 80 bytes each

// Weights of the values at both ends and of the derivatives there.
struct Basis {
  double h0, h1, g0, g1;
};
Basis basis(double s) {
  const double s2 = s * s, s3 = s2 * s;
  return {1 - 3 * s2 + 2 * s3, 3 * s2 - 2 * s3, s - 2 * s2 + s3, s3 - s2};
}

dvec3 position_of(const StreamNode& node) { return dvec3(node.x); }

// The cubic between two nodes of a streamline.
dvec3 along_line(const StreamNode& a, const StreamNode& b, double dt, double t) {
  const Basis w = basis(t);
  return w.h0 * dvec3(a.x) + w.h1 * dvec3(b.x) + dt * (w.g0 * dvec3(a.v) + w.g1 * dvec3(b.v));
}

bool within(double value, double limit) { return value <= limit; }  // false for NaN

}  // namespace

dvec3 hermite_position(const std::array<StreamCorner, 4>& c, double du, double dv, double s, double t) {
  const Basis a = basis(s), b = basis(t);
  const auto row = [&](const StreamCorner& p, const StreamCorner& q) {
    return a.h0 * p.x + a.h1 * q.x + du * (a.g0 * p.u + a.g1 * q.u);
  };
  const auto slope = [&](const StreamCorner& p, const StreamCorner& q) {
    return a.h0 * p.v + a.h1 * q.v + du * (a.g0 * p.uv + a.g1 * q.uv);
  };
  return b.h0 * row(c[0], c[1]) + b.h1 * row(c[2], c[3]) + dv * (b.g0 * slope(c[0], c[1]) + b.g1 * slope(c[2], c[3]));
}

StreamCells::StreamCells(StreamLines& lines, const SeedCurve& curve, double tolerance, double extent)
    : lines_(lines), tolerance_(tolerance), extent_(extent), range_(curve.range()) {
  make_strips(curve);
  lines_.set_rows(1, fewest_rows);
}

// ---- The lattice

void StreamCells::make_strips(const SeedCurve& curve) {
  const std::vector<double> corners = curve.corners();
  // Polylines and splines have whole numbers at their points.
  const double length = range_.y - range_.x;
  const bool whole = !corners.empty();
  const auto spans = whole ? std::int32_t(std::lround(length)) : 1;
  const std::int32_t each = std::max(1, (fewest_bases + spans - 1) / spans);
  bases_ = spans * each;
  while (halvings_ > 4 && (std::int64_t(bases_) << halvings_) > most_columns) halvings_--;
  std::int32_t begin = 0;
  for (const double corner : corners) {
    const auto at = std::int32_t(std::lround((corner - range_.x) / length * bases_));
    strips_.push_back({begin, at});
    begin = at;
  }
  strips_.push_back({begin, bases_});
}

double StreamCells::u_at(std::int32_t column) const {
  return column == columns() ? range_.y : range_.x + (range_.y - range_.x) * column / columns();
}

dvec2 StreamCells::range_of(int strip) const {
  const Strip& s = strips_[std::size_t(strip)];
  return {u_at(s.begin << halvings_), u_at(s.end << halvings_)};
}

double StreamCells::time_at(std::int32_t row) const {
  return (row < 0 ? lines_.sections().front() : lines_.sections().back()).at(std::abs(row));
}

std::int32_t StreamCells::base_rows() const {
  const StreamSection& section = lines_.sections()[0];
  return section.rows_of_piece() / (section.pieces == 1 ? cells_in_section : cells_in_piece);
}
std::int32_t StreamCells::lowest_row() const {
  const StreamSection& first = lines_.sections().front();
  return first.end < first.start ? -first.rows : 0;
}
std::int32_t StreamCells::highest_row() const {
  const StreamSection& last = lines_.sections().back();
  return last.end > last.start ? last.rows : 0;
}

int StreamCells::section_of(const LatticeBox& box) const { return box.row < 0 ? 0 : int(lines_.sections().size()) - 1; }

const StreamLine* StreamCells::line(int strip, std::int32_t column) const {
  const auto found = index_.find(key(strip, column));
  return found == index_.end() ? nullptr : &traced_[found->second];
}

const StreamNode* StreamCells::node(int strip, std::int32_t column, std::int32_t row, bool before) const {
  const StreamLine* of = line(strip, column);
  if (!of) return nullptr;
  const auto section = std::size_t(row < 0 || before ? 0 : lines_.sections().size() - 1);
  const auto at = std::size_t(std::abs(row));
  return at < of->nodes[section].size() ? &of->nodes[section][at] : nullptr;
}

std::array<StreamCorner, 4> StreamCells::corners(const LatticeBox& box) const {
  std::array<StreamCorner, 4> result;
  for (int i = 0; i < 4; i++) {
    const StreamNode* n = node(box.strip, box.column + (i % 2) * box.columns, box.row + (i / 2) * box.rows);
    result[std::size_t(i)] = {dvec3(n->x), dvec3(n->u), dvec3(n->v), dvec3(n->uv)};
  }
  return result;
}

// ---- Streamlines

void StreamCells::trace(const std::vector<std::pair<int, std::int32_t>>& wanted) {
  std::vector<StreamSeed> seeds;
  std::vector<std::int64_t> keys;
  for (const auto& [strip, column] : wanted) {
    if (!index_.emplace(key(strip, column), traced_.size() + seeds.size()).second) continue;
    const Strip& s = strips_[std::size_t(strip)];
    const bool first = strip > 0 && column == s.begin << halvings_;
    const bool last = strip + 1 < int(strips_.size()) && column == s.end << halvings_;
    seeds.push_back({u_at(column), first ? 1 : (last ? -1 : 0)});
  }
  for (StreamLine& one : lines_.trace(seeds)) {
    nodes_ += one.nodes[0].size() + one.nodes[1].size();
    for (std::size_t part = 0; part < lines_.sections().size(); part++) {
      const std::vector<StreamNode>& nodes = one.nodes[part];
      int& rest = one.rest[part] = int(nodes.size());
      const auto is_there = [&](int row) {
        return double(glm::distance(nodes[std::size_t(row)].x, one.last[part])) <= way_of_rest * tolerance_;
      };
      while (rest > 0 && is_there(rest - 1)) rest--;
    }
    traced_.push_back(std::move(one));
  }
}

// At a corner of the seed curve both strips have the same streamline, with tangents of their own.
void StreamCells::join_corners() {
  for (std::size_t s = 1; s < strips_.size(); s++) {
    const std::int32_t column = strips_[s].begin << halvings_;
    const StreamLine& left = traced_[index_.at(key(int(s) - 1, column))];
    StreamLine& right = traced_[index_.at(key(int(s), column))];
    for (std::size_t part = 0; part < 2; part++) {
      const std::size_t count = std::min(left.nodes[part].size(), right.nodes[part].size());
      right.nodes[part].resize(count);
      for (std::size_t i = 0; i < count; i++) {
        right.nodes[part][i].x = left.nodes[part][i].x;
        right.nodes[part][i].v = left.nodes[part][i].v;
        right.nodes[part][i].vv = left.nodes[part][i].vv;
      }
    }
  }
}

double StreamCells::greatest_stretch() const {
  double greatest = 1;
  for (const StreamLine& one : traced_) {
    for (const std::vector<StreamNode>& nodes : one.nodes) {
      if (nodes.empty()) continue;
      const double first = double(glm::length(nodes[0].u));
      for (const StreamNode& n : nodes) {
        if (first > 0) greatest = std::max(greatest, double(glm::length(n.u)) / first);
      }
    }
  }
  return greatest;
}

// In one of the sections half of the streamlines that begin leave the field within a few rows, or come to rest.
bool StreamCells::do_most_lines_end_soon() const {
  for (std::size_t part = 0; part < lines_.sections().size(); part++) {
    std::size_t begun = 0, ended = 0;
    for (const StreamLine& one : traced_) {
      if (one.nodes[part].empty()) continue;
      begun++;
      ended += std::min(one.reached(int(part)), one.rest[part]) < soon ? 1 : 0;
    }
    if (2 * ended > begun) return true;
  }
  return false;
}

// Between every other row the cubic is 16 times as far off as in a cell of the least size.
bool StreamCells::are_rows_dense_enough(int& pieces, int& rows) const {
  if (do_most_lines_end_soon() && pieces < most_pieces) {
    pieces++;
    rows = std::min(rows, fewest_rows_of_piece);
    return false;
  }
  double first = 0, later = 0;  // of the first piece, and of the others
  for (std::size_t part = 0; part < lines_.sections().size(); part++) {
    const StreamSection& times = lines_.sections()[part];
    for (const StreamLine& one : traced_) {
      const std::vector<StreamNode>& n = one.nodes[part];
      for (std::size_t i = 0; i + 2 < n.size(); i += 2) {
        const dvec3 middle = along_line(n[i], n[i + 2], 2 * times.interval(int(i)), 0.5);
        double& greatest = int(i) < times.rows_of_piece() ? first : later;
        greatest = std::max(greatest, glm::distance(middle, position_of(n[i + 1])));
      }
    }
  }
  const auto is_enough = [&](double greatest) { return greatest / 16 <= 0.1 * tolerance_; };
  if (pieces > 1 && is_enough(later) && !is_enough(first) && pieces < most_pieces) {
    pieces++;
    return false;
  }
  if ((is_enough(first) && is_enough(later)) || pieces * rows >= most_rows) return true;
  rows *= 2;
  return false;
}

// Rows as near as streamlines need.
void StreamCells::choose_rows() {
  std::vector<std::pair<int, std::int32_t>> wanted;
  for (std::size_t s = 0; s < strips_.size(); s++) {
    for (std::int32_t b = strips_[s].begin; b <= strips_[s].end; b++) wanted.emplace_back(int(s), b << halvings_);
  }
  while (true) {
    index_.clear();
    traced_.clear();
    nodes_ = 0;
    trace(wanted);
    bool enough = true;
    // What steps err by is stretched as the seed curve is. Neighbours must not differ by it.
    const double allowed = std::max(of_stretched * tolerance_ / greatest_stretch(), least_tolerance * extent_);
    if (lines_.tolerance() > 2 * allowed) {
      lines_.set_tolerance(allowed);
      enough = false;
    }
    int pieces = lines_.sections()[0].pieces, rows = lines_.sections()[0].rows_of_piece();
    if (are_rows_dense_enough(pieces, rows) && enough) break;
    lines_.set_rows(pieces, rows);
  }
  join_corners();
}

// ---- Cells

void StreamCells::refine() {
  choose_rows();
  std::vector<LatticeBox> pending;
  for (std::size_t s = 0; s < strips_.size(); s++) {
    for (std::int32_t b = strips_[s].begin; b < strips_[s].end; b++) {
      for (std::int32_t row = lowest_row(); row < highest_row(); row += base_rows())
        pending.push_back({int(s), b << halvings_, base_columns(), row, base_rows()});
    }
  }
  refine_pending(std::move(pending));
}

void StreamCells::refine_further(const std::map<std::size_t, bool>& halved) {
  std::vector<LatticeBox> pending, kept;
  for (std::size_t n = 0; n < cells_.size(); n++) {
    const auto found = halved.find(n);
    LatticeBox half = cells_[n];
    const bool in_time = found != halved.end() && (half.columns < 2 || (found->second && half.rows > 1));
    if (found == halved.end() || (in_time ? half.rows : half.columns) < 2) {
      kept.push_back(half);
      continue;
    }
    std::int32_t& size = in_time ? half.rows : half.columns;
    std::int32_t& start = in_time ? half.row : half.column;
    if (in_time) halved_in_time_.insert(half);
    size /= 2;
    pending.push_back(half);
    start += size;
    pending.push_back(half);
  }
  cells_ = std::move(kept);
  refine_pending(std::move(pending));
}

void StreamCells::refine_pending(std::vector<LatticeBox> pending) {
  double before = std::numeric_limits<double>::infinity();
  while (!pending.empty()) {
    std::vector<std::pair<int, std::int32_t>> wanted;
    for (const LatticeBox& box : pending) {
      if (box.columns > 1) wanted.emplace_back(box.strip, box.column + box.columns / 2);
    }
    std::ranges::sort(wanted);
    wanted.erase(std::ranges::unique(wanted).begin(), wanted.end());
    const auto more = std::size_t(
        std::ranges::count_if(wanted, [&](const auto& one) { return !index_.contains(key(one.first, one.second)); }));
    const std::size_t rows = std::size_t(highest_row()) + std::size_t(-lowest_row()) + 1;
    if (nodes_ + more * rows > most_nodes)
      throw Error(ErrorCode::memory,
                  fmt::format("tolerance: {:g} cannot be met within memory: with {} streamlines of {} rows the surface "
                              "is still off by {:.3g} in {} cells, and {} more would be needed for the next halving; "
                              "ask for a greater tolerance or less time",
                              tolerance_, traced_.size(), rows, before, pending.size(), more));
    trace(wanted);
    std::vector<Found> found((pending.size() + 15) / 16);
    parallel_for(found.size(), [&](std::size_t task) {
      for (std::size_t i = 16 * task; i < std::min(pending.size(), 16 * (task + 1)); i++)
        look_at(pending[i], found[task]);
    });
    pending.clear();
    before = 0;
    for (Found& part : found) {
      pending.insert(pending.end(), part.next.begin(), part.next.end());
      cells_.insert(cells_.end(), part.cells.begin(), part.cells.end());
      halved_in_time_.insert(part.halved_in_time.begin(), part.halved_in_time.end());
      borders_.insert(borders_.end(), part.borders.begin(), part.borders.end());
      gaps_.insert(gaps_.end(), part.gaps.begin(), part.gaps.end());
      before = std::max(before, part.deviation);
    }
  }
  // Gaps that touch are one.
  std::ranges::sort(gaps_, {}, [](const dvec2& g) { return g.x; });
  std::vector<dvec2> joined;
  for (const dvec2& gap : gaps_) {
    if (!joined.empty() && gap.x <= joined.back().y) {
      joined.back().y = std::max(joined.back().y, gap.y);
    } else {
      joined.push_back(gap);
    }
  }
  gaps_ = std::move(joined);
}

void StreamCells::look_at(LatticeBox top, Found& found) const {
  std::vector<LatticeBox> waiting{top};
  while (!waiting.empty()) {
    const LatticeBox box = waiting.back();
    waiting.pop_back();
    double off = 0;
    LatticeBox first = box, second = box;
    switch (judge(box, off)) {
      case Verdict::leaf:
        found.cells.push_back(box);
        break;
      case Verdict::split_v:
        found.halved_in_time.push_back(box);
        first.rows = second.rows = box.rows / 2;
        second.row += first.rows;
        waiting.push_back(second);
        waiting.push_back(first);
        break;
      case Verdict::split_u:
        first.columns = second.columns = box.columns / 2;
        second.column += first.columns;
        found.next.push_back(first);
        found.next.push_back(second);
        found.deviation = std::max(found.deviation, off);
        break;
      case Verdict::border:
        found.borders.push_back(border_of(box));
        break;
      case Verdict::gap:
        found.gaps.emplace_back(u_at(box.column), u_at(box.column + box.columns));
        break;
      case Verdict::nothing:
        break;
    }
  }
}

// What the integrator errs by, stretched as the seed curve is until then: smaller cells cannot be more exact.
double StreamCells::noise_of(const LatticeBox& box) const {
  double stretch = 0;
  const bool before = box.row < 0;
  for (const std::int32_t column : {box.column, box.column + box.columns}) {
    const double first = double(glm::length(node(box.strip, column, 0, before)->u));
    for (const std::int32_t row : {box.row, box.row + box.rows}) {
      if (first > 0) stretch = std::max(stretch, double(glm::length(node(box.strip, column, row, before)->u)) / first);
    }
  }
  return steps_in_noise * lines_.tolerance() * stretch;
}

StreamCells::Verdict StreamCells::judge(const LatticeBox& box, double& deviation) const {
  const bool halves = box.columns > 1;
  const std::int32_t middle = box.column + box.columns / 2, end = box.column + box.columns;
  for (const std::int32_t column : {box.column, end, halves ? middle : box.column}) {
    if (!node(box.strip, column, box.row) || !node(box.strip, column, box.row + box.rows)) return judge_incomplete(box);
  }
  const std::array<StreamCorner, 4> at = corners(box);
  const double du = u_at(end) - u_at(box.column), dv = time_at(box.row + box.rows) - time_at(box.row);
  const double noise = noise_of(box), limit = std::max(safety * tolerance_, noise);
  if (!within(noise, most_noise * extent_)) return Verdict::gap;
  const auto off = [&](std::int32_t column, std::int32_t row, double s) {
    const double t = double(row - box.row) / box.rows;
    return glm::distance(hermite_position(at, du, dv, s, t), position_of(*node(box.strip, column, row)));
  };
  double sides = 0, across = 0, inside = 0;
  const auto most = [](double& greatest, double value) {
    if (!(value <= greatest)) greatest = value;
  };
  const std::int32_t step = std::max(1, box.rows / 4);
  for (std::int32_t row = box.row; row <= box.row + box.rows; row += step) {
    const bool inner = row > box.row && row < box.row + box.rows;
    if (inner) most(sides, std::max(off(box.column, row, 0), off(end, row, 1)));
    if (halves) most(inner ? inside : across, off(middle, row, 0.5));
  }
  most(deviation, sides);
  most(deviation, across);
  most(deviation, inside);
  if (within(deviation, limit)) return is_at_rest(box) ? Verdict::nothing : Verdict::leaf;
  if (box.rows > 1 && (!within(sides, limit) || (within(across, limit) && inside > 2 * across)))
    return Verdict::split_v;
  return halves ? Verdict::split_u : Verdict::gap;
}

// Where streamlines have come to rest the surface has ended.
bool StreamCells::is_at_rest(const LatticeBox& box) const {
  const auto section = std::size_t(section_of(box));
  for (int i = 0; i < 3; i++) {
    const StreamLine* of = line(box.strip, box.column + i * box.columns / 2);
    if (of && (box.row < 0 ? -box.row - box.rows : box.row) < of->rest[section]) return false;
  }
  return true;
}

// Where a streamline ends before the box does: halved until what is missing is small.
StreamCells::Verdict StreamCells::judge_incomplete(const LatticeBox& box) const {
  const bool before = box.row < 0;
  const std::int32_t near = before ? box.row + box.rows : box.row;  // the row that is next to the seed
  const auto section = std::size_t(section_of(box));
  std::array<dvec3, 3> begin, end;
  bool any = false;
  for (int i = 0; i < 3; i++) {
    const StreamLine* of = line(box.strip, box.column + i * box.columns / 2);
    if (!of || of->nodes[section].empty()) of = nullptr;
    const auto reached = of ? of->reached(int(section)) : 0, from = std::abs(near), to = from + box.rows;
    any = any || (of && reached >= from);
    const auto at = [&](int row) { return dvec3(of->nodes[section][std::size_t(std::min(row, reached))].x); };
    begin[std::size_t(i)] = of ? at(from) : dvec3(INFINITY);
    end[std::size_t(i)] = of ? (reached >= to ? at(to) : dvec3(of->last[section])) : dvec3(INFINITY);
  }
  if (!any) return Verdict::nothing;
  const auto wide = [&](const std::array<dvec3, 3>& p) {
    return glm::distance(p[0], p[1]) + glm::distance(p[1], p[2]);
  };
  const double width = std::max(wide(begin), wide(end));
  const double length =
      std::max({glm::distance(begin[0], end[0]), glm::distance(begin[1], end[1]), glm::distance(begin[2], end[2])});
  const bool is_short = length <= widest_border * extent_;
  if (box.rows > 1 && !is_short && !(width > 2 * length)) return Verdict::split_v;
  const bool is_narrow = width <= widest_border * extent_;
  // Ends that jump are never near each other.
  if (box.columns > base_columns() >> 8 && !is_narrow) return Verdict::split_u;
  if (box.rows > 1 && !is_short) return Verdict::split_v;
  const Border border = border_of(box);
  const dvec3 size = border.upper - border.lower;
  return std::max({size.x, size.y, size.z}) > widest_border_box * extent_ ? Verdict::gap : Verdict::border;
}

StreamCells::Border StreamCells::border_of(const LatticeBox& box) const {
  Border border{box, dvec3(INFINITY), dvec3(-INFINITY)};
  const auto section = std::size_t(section_of(box));
  const std::int32_t near = box.row < 0 ? box.row + box.rows : box.row,
                     far = box.row < 0 ? box.row : box.row + box.rows;
  for (const std::int32_t column : {box.column, box.column + box.columns / 2, box.column + box.columns}) {
    const StreamLine* of = line(box.strip, column);
    if (!of || !node(box.strip, column, near)) continue;
    const StreamNode* at_far = node(box.strip, column, far);
    for (const dvec3& p :
         {dvec3(node(box.strip, column, near)->x), at_far ? dvec3(at_far->x) : dvec3(of->last[section])}) {
      border.lower = glm::min(border.lower, p);
      border.upper = glm::max(border.upper, p);
    }
  }
  // Streamlines between those that are known, and their bends.
  const dvec3 about = 0.25 * (border.upper - border.lower) + tolerance_;
  border.lower -= about;
  border.upper += about;
  return border;
}

double StreamCells::deviation(const LatticeBox& box, const std::array<StreamCorner, 4>& at) const {
  const double du = u_at(box.column + box.columns) - u_at(box.column),
               dv = time_at(box.row + box.rows) - time_at(box.row);
  double greatest = 0;
  for (int side = 0; side <= 2; side++) {
    if (side == 1 && box.columns < 2) continue;
    const std::int32_t column = box.column + side * (box.columns / 2);
    const std::int32_t step = std::max(1, box.rows / 4);
    for (std::int32_t row = box.row; row <= box.row + box.rows; row += step) {
      const StreamNode* n = node(box.strip, side == 2 ? box.column + box.columns : column, row);
      if (!n) continue;
      const double off =
          glm::distance(hermite_position(at, du, dv, 0.5 * side, double(row - box.row) / box.rows), dvec3(n->x));
      greatest = std::max(greatest, off);
    }
  }
  return greatest;
}

}  // namespace smurf
