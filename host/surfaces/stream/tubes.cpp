#include "surfaces/stream/tubes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "numerics/parallel.hpp"

namespace smurf {
namespace {

using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double reach = leaf_reach;  // bounds hold so far beyond a cell
constexpr int lattice = 24;           // of boxes over the field, each with its bound of D²v
constexpr int most_turns = 30;        // of the bound within one interval

// Bounds of D²v on a lattice over the field.
class BendBounds {
 public:
  explicit BendBounds(const VectorFieldDefinition& field) : bounds_(field.bounds()) {
    if (field.greatest_bend(bounds_) == infinity && field.smoothness() < 2) return;
    values_.resize(std::size_t(lattice) * lattice * lattice);
    const dvec3 size = (bounds_.upper - bounds_.lower) / double(lattice);
    parallel_for(std::size_t(lattice) * lattice, [&](std::size_t row) {
      for (int i = 0; i < lattice; i++) {
        const dvec3 at(i, double(row % lattice), double(row / lattice));
        const dvec3 lower = bounds_.lower + at * size;
        values_[row * lattice + std::size_t(i)] = field.greatest_bend({lower, lower + size});
      }
    });
  }
  bool are_known() const { return !values_.empty(); }

  // Within a ball. Beyond the field nothing is known, and no streamline goes there.
  double within(const dvec3& centre, double radius) const {
    const dvec3 scale = double(lattice) / (bounds_.upper - bounds_.lower);
    const auto index = [&](double x) { return std::clamp(int(std::floor(x)), 0, lattice - 1); };
    const dvec3 low = (centre - radius - bounds_.lower) * scale, high = (centre + radius - bounds_.lower) * scale;
    double greatest = 0;
    for (int k = index(low.z); k <= index(high.z); k++) {
      for (int j = index(low.y); j <= index(high.y); j++) {
        for (int i = index(low.x); i <= index(high.x); i++)
          greatest =
              std::max(greatest, values_[(std::size_t(k) * lattice + std::size_t(j)) * lattice + std::size_t(i)]);
      }
    }
    return greatest;
  }

