// From where the nodes of a lattice come from to where the surface may be in its cells.
//
// A branch of a cell is what its corners agree on: of each corner the crossing that is nearest to that of the first
// one, by the way along the seed curve, along the flow and across the curtain. W, u and τ of a branch are affine in the
// cell, by the means of opposite faces; the corners' own numbers, and what they spread, make the margins. Where corners
// are missing (their lines have left the domain, or do not cross), or a node could not be followed, the branch is
// unclear.
//
// Samples of the surface itself, traced forward, tell of places that the lattice does not know of, each by its tangent
// plane: W is the offset from it there, and u and τ are those of the plane's point next to a place.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "kernels/stream/back_layout.inc"
#include "kernels/stream/curtain_layout.inc"
#include "numerics/parallel.hpp"
#include "surfaces/stream/curtain.hpp"

namespace smurf {
namespace {

constexpr double spread_margin = 0.15;  // of the spread, for what bends within a cell
constexpr double unclear_margin = 1.0;
constexpr double farthest_match = 24;  // cells, that crossings of one branch may be apart
constexpr int fewest_sides = 2;        // of the four edges along an axis, by which a branch has a slope there
constexpr double plane_margin = 0.25;  // cells, that the surface may be off a sample's tangent plane
constexpr double least_angle = 1e-4;   // between x_u and v, for a plane
constexpr double farthest_reach = 1;   // cells
constexpr int farthest_empty = 255;

// W, u, τ.
using Three = std::array<double, 3>;

struct Branch {
  std::array<std::array<double, 4>, 3> affine{};
  Three margin{};
  Three spread{};
  int corners = 0;
  bool clear = false;
  bool from_sample = false;
  double u_of_sample = 0;
};

struct Crossing {
  Three at{};
  bool used = false;
};

glm::ivec3 corner_of(int i) { return {i & 1, (i >> 1) & 1, i >> 2}; }

float real_of(std::uint32_t word) { return std::bit_cast<float>(word); }

class TableMaker {
 public:
  TableMaker(const StreamSurface& surface, const Curtain& curtain, bool closed, const Lattice& lattice,
             const std::vector<std::uint32_t>& nodes)
      : range_(surface.seed().range()),
        corners_(surface.seed().corners()),
        time_(surface.options().time),
        closed_(closed),
        lattice_(lattice),
        nodes_(nodes),
        length_{1, curtain.length / (range_.y - range_.x), curtain.speed},
        branches_(lattice.cell_count()) {}

  BackTable make(const StreamSamples& samples) {
    const auto slices = std::size_t(lattice_.cells.z);
    parallel_for(slices, [&](std::size_t k) { each_cell(int(k), [&](std::size_t c, glm::ivec3 i) { gather(c, i); }); });
    find_typical();
    parallel_for(slices, [&](std::size_t k) {
      each_cell(int(k), [&](std::size_t c, glm::ivec3) {
        widen(branches_[c]);
        std::erase_if(branches_[c], [&](const Branch& b) { return !in_play(b); });
      });
    });
    add_samples(samples);
    return words();
  }

 private:
  template <class Function>
  void each_cell(int k, const Function& function) const {
    for (int j = 0; j < lattice_.cells.y; j++) {
      for (int i = 0; i < lattice_.cells.x; i++) function(number_of({i, j, k}), glm::ivec3(i, j, k));
    }
  }
  std::size_t number_of(const glm::ivec3& i) const {
    return std::size_t(i.x) +
           std::size_t(lattice_.cells.x) * (std::size_t(i.y) + std::size_t(lattice_.cells.y) * std::size_t(i.z));
  }
  const std::uint32_t* node(const glm::ivec3& i) const {
    const glm::ivec3 n = lattice_.nodes();
    return &nodes_[NODE_WORDS *
                   (std::size_t(i.x) + std::size_t(n.x) * (std::size_t(i.y) + std::size_t(n.y) * std::size_t(i.z)))];
  }

  // u of a closed curve on the same turn as another one.
  double turned(double u, double to) const {
    if (!closed_) return u;
    const double period = range_.y - range_.x;
    return u - period * std::round((u - to) / period);
  }

  double apart(const Three& a, const Three& b) const {
    const double du = turned(a[1], b[1]) - b[1];
    return std::sqrt(std::pow((a[0] - b[0]) * length_[0], 2) + std::pow(du * length_[1], 2) +
                     std::pow((a[2] - b[2]) * length_[2], 2));
  }

