#include "surfaces/stream/tubes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <tuple>

#include "numerics/parallel.hpp"

namespace smurf {
namespace {

using glm::dvec3;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double reach = leaf_reach;    // bounds hold so far beyond a cell
constexpr int lattice = 24;             // of boxes over the field, each with its bound of D²v
constexpr double largest_proved = 0.3;  // of the shorter tangent, how long a remainder may be that isolates
constexpr int most_parts = 64;          // streamlines across a cell
constexpr std::size_t most_seeds = 1 << 14;
constexpr int most_turns = 30;  // of the bound within one interval

// Bounds of D²v on a lattice over the field.
class BendBounds {
 public:
  explicit BendBounds(const VectorFieldDefinition& field) : bounds_(field.bounds()) {
    if (field.greatest_bend(bounds_) == infinity && field.smoothness() < 2) return;
    values_.resize(std::size_t(lattice) * lattice * lattice);
    const dvec3 size = (bounds_.upper - bounds_.lower) / double(lattice);
    parallel_for(std::size_t(lattice) * lattice, [&](std::size_t row) {
      for (int i = 0; i < lattice; i++) {
        const std::size_t j = row % lattice, k = row / lattice;
        const dvec3 at(i, double(j), double(k));
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
std::vector<TubeRow> tube_of(const std::vector<StreamNode>& nodes, const StreamSection& section, double delta,
                             double bend_of_seed, const BendBounds& bends) {
  std::vector<TubeRow> rows(nodes.size());
  rows[0] = {0.5 * bend_of_seed * delta * delta, bend_of_seed * delta, 0};
  for (std::size_t i = 0; i + 1 < nodes.size(); i++) {
    const StreamNode &a = nodes[i], &b = nodes[i + 1];
    const double interval = std::abs(section.interval(int(i)));
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

double more_remainder(const StreamCell& cell, const PatchLeaf& leaf) {
  const glm::dvec2 size = cell.upper - cell.lower;
  return cell.off_u * size.x * leaf.half.x + cell.off_v * size.y * leaf.half.y;
}

namespace {

// What a number of streamlines across cells of the same columns tell of them.
struct Proof {
  std::vector<std::size_t> cells;
  int strip = 0;
  bool before = false;
  double from = 0, to = 0;  // u that bounds are wanted for
  std::size_t first_seed = 0;
};

// Whether more streamlines may prove a cell: what they leave falls as their number grows, and faster where tubes are
// wide. Where there are no bounds at all there is hope twice.
bool may_be_proved(const StreamMesh& mesh, std::size_t cell, std::span<const PatchLeaf> leaves, int parts) {
  if (!std::isfinite(mesh.cells[cell].off_u + mesh.cells[cell].off_v)) return parts <= 16;
  return std::ranges::all_of(leaves, [&](const PatchLeaf& leaf) {
    return more_remainder(mesh.cells[cell], leaf) <=
           4.0 * most_parts / parts * largest_proved * std::min(glm::length(leaf.a), glm::length(leaf.b));
  });
}

bool is_proved(const StreamMesh& mesh, std::size_t cell, std::span<const PatchLeaf> leaves) {
  return std::ranges::all_of(leaves, [&](const PatchLeaf& leaf) {
    return leaf.kind == LeafKind::regular && glm::length(leaf.e) + more_remainder(mesh.cells[cell], leaf) <=
                                                 largest_proved * std::min(glm::length(leaf.a), glm::length(leaf.b));
  });
}

// Bounds of |s_uvv| and |s_vvv| of a bicubic piece, in its own parameters, also an eighth beyond it.
glm::dvec2 third_derivatives(const BezierPiece& piece) {
  const auto at = [&](int i, int j) { return dvec3(piece.points[4 * std::size_t(j) + std::size_t(i)]); };
  glm::dvec2 greatest(0.0);
  for (int i = 0; i < 4; i++) {
    for (int j = 0; j < 2 && i < 3; j++) {
      const dvec3 right = at(i + 1, j) - 2.0 * at(i + 1, j + 1) + at(i + 1, j + 2),
                  left = at(i, j) - 2.0 * at(i, j + 1) + at(i, j + 2);
      greatest.x = std::max(greatest.x, 18 * glm::length(right - left));
    }
    greatest.y = std::max(greatest.y, 6 * glm::length(at(i, 3) - 3.0 * at(i, 2) + 3.0 * at(i, 1) - at(i, 0)));
  }
  // Weights of control points beyond the piece, in sum: degree 2 × 1, and 3 in u.
  const double wide = reach + 1e-9;
  return {greatest.x * std::pow(wide, 3), greatest.y * std::pow(wide, 3)};
}

// Bounds of a cell by one tube, which is `delta` wide.
void add_tube(const StreamMesh& mesh, std::size_t number, const StreamSection& section, const StreamLine& line,
              int part, double u, double delta, const std::vector<TubeRow>& tube, StreamCell& cell) {
  const glm::dvec2 size = cell.upper - cell.lower;
  const double wide = 0.5 * (reach - 1);
  const std::optional<PieceBounds> bounds = mesh.pieces->bounds(number, {glm::dvec2(-wide), glm::dvec2(1 + wide)});
  const glm::dvec2 bounds_of_third = third_derivatives(mesh.pieces->pieces()[number]);
  const std::vector<StreamNode>& nodes = line.nodes[std::size_t(part)];
  const double first = section.row_of(cell.lower.y - wide * size.y),
               last = section.row_of(cell.upper.y + wide * size.y);
  const int from = std::max(0, int(std::floor(std::min(first, last) + 1e-9))),
            to = std::min(section.rows, int(std::ceil(std::max(first, last) - 1e-9)));
  const double s = (u - cell.lower.x) / size.x;
  for (int row = from; row <= to; row++) {
    const auto r = std::size_t(row);
    if (r >= nodes.size() || !bounds) {
      cell.off_u = cell.off_v = infinity;
      return;
    }
    const StreamNode& n = nodes[r];
    const PatchPoint p = evaluate_unit(mesh.pieces->pieces()[number], s, (section.at(row) - cell.lower.y) / size.y);
    const double radius = double(glm::length(n.u)) * delta + tube[r].rho;
    const double off_u = tube[r].eta + glm::distance(dvec3(n.u), p.u / size.x);
    const double off_v = double(glm::length(n.uv)) * delta + double(n.slope) * tube[r].rho +
                         0.5 * tube[r].bend * radius * radius + glm::distance(dvec3(n.v), p.v / size.y);
    // From the middle of the tube to its sides; and half way to the next rows, by the rates of what was compared and
    // bounds of how these change.
    const double to_row = 0.5 * std::abs(section.interval(row)), slope = n.slope, bend = tube[r].bend;
    const double width = double(glm::length(n.u)), speed = double(glm::length(n.v));
    const double turns_u = (bend * speed + slope * slope) * width, turns_v = (bend * speed + slope * slope) * speed;
    const double more_u = largest(bounds->uu) / (size.x * size.x) * delta +
                          to_row * (glm::distance(dvec3(n.uv), p.uv / (size.x * size.y)) +
                                    to_row * (turns_u + bounds_of_third.x / (size.x * size.y * size.y)));
    const double more_v = largest(bounds->uv) / (size.x * size.y) * delta +
                          to_row * (glm::distance(dvec3(n.vv), p.vv / (size.y * size.y)) +
                                    to_row * (turns_v + bounds_of_third.y / (size.y * size.y * size.y)));
    cell.off_u = std::max(cell.off_u, off_u + more_u);
    cell.off_v = std::max(cell.off_v, off_v + more_v);
    if (!std::isfinite(cell.off_u + cell.off_v)) return;
  }
}

}  // namespace

void prove_cells(FlowQueries& flow, const VectorFieldDefinition& field, const SeedCurve& curve,
                 const StreamCells& cells, StreamMesh& mesh) {
  const BendBounds bends(field);
  if (!bends.are_known()) return;
  std::vector<std::size_t> first_leaf(mesh.cells.size() + 1, mesh.leaves.size());
  for (std::size_t l = mesh.leaves.size(); l-- > 0;) first_leaf[mesh.leaves[l].piece] = l;
  for (std::size_t c = mesh.cells.size(); c-- > 0;) first_leaf[c] = std::min(first_leaf[c], first_leaf[c + 1]);
  const auto leaves_of = [&](std::size_t cell) {
    return std::span(mesh.leaves).subspan(first_leaf[cell], first_leaf[cell + 1] - first_leaf[cell]);
  };
  // Streamlines of their own, with as many rows as bounds need.
  StreamLines lines(flow, field, curve, {mesh.lower.y, mesh.upper.y}, cells.tolerance_of_step());
  lines.set_rows(cells.sections()[0].pieces, cells.sections()[0].rows_of_piece() / 2);
  for (int parts = 1; parts <= most_parts; parts *= 4) {
    std::map<std::tuple<int, std::int32_t, std::int32_t, bool>, Proof> groups;
    for (std::size_t i = 0; i < mesh.cells.size(); i++) {
      const LatticeBox& box = cells.cells()[i];
      if (mesh.cells[i].proved || (parts > 1 && !may_be_proved(mesh, i, leaves_of(i), parts))) continue;
      Proof& proof = groups[{box.strip, box.column, box.columns, box.row < 0}];
      proof.cells.push_back(i);
      const double width = mesh.cells[i].upper.x - mesh.cells[i].lower.x, beyond = 0.5 * (reach - 1) * width;
      const glm::dvec2 range = cells.range_of(box.strip);
      proof.from = std::max(mesh.cells[i].lower.x - beyond, range.x);
      proof.to = std::min(mesh.cells[i].upper.x + beyond, range.y);
      proof.before = box.row < 0;
    }
    std::vector<Proof> proofs;
    std::vector<StreamSeed> seeds;
    for (auto& [key, proof] : groups) {
      if (seeds.size() + std::size_t(parts) > most_seeds) break;
      proof.first_seed = seeds.size();
      for (int k = 0; k < parts; k++) seeds.push_back({std::lerp(proof.from, proof.to, (k + 0.5) / parts)});
      proofs.push_back(std::move(proof));
    }
    if (seeds.empty()) break;
    const std::vector<StreamLine> traced = lines.trace(seeds);
    parallel_for(proofs.size(), [&](std::size_t g) {
      const Proof& proof = proofs[g];
      const auto part = std::size_t(proof.before ? 0 : lines.sections().size() - 1);
      const StreamSection& section = lines.sections()[part];
      const double delta = 0.5 * (proof.to - proof.from) / parts * (1 + 1e-9);
      for (const std::size_t i : proof.cells) mesh.cells[i].off_u = mesh.cells[i].off_v = 0;
      for (int k = 0; k < parts; k++) {
        const std::size_t seed = proof.first_seed + std::size_t(k);
        const std::vector<StreamNode>& nodes = traced[seed].nodes[part];
        std::vector<TubeRow> tube;
        const double bend = curve.greatest_bend(seeds[seed].u - delta, seeds[seed].u + delta);
        if (!nodes.empty()) tube = tube_of(nodes, section, delta, bend, bends);
        for (const std::size_t i : proof.cells)
          add_tube(mesh, i, section, traced[seed], int(part), seeds[seed].u, delta, tube, mesh.cells[i]);
      }
      for (const std::size_t i : proof.cells) mesh.cells[i].proved = is_proved(mesh, i, leaves_of(i));
    });
  }
  mesh.proved = std::size_t(std::ranges::count_if(mesh.cells, &StreamCell::proved));
}

}  // namespace smurf