 private:
  Bounds bounds_;
  std::vector<double> values_;
};

struct TubeRow {
  double rho = infinity, eta = infinity, bend = 0;  // `bend`: the bound of D²v there
};

// From row 0 on, as far as bounds stay finite.
std::vector<TubeRow> tube_of(const std::vector<const StreamNode*>& nodes, double interval, double delta,
                             double bend_of_seed, const BendBounds& bends) {
  std::vector<TubeRow> rows(nodes.size());
  rows[0] = {0.5 * bend_of_seed * delta * delta, bend_of_seed * delta, 0};
  for (std::size_t i = 0; i + 1 < nodes.size(); i++) {
    const StreamNode &a = *nodes[i], &b = *nodes[i + 1];
    const double slope = std::max(a.slope, b.slope), speed = double(std::max(glm::length(a.v), glm::length(b.v)));
    const double way = 0.5 * speed * interval * (1 + slope * interval);
    const double stretch = double(std::max(glm::length(a.u), glm::length(b.u))) * std::exp(0.5 * slope * interval);
    double rho = rows[i].rho, eta = rows[i].eta;
    bool settled = false;
    TubeRow next;
    for (int turn = 0; turn < most_turns && !settled; turn++) {
      const double radius = stretch * delta + rho;
      const double m = bends.within(0.5 * (dvec3(a.x) + dvec3(b.x)), radius + way);
      // Dv changes between rows by no more than M times the way.
      const double rate = double(std::max(a.rate, b.rate)) + m * way;
      const double grows = std::exp(rate * interval), most = std::max(1.0, grows);
      next = {rows[i].rho * grows + 0.5 * m * radius * radius * interval * most,
              rows[i].eta * grows + m * radius * (stretch + eta) * interval * most, m};
      if (!std::isfinite(next.rho + next.eta)) return rows;
      const double greatest_rho = std::max(rows[i].rho * most, next.rho),
                   greatest_eta = std::max(rows[i].eta * most, next.eta);
      settled = greatest_rho <= rho && greatest_eta <= eta;
      rho = std::max(rho, 1.01 * greatest_rho);
      eta = std::max(eta, 1.01 * greatest_eta);
    }
    if (!settled) return rows;
    rows[i + 1] = next;
    rows[i].bend = std::max(rows[i].bend, next.bend);
  }
  return rows;
}

double largest(const glm::dvec3& v) { return std::max({v.x, v.y, v.z}); }

}  // namespace

void prove_cells(const VectorFieldDefinition& field, const SeedCurve& curve, const StreamCells& cells,
                 const std::vector<BezierPiece>& pieces, StreamMesh& mesh) {
  // Between the seed and where rows begin nothing is known.
  for (const StreamSection& section : cells.sections()) {
    if (section.start != 0) return;
  }
  const BendBounds bends(field);
  if (!bends.are_known()) return;
  const BezierSource source(pieces);
  // Cells with the same middle streamline have the same tube.
  std::map<std::tuple<int, std::int32_t, std::int32_t, bool>, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < cells.cells().size(); i++) {
    const LatticeBox& box = cells.cells()[i];
    if (box.columns > 1) groups[{box.strip, box.column, box.columns, box.row < 0}].push_back(i);
  }
  std::vector<std::vector<std::size_t>> all;
  for (auto& [key, group] : groups) all.push_back(std::move(group));
  parallel_for(all.size(), [&](std::size_t g) {
    const LatticeBox& first = cells.cells()[all[g][0]];
    const bool back = first.row < 0;
    const StreamSection& section = back ? cells.sections().front() : cells.sections().back();
    const std::int32_t middle = first.column + first.columns / 2;
    std::vector<const StreamNode*> nodes;
    for (std::int32_t row = 0; row <= section.rows; row++) {
      const StreamNode* n = cells.node(first.strip, middle, back ? -row : row, back);
      if (!n) break;
      nodes.push_back(n);
    }
    const double from = cells.u_at(first.column), to = cells.u_at(first.column + first.columns);
    const double delta = reach * 0.5 * (to - from), interval = std::abs(section.interval());
    const double beyond = 0.5 * (reach - 1) * (to - from);
    const std::vector<TubeRow> tube =
        tube_of(nodes, interval, delta, curve.greatest_bend(from - beyond, to + beyond), bends);
    for (const std::size_t i : all[g]) {
      const LatticeBox& box = cells.cells()[i];
      StreamCell& cell = mesh.cells[i];
      const dvec3 size(cell.upper.x - cell.lower.x, cell.upper.y - cell.lower.y, 0);
      const double wide = 0.5 * (reach - 1);
      const std::optional<PieceBounds> bounds = source.bounds(i, {glm::dvec2(-wide), glm::dvec2(1 + wide)});
      if (!bounds) continue;
      const std::int32_t near = back ? -(box.row + box.rows) : box.row, far = near + box.rows;
      const auto margin = std::int32_t(std::ceil(wide * box.rows));
      double off_u = 0, off_v = 0;
      for (std::int32_t row = std::max(0, near - margin); row <= std::min(far + margin, std::int32_t(nodes.size()) - 1);
           row++) {
        const auto r = std::size_t(row);
        const StreamNode& n = *nodes[r];
        const double t = (cells.time_at(back ? -row : row) - cell.lower.y) / size.y;
        const PatchPoint p = evaluate_unit(pieces[i], 0.5, t);
        const double radius = double(glm::length(n.u)) * delta + tube[r].rho;
        off_u = std::max(off_u, tube[r].eta + glm::distance(dvec3(n.u), p.u / size.x));
        off_v = std::max(off_v, double(glm::length(n.uv)) * delta + double(n.slope) * tube[r].rho +
                                    0.5 * tube[r].bend * radius * radius + glm::distance(dvec3(n.v), p.v / size.y));
      }
      // From the middle of the patch to its sides.
      off_u += largest(bounds->uu) / (size.x * size.x) * delta;
      off_v += largest(bounds->uv) / (size.x * size.y) * delta;
      if (!std::isfinite(off_u + off_v)) continue;
      cell.proved = true;
      cell.off_u = off_u;
      cell.off_v = off_v;
    }
  });
}

}  // namespace smurf