  void gather(std::size_t cell, const glm::ivec3& at) {
    std::array<std::vector<Crossing>, 8> corners;
    bool unsure = false;
    std::size_t all = 0;
    for (int c = 0; c < 8; c++) {
      const std::uint32_t* words = node(at + corner_of(c));
      const std::uint32_t count = words[NODE_COUNT] & (NODE_UNSURE - 1);
      unsure = unsure || words[NODE_COUNT] >= NODE_UNSURE;
      for (std::uint32_t k = 0; k < count; k++) {
        const std::uint32_t* w = words + NODE_CROSSINGS + 3 * k;
        corners[std::size_t(c)].push_back({{real_of(w[2]), real_of(w[0]), real_of(w[1])}});
      }
      all += count;
    }
    if (all == 0) return;
    const double reach = farthest_match * lattice_.cell;
    for (std::size_t c = 0; c < 8; c++) {
      for (Crossing& first : corners[c]) {
        if (first.used) continue;
        first.used = true;
        std::array<const Crossing*, 8> members{};
        members[c] = &first;
        for (std::size_t other = c + 1; other < 8; other++) {
          Crossing* best = nullptr;
          for (Crossing& crossing : corners[other]) {
            if (!crossing.used && (!best || apart(crossing.at, first.at) < apart(best->at, first.at))) best = &crossing;
          }
          if (!best || apart(best->at, first.at) > reach) continue;
          best->used = true;
          members[other] = best;
        }
        branches_[cell].push_back(fitted(members, first.at, unsure));
      }
    }
  }

  Branch fitted(const std::array<const Crossing*, 8>& members, const Three& first, bool unsure) const {
    Branch b;
    std::array<Three, 8> at{};
    for (std::size_t c = 0; c < 8; c++) {
      if (!members[c]) continue;
      at[c] = members[c]->at;
      at[c][1] = turned(at[c][1], first[1]);
      b.corners++;
    }
    b.clear = b.corners == 8 && !unsure;
    for (std::size_t q = 0; q < 3; q++) {
      for (int axis = 0; axis < 3; axis++) {
        double sum = 0;
        int sides = 0;
        for (std::size_t c = 0; c < 8; c++) {
          const std::size_t other = c | (std::size_t(1) << axis);
          if (other == c || !members[c] || !members[other]) continue;
          sum += at[other][q] - at[c][q];
          sides++;
        }
        b.affine[q][std::size_t(axis) + 1] = sides >= fewest_sides ? sum / sides : 0;
        b.spread[q] += std::abs(b.affine[q][std::size_t(axis) + 1]);
      }
      const auto slope = [&](std::size_t c) {
        double value = 0;
        for (int axis = 0; axis < 3; axis++)
          value += b.affine[q][std::size_t(axis) + 1] * (corner_of(int(c))[axis] - 0.5);
        return value;
      };
      double mean = 0, off = 0;
      for (std::size_t c = 0; c < 8; c++) mean += members[c] ? (at[c][q] - slope(c)) / b.corners : 0;
      b.affine[q][0] = mean;
      for (std::size_t c = 0; c < 8; c++) off = std::max(off, members[c] ? std::abs(at[c][q] - slope(c) - mean) : 0.0);
      b.margin[q] = off;
    }
    return b;
  }

  // What branches spread in a cell, in the middle of all that are clear and near the surface.
  void find_typical() {
    for (std::size_t q = 0; q < 3; q++) {
      std::vector<double> spreads;
      for (const std::vector<Branch>& list : branches_) {
        for (const Branch& b : list) {
          if (b.clear && std::abs(b.affine[0][0]) <= b.spread[0]) spreads.push_back(b.spread[q]);
        }
      }
      typical_[q] = lattice_.cell / length_[q];
      if (spreads.empty()) continue;
      const auto middle = spreads.begin() + std::ptrdiff_t(spreads.size() / 2);
      std::nth_element(spreads.begin(), middle, spreads.end());
      typical_[q] = std::max(typical_[q], *middle);
    }
  }

  void widen(std::vector<Branch>& list) const {
    for (Branch& b : list) {
      for (std::size_t q = 0; q < 3; q++) {
        if (b.clear) {
          b.margin[q] += spread_margin * b.spread[q];
        } else {
          b.margin[q] = 2 * b.margin[q] + unclear_margin * std::max(b.spread[q], typical_[q]);
        }
      }
    }
  }

  bool in_play(const Branch& b) const {
    const auto reach = [&](std::size_t q) { return b.margin[q] + 0.5 * b.spread[q]; };
    if (std::abs(b.affine[0][0]) > reach(0)) return false;
    if (!closed_ && (b.affine[1][0] + reach(1) < range_.x || b.affine[1][0] - reach(1) > range_.y)) return false;
    return b.affine[2][0] + reach(2) >= time_.x && b.affine[2][0] - reach(2) <= time_.y;
  }

  // A sample of the surface with its tangent plane, in cells: n is the normal, and u and τ grow by by_u and by_t.
  struct Plane {
    glm::dvec3 place{0.0}, n{0.0}, by_u{0.0}, by_t{0.0};
    double size_u = 0, size_t = 0;  // cells that the surface is long per u and per τ
    double reach = 0;               // half of the way to the samples next to it
  };

  // A corner itself belongs to what is before it.
  bool is_corner_between(double at, double other) const {
    return std::ranges::any_of(corners_, [&](double c) { return (at <= c && c < other) || (other < c && c < at); });
  }

  // By differences to its neighbours; without a plane where they span none.
  Plane plane_at(const StreamSamples& samples, std::size_t line, std::size_t time) const {
    const std::size_t at = line * samples.times + time;
    Plane plane;
    plane.place = (samples.points[at].position - lattice_.corner) / lattice_.cell;
    // To the neighbours along u or τ, `stride` away: how far that is in space per unit.
    const auto slope = [&](std::size_t number, std::size_t count, std::size_t stride, auto parameter) {
      std::size_t low = at, high = at;
      // Not across a corner of the seed curve.
      const auto is_beside = [&](std::size_t other) {
        return samples.there[other] && !is_corner_between(samples.points[at].u, samples.points[other].u);
      };
      if (number > 0 && is_beside(at - stride)) low = at - stride;
      if (number + 1 < count && is_beside(at + stride)) high = at + stride;
      const glm::dvec3 way = (samples.points[high].position - samples.points[low].position) / lattice_.cell;
      const double change = parameter(samples.points[high]) - parameter(samples.points[low]);
      for (const std::size_t other : {low, high}) {
        const double away = glm::distance(samples.points[other].position, samples.points[at].position);
        plane.reach = std::max(plane.reach, 0.5 * away / lattice_.cell);
      }
      return change == 0 ? glm::dvec3(0.0) : way / change;
    };
    const glm::dvec3 x_u = slope(line, samples.lines, samples.times, [](const StreamSample&s) { return s.u; }),
                     x_t = slope(time, samples.times, 1, [](const StreamSample&s) { return s.tau; }),
                     normal = glm::cross(x_u, x_t);
    const double area = glm::length(normal);
    plane.size_u = glm::length(x_u);
    plane.size_t = glm::length(x_t);
    if (!(area > least_angle * plane.size_u * plane.size_t)) return plane;
    plane.n = normal / area;
    plane.by_u = glm::cross(x_t, plane.n) / area;
    plane.by_t = glm::cross(plane.n, x_u) / area;
    return plane;
  }

  // Each cell that a sample may reach knows the surface's tangent plane there.
  void add_samples(const StreamSamples& samples) {
    for (std::size_t line = 0; line < samples.lines; line++) {
      for (std::size_t time = 0; time < samples.times; time++) {
        const StreamSample& sample = samples.points[line * samples.times + time];
        if (!samples.there[line * samples.times + time]) continue;
        const Plane plane = plane_at(samples, line, time);
        const double reach = std::min(plane.reach, farthest_reach);
        const glm::ivec3 low = glm::clamp(glm::ivec3(glm::floor(plane.place - reach)), glm::ivec3(0), last_cell()),
                         high = glm::clamp(glm::ivec3(glm::floor(plane.place + reach)), glm::ivec3(0), last_cell());
        for (int k = low.z; k <= high.z; k++) {
          for (int j = low.y; j <= high.y; j++) {
            for (int i = low.x; i <= high.x; i++) add_plane(sample, plane, {i, j, k});
          }
        }
      }
    }
  }

  glm::ivec3 last_cell() const { return lattice_.cells - 1; }

  void add_plane(const StreamSample& sample, const Plane& plane, const glm::ivec3& cell) {
    const glm::dvec3 p = plane.place - glm::dvec3(cell) - 0.5;
    std::vector<Branch>& list = branches_[number_of(cell)];
    const auto is_known = [&](const Branch& b) {
      // Each side of a corner has a plane of its own.
      const double about = b.margin[1] + 0.5 * b.spread[1], middle = b.affine[1][0];
      if (b.from_sample ? is_corner_between(b.u_of_sample, sample.u)
                        : is_corner_between(middle - about, middle + about))
        return false;
      Three at{};
      for (std::size_t q = 0; q < 3; q++)
        at[q] = b.affine[q][0] + b.affine[q][1] * p.x + b.affine[q][2] * p.y + b.affine[q][3] * p.z;
      const double off_u = std::abs(turned(sample.u, at[1]) - at[1]), off_t = std::abs(sample.tau - at[2]);
      if (b.from_sample)
        return std::abs(at[0]) <= 0.5 * plane_margin && off_u * plane.size_u <= 1 && off_t * plane.size_t <= 1;
      return b.clear && std::abs(at[0]) <= b.margin[0] + 1e-3 * lattice_.cell && off_u <= b.margin[1] + typical_[1] &&
             off_t <= b.margin[2] + typical_[2];
    };
    if (std::ranges::any_of(list, is_known)) return;
    if (std::ranges::count_if(list, [](const Branch& b) { return b.clear || b.from_sample; }) >= BACK_MOST_BRANCHES) {
      crowded_++;
      return;
    }
    Branch b;
    const auto put = [&](std::size_t q, double value, const glm::dvec3& slope) {
      b.affine[q] = {value - glm::dot(slope, p), slope.x, slope.y, slope.z};
    };
    put(0, 0, plane.n);
    put(1, sample.u, plane.by_u);
    put(2, sample.tau, plane.by_t);
    const bool flat = plane.n != glm::dvec3(0.0);
    b.margin = {flat ? plane_margin : 1, flat ? 1 / plane.size_u : range_.y - range_.x,
                flat ? 1 / plane.size_t : time_.y - time_.x};
    b.from_sample = true;
    b.u_of_sample = sample.u;
    list.push_back(b);
    missed_++;
  }

  // How far each cell is from one that may hold something, by steps to any of 26 neighbours: there and back through the
  // lattice.
  std::vector<int> distances() const {
    std::vector<int> far(branches_.size(), farthest_empty);
    for (std::size_t c = 0; c < far.size(); c++) far[c] = branches_[c].empty() ? farthest_empty : 0;
    const glm::ivec3 n = lattice_.cells;
    for (const int way : {-1, 1}) {
      for (int kk = 0; kk < n.z; kk++) {
        for (int jj = 0; jj < n.y; jj++) {
          for (int ii = 0; ii < n.x; ii++) {
            const glm::ivec3 at = way < 0 ? glm::ivec3(ii, jj, kk) : n - 1 - glm::ivec3(ii, jj, kk);
            int& here = far[number_of(at)];
            // Half of the neighbours, those that come before in this order.
            for (int neighbour = 0; neighbour < 13; neighbour++) {
              const glm::ivec3 step = -way * glm::ivec3(neighbour % 3 - 1, neighbour / 3 % 3 - 1, neighbour / 9 - 1);
              const glm::ivec3 other = at + step;
              if (glm::any(glm::lessThan(other, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(other, n))) continue;
              here = std::min(here, far[number_of(other)] + 1);
            }
          }
        }
      }
    }
    return far;
  }

  BackTable words() const {
    BackTable table;
    const std::vector<int> far = distances();
    const auto put = [&](double value) { table.branches.push_back(std::bit_cast<std::uint32_t>(float(value))); };
    std::size_t first = 0;
    for (std::size_t c = 0; c < branches_.size(); c++) {
      const std::vector<Branch>& list = branches_[c];
      const std::size_t count = std::min<std::size_t>(list.size(), BACK_MOST_BRANCHES);
      table.cells.push_back(count == 0 ? std::uint32_t(far[c]) : std::uint32_t(BACK_FULL + 16 * first + count));
      table.full += count > 0;
      first += count;
      for (std::size_t k = 0; k < count; k++) {
        const Branch& b = list[k];
        for (std::size_t q = 0; q < 3; q++) {
          for (const double a : b.affine[q]) put(a);
        }
        for (const double m : b.margin) put(m);
        put(b.clear ? BRANCH_IS_CLEAR : (b.from_sample ? BRANCH_IS_SAMPLE : 0));
        (b.clear ? table.clear : table.unclear)++;
      }
    }
    table.missed = missed_;
    table.crowded = crowded_;
    if (table.branches.empty()) table.branches.resize(BRANCH_WORDS);
    return table;
  }

  const glm::dvec2 range_;
  const std::vector<double> corners_;
  const glm::dvec2 time_;
  const bool closed_;
  const Lattice& lattice_;
  const std::vector<std::uint32_t>& nodes_;
  const Three length_;  // of W, u and τ, per unit of each
  Three typical_{};
  std::vector<std::vector<Branch>> branches_;
  std::size_t missed_ = 0, crowded_ = 0;
};

}  // namespace

BackTable make_back_table(const StreamSurface& surface, const Curtain& curtain, bool closed, const Lattice& lattice,
                          const std::vector<std::uint32_t>& nodes, const StreamSamples& samples) {
  return TableMaker(surface, curtain, closed, lattice, nodes).make(samples);
}

}  // namespace smurf
