#include "surfaces/stream/mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <unordered_map>

#include "numerics/parallel.hpp"
#include "smurf/error.hpp"
#include "surfaces/stream/cells.hpp"
#include "surfaces/stream/tubes.hpp"

namespace smurf {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr int seeds_looked_at = 257;
constexpr double along_flow = 1e-6;        // the sine of an angle that is none
constexpr double of_tolerance = 1.0 / 64;  // what one step of an integrator may err by
constexpr double roundings = 16;           // that second derivatives of a patch are off by, of the cell's size
constexpr double fitting_part = 0.9;       // of the tolerance, where deviations are measured
constexpr int most_turns = 12;
constexpr double least_tolerance = 2e-8;  // of a step, of the extent: floats do no better

[[noreturn]] void refuse(const std::string& message) { throw Error(ErrorCode::input, message); }

double extent_of(const Bounds& bounds) {
  const dvec3 size = bounds.upper - bounds.lower;
  return std::max({size.x, size.y, size.z});
}

void require_surface(FlowQueries& flow, const VectorFieldDefinition& field, const SeedCurve& curve) {
  const FlowSeeds seeds = curve.sample(seeds_looked_at);
  std::vector<glm::vec3> points;
  for (const dvec3& p : seeds.positions) points.emplace_back(p);
  const FlowSamples samples = flow.sample(points, 0);
  std::size_t inside = 0, moving = 0, across = 0;
  for (std::size_t i = 0; i < points.size(); i++) {
    if (samples.status[i] != FlowStatus::inside) continue;
    inside++;
    const dvec3 v(samples.value[i]), &u = seeds.tangents[i];
    const double speed = glm::length(v);
    if (speed == 0) continue;
    moving++;
    if (!(glm::length(glm::cross(u, v)) <= along_flow * glm::length(u) * speed)) across++;
  }
  const Bounds bounds = field.bounds();
  const dvec3 &a = bounds.lower, &b = bounds.upper, &p = seeds.positions.front();
  if (inside == 0)
    refuse(
        fmt::format("seed: no place of the curve lies in the field; it begins at ({:g}, {:g}, {:g}), and the field "
                    "reaches from ({:g}, {:g}, {:g}) to ({:g}, {:g}, {:g})",
                    p.x, p.y, p.z, a.x, a.y, a.z, b.x, b.y, b.z));
  if (moving == 0) refuse("seed: the field is zero all along the curve; nothing moves there");
  if (across == 0)
    refuse(
        "seed: the curve runs along the flow throughout, and its streamlines are one line; a surface needs a curve "
        "across the flow");
}

// ---- Corners that fit
//
// A corner on a larger cell's side is where the side's cubic is, with its slope. Derivatives across the side stay those
// of the streamline: the larger cell's own would be as wrong as its size allows.

struct NodeKey {
  int strip;
  std::int32_t column, row;
  bool operator==(const NodeKey&) const = default;
};
struct SideKey {
  bool along_u;
  std::int32_t fixed, start, length;
  bool operator==(const SideKey&) const = default;
};
std::size_t mixed(std::size_t hash, std::int64_t value) {
  return (hash ^ std::size_t(value)) * 0x9e3779b97f4a7c15u + (hash >> 29);
}
struct Hash {
  std::size_t operator()(const NodeKey& k) const { return mixed(mixed(std::size_t(k.strip), k.column), k.row); }
  std::size_t operator()(const SideKey& k) const {
    return mixed(mixed(mixed(std::size_t(k.along_u), k.fixed), k.start), k.length);
  }
};

// The cubic of a value and its derivative at both ends of a side of length h, at s of [0, 1].
struct Cubic {
  dvec3 value, slope;
};
Cubic cubic_at(const dvec3& a, const dvec3& da, const dvec3& b, const dvec3& db, double h, double s) {
  const double s2 = s * s, s3 = s2 * s;
  return {(1 - 3 * s2 + 2 * s3) * a + (3 * s2 - 2 * s3) * b + h * ((s - 2 * s2 + s3) * da + (s3 - s2) * db),
          (6 * s - 6 * s2) / h * (b - a) + (1 - 4 * s + 3 * s2) * da + (3 * s2 - 2 * s) * db};
}

class Corners {
 public:
  explicit Corners(const StreamCells& cells) : cells_(cells) {
    for (std::size_t i = 0; i < cells.cells().size(); i++) {
      const LatticeBox& box = cells.cells()[i];
      for (const std::int32_t end : {0, 1}) {
        sides_.emplace(SideKey{true, box.row + end * box.rows, box.column, box.columns}, i);
        sides_.emplace(SideKey{false, box.column + end * box.columns, box.row, box.rows}, i);
      }
    }
  }

  std::array<StreamCorner, 4> of(const LatticeBox& box) {
    std::array<StreamCorner, 4> result;
    for (int i = 0; i < 4; i++)
      result[std::size_t(i)] = at({box.strip, box.column + (i % 2) * box.columns, box.row + (i / 2) * box.rows});
    return result;
  }

  // The side of a larger cell that a corner lies within.
  struct Hanging {
    bool along_u;
    std::int32_t start, length;
    std::size_t cell;
  };
  std::optional<Hanging> side_of(const NodeKey& key) const {
    for (std::int32_t length = 2; length <= cells_.base_columns(); length *= 2) {
      const std::int32_t start = key.column & ~(length - 1);
      const auto side = start == key.column ? sides_.end() : sides_.find({true, key.row, start, length});
      if (side != sides_.end()) return Hanging{true, start, length, side->second};
    }
    for (std::int32_t length = 2; length <= cells_.base_rows(); length *= 2) {
      const std::int32_t start = key.row & ~(length - 1);
      const auto side = start == key.row ? sides_.end() : sides_.find({false, key.column, start, length});
      if (side != sides_.end()) return Hanging{false, start, length, side->second};
    }
    return std::nullopt;
  }

 private:
  // A corner is on larger cells' sides at most two deep along each of a few lines, so that this ends soon.
  StreamCorner at(const NodeKey& key) {
    if (const auto found = known_.find(key); found != known_.end()) return found->second;
    const StreamCorner corner = make(key);
    known_.emplace(key, corner);
    return corner;
  }

  StreamCorner make(const NodeKey& key) {
    const StreamNode& n = *cells_.node(key.strip, key.column, key.row);
    StreamCorner corner{dvec3(n.x), dvec3(n.u), dvec3(n.v), dvec3(n.uv)};
    const std::optional<Hanging> on = side_of(key);
    if (on && on->along_u) {
      const StreamCorner a = at({key.strip, on->start, key.row}), b = at({key.strip, on->start + on->length, key.row});
      const double from = cells_.u_at(on->start), h = cells_.u_at(on->start + on->length) - from;
      const Cubic x = cubic_at(a.x, a.u, b.x, b.u, h, (cells_.u_at(key.column) - from) / h);
      corner.x = x.value;
      corner.u = x.slope;
    } else if (on) {
      const int strip = cells_.cells()[on->cell].strip;
      const StreamCorner a = at({strip, key.column, on->start}), b = at({strip, key.column, on->start + on->length});
      const double from = cells_.time_at(on->start), h = cells_.time_at(on->start + on->length) - from;
      const Cubic x = cubic_at(a.x, a.v, b.x, b.v, h, (cells_.time_at(key.row) - from) / h);
      corner.x = x.value;
      corner.v = x.slope;
    }
    return corner;
  }

  const StreamCells& cells_;
  std::unordered_map<SideKey, std::size_t, Hash> sides_;  // the first cell that has it
  std::unordered_map<NodeKey, StreamCorner, Hash> known_;
};

// Corners that are moved to a larger cell's side may take a cell beyond the tolerance. Then the larger one is halved,
// or the cell itself where it has no such corner.
void refine_to_fit(StreamCells& cells, double tolerance) {
  for (int turn = 0; turn < most_turns; turn++) {
    Corners corners(cells);
    std::map<std::size_t, bool> halved;  // whether in time
    for (std::size_t i = 0; i < cells.cells().size(); i++) {
      const LatticeBox& box = cells.cells()[i];
      if (cells.deviation(box, corners.of(box)) <= std::max(fitting_part * tolerance, 2 * cells.noise_of(box)))
        continue;
      bool hangs = false;
      for (int k = 0; k < 4; k++) {
        const auto on = corners.side_of({box.strip, box.column + (k % 2) * box.columns, box.row + (k / 2) * box.rows});
        if (!on) continue;
        hangs = true;
        halved.emplace(on->cell, !on->along_u);
      }
      if (!hangs) halved.emplace(i, false);
    }
    if (halved.empty()) return;
    cells.refine_further(halved);
  }
}

BezierPiece piece_of(const std::array<StreamCorner, 4>& c, const dvec2& lower, const dvec2& upper) {
  BezierPiece piece;
  piece.degree = {3, 3};
  piece.lower = lower;
  piece.upper = upper;
  const dvec2 third = (upper - lower) / 3.0;
  piece.points.resize(16);
  for (int j = 0; j < 4; j++) {
    for (int i = 0; i < 4; i++) {
      const StreamCorner& p = c[std::size_t(i) / 2 + 2 * (std::size_t(j) / 2)];
      const double du = i == 1 ? third.x : (i == 2 ? -third.x : 0), dv = j == 1 ? third.y : (j == 2 ? -third.y : 0);
      piece.points[4 * std::size_t(j) + std::size_t(i)] = glm::dvec4(p.x + du * p.u + dv * p.v + du * dv * p.uv, 1.0);
    }
  }
  return piece;
}

// ---- What is measured of cells

// What the second derivatives at the corners have beyond those of the patch.
void add_beyond(const StreamCells& cells, const LatticeBox& box, const BezierPiece& piece, StreamCell& cell) {
  for (int i = 0; i < 4; i++) {
    const int at_u = i % 2, at_v = i / 2;
    const StreamNode& n = *cells.node(box.strip, box.column + at_u * box.columns, box.row + at_v * box.rows);
    const PatchPoint p =
        evaluate(piece, at_u == 0 ? piece.lower.x : piece.upper.x, at_v == 0 ? piece.lower.y : piece.upper.y);
    cell.beyond_uu[std::size_t(i)] = dvec3(n.uu) - p.uu;
    cell.beyond_vv[std::size_t(i)] = dvec3(n.vv) - p.vv;
  }
}

// The second derivative by u with what is beyond the patch: the error of a cubic between ends that are exact is that of
// a quartic, 1 - 6 s (1 - s) times its value at the ends.
dvec3 with_beyond(const dvec3& second, const std::array<dvec3, 4>& beyond, double s, double t, double along) {
  const dvec3 mean = (1 - t) * ((1 - s) * beyond[0] + s * beyond[1]) + t * ((1 - s) * beyond[2] + s * beyond[3]);
  return second + (1 - 6 * along * (1 - along)) * mean;
}

// What second derivatives along the normal are off by, relative to the greatest of them there, where streamlines tell
// what they are: on the middle one, and half way along those at the sides.
double curvature_error(const StreamCells& cells, const LatticeBox& box, const BezierPiece& piece,
                       const StreamCell& cell) {
  double greatest = 0;
  const glm::dvec2 size = cell.upper - cell.lower;
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      const std::int32_t columns = i * box.columns / 2, rows = j * box.rows / 2;
      const bool corner = i != 1 && j != 1;
      const bool halved = (i != 1 || box.columns > 1) && (j != 1 || box.rows > 1);
      const StreamNode* n = halved && !corner ? cells.node(box.strip, box.column + columns, box.row + rows) : nullptr;
      if (!n) continue;
      const double s = 0.5 * i, t = 0.5 * j;
      const PatchPoint p = evaluate(piece, cell.lower.x + s * size.x, cell.lower.y + t * size.y);
      const dvec3 u(n->u), v(n->v), normal = glm::cross(u, v);
      const double area = glm::length(normal);
      if (!(area > 1e-3 * glm::length(u) * glm::length(v))) continue;
      // Of the directions across and along the streamline: x_u less its part along the flow, and v.
      const double speed = glm::length(v), width = area / speed, lean = glm::dot(u, v) / (speed * speed);
      const auto along_normal = [&](const dvec3& second) { return glm::dot(second, normal) / area; };
      const auto greatest_of = [&](double uu, double uv, double vv) {
        return std::max(
            {std::abs(uu) / (width * width), std::abs(uv) / (width * speed), std::abs(vv) / (speed * speed)});
      };
      const double off_uu = std::abs(along_normal(with_beyond(p.uu, cell.beyond_uu, s, t, s) - dvec3(n->uu))),
                   off_vv = std::abs(along_normal(with_beyond(p.vv, cell.beyond_vv, s, t, t) - dvec3(n->vv))),
                   off_uv = std::abs(along_normal(p.uv - dvec3(n->uv))), leans = std::abs(lean);
      const double wrong =
          greatest_of(off_uu + 2 * leans * off_uv + leans * leans * off_vv, off_uv + leans * off_vv, off_vv);
      const double uu = along_normal(dvec3(n->uu)), uv = along_normal(dvec3(n->uv)), vv = along_normal(dvec3(n->vv));
      const double bent = greatest_of(uu - 2 * lean * uv + lean * lean * vv, uv - lean * vv, vv);
      // Devices round control points, which are as far apart as a third of the cell.
      const double rounding = roundings * 0x1p-24 / std::min(width * size.x, speed * size.y);
      if (bent > 0) greatest = std::max(greatest, (wrong + rounding) / bent);
    }
  }
  return greatest;
}

Bounds bounds_of(const std::vector<BezierPiece>& pieces, const std::vector<StreamBorder>& borders) {
  Bounds bounds{dvec3(INFINITY), dvec3(-INFINITY)};
  for (const BezierPiece& piece : pieces) {
    for (const glm::dvec4& p : piece.points) {
      bounds.lower = glm::min(bounds.lower, dvec3(p));
      bounds.upper = glm::max(bounds.upper, dvec3(p));
    }
  }
  for (const StreamBorder& border : borders) {
    bounds.lower = glm::min(bounds.lower, border.space.lower);
    bounds.upper = glm::max(bounds.upper, border.space.upper);
  }
  return bounds;
}

// ---- Polygons, and the tree of cells

StreamPolygons polygons_of(const StreamCells& cells) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::uint32_t> numbers;  // by row, then column
  std::map<std::int32_t, std::vector<std::int32_t>> rows_of;               // nodes of a column
  for (const LatticeBox& box : cells.cells()) {
    for (const std::int32_t i : {0, 1}) {
      for (const std::int32_t j : {0, 1})
        numbers.emplace(std::pair(box.row + j * box.rows, box.column + i * box.columns), 0u);
    }
  }
  StreamPolygons polygons;
  for (auto& [node, number] : numbers) {
    number = std::uint32_t(polygons.places.size());
    polygons.places.emplace_back(cells.u_at(node.second), cells.time_at(node.first));
    rows_of[node.second].push_back(node.first);  // in order
  }
  polygons.offsets.push_back(0);
  for (const LatticeBox& box : cells.cells()) {
    const std::int32_t left = box.column, right = box.column + box.columns, low = box.row, high = box.row + box.rows;
    const auto row_of_nodes = [&](std::int32_t row) {
      std::vector<std::uint32_t> found;
      for (auto at = numbers.lower_bound({row, left}); at != numbers.end() && at->first.first == row; ++at) {
        if (at->first.second > right) break;
        found.push_back(at->second);
      }
      return found;
    };
    const auto column_of_nodes = [&](std::int32_t column) {  // between low and high
      std::vector<std::uint32_t> found;
      const std::vector<std::int32_t>& all = rows_of.at(column);
      for (auto at = std::ranges::upper_bound(all, low); at != all.end() && *at < high; ++at)
        found.push_back(numbers.at({*at, column}));
      return found;
    };
    const std::vector<std::uint32_t> bottom = row_of_nodes(low), top = row_of_nodes(high), up = column_of_nodes(right),
                                     down = column_of_nodes(left);
    polygons.corners.insert(polygons.corners.end(), bottom.begin(), bottom.end());
    polygons.corners.insert(polygons.corners.end(), up.begin(), up.end());
    polygons.corners.insert(polygons.corners.end(), top.rbegin(), top.rend());
    polygons.corners.insert(polygons.corners.end(), down.rbegin(), down.rend());
    polygons.offsets.push_back(std::uint32_t(polygons.corners.size()));
  }
  return polygons;
}

void make_tree(const StreamCells& cells, StreamMesh& mesh) {
  const std::int32_t width = cells.base_columns(), height = cells.base_rows(), lowest = cells.lowest_row();
  mesh.base = {cells.columns() / width, (cells.highest_row() - lowest) / height};
  mesh.lower = {cells.u_at(0), cells.time_at(lowest)};
  mesh.upper = {cells.u_at(cells.columns()), cells.time_at(cells.highest_row())};
  for (std::int32_t i = 0; i <= mesh.base.y; i++) mesh.base_times.push_back(cells.time_at(lowest + i * height));
  mesh.tree.assign(std::size_t(mesh.base.x) * std::size_t(mesh.base.y), StreamMesh::no_cell);
  for (std::size_t number = 0; number < cells.cells().size(); number++) {
    const LatticeBox& box = cells.cells()[number];
    LatticeBox at{box.strip, box.column / width * width, width, lowest + (box.row - lowest) / height * height, height};
    std::size_t node =
        std::size_t(at.column / width) + std::size_t(mesh.base.x) * std::size_t((at.row - lowest) / height);
    // A box is halved in τ first where that was done first: the cells of a box that is halved in u are no taller.
    while (at.columns > box.columns || at.rows > box.rows) {
      if (mesh.tree[node] == StreamMesh::no_cell) {
        const bool in_time = cells.was_halved_in_time(at);
        mesh.tree[node] = std::int32_t(2 * mesh.tree.size() + (in_time ? 1 : 0));
        mesh.tree.resize(mesh.tree.size() + 2, StreamMesh::no_cell);
      }
      const bool in_time = (mesh.tree[node] & 1) != 0;
      node = std::size_t(mesh.tree[node] / 2);
      std::int32_t& size = in_time ? at.rows : at.columns;
      std::int32_t& start = in_time ? at.row : at.column;
      size /= 2;
      if ((in_time ? box.row : box.column) >= start + size) {
        start += size;
        node++;
      }
    }
    mesh.tree[node] = -1 - std::int32_t(number);
  }
}

}  // namespace

StreamMesh make_stream_mesh(FlowQueries& flow, const VectorFieldDefinition& field, const SeedCurve& seed,
                            const dvec2& time, double tolerance) {
  const auto begin = std::chrono::steady_clock::now();
  require_surface(flow, field, seed);
  const double extent = extent_of(field.bounds());
  StreamLines lines(flow, field, seed, time, std::max(of_tolerance * tolerance, least_tolerance * extent));
  StreamCells cells(lines, seed, tolerance, extent);
  cells.refine();
  if (cells.cells().empty())
    refuse(
        "time: all streamlines leave the field before the first cell of the surface, or the surface is torn "
        "throughout; ask for less time");

  StreamMesh mesh;
  mesh.is_smooth = lines.is_smooth();
  refine_to_fit(cells, tolerance);
  Corners corners(cells);
  std::vector<BezierPiece> pieces;
  for (const LatticeBox& box : cells.cells()) {
    StreamCell cell;
    cell.lower = {cells.u_at(box.column), cells.time_at(box.row)};
    cell.upper = {cells.u_at(box.column + box.columns), cells.time_at(box.row + box.rows)};
    const std::array<StreamCorner, 4> fitting = corners.of(box);
    pieces.push_back(piece_of(fitting, cell.lower, cell.upper));
    mesh.deviation = std::max(mesh.deviation, cells.deviation(box, fitting));
    if (mesh.is_smooth) {
      add_beyond(cells, box, pieces.back(), cell);
      cell.curvature_error = curvature_error(cells, box, pieces.back(), cell);
      mesh.curvature_error = std::max(mesh.curvature_error, cell.curvature_error);
    }
    mesh.cells.push_back(cell);
  }
  for (const StreamCells::Border& border : cells.borders()) {
    const LatticeBox& box = border.box;
    mesh.borders.push_back({{cells.u_at(box.column), cells.time_at(box.row)},
                            {cells.u_at(box.column + box.columns), cells.time_at(box.row + box.rows)},
                            {border.lower, border.upper}});
  }
  mesh.bounds = bounds_of(pieces, mesh.borders);
  mesh.pieces = std::make_shared<const BezierSource>(std::move(pieces));
  mesh.topology = join_pieces(*mesh.pieces, extent_of(mesh.bounds));
  mesh.leaves = make_leaves(*mesh.pieces, mesh.topology, extent_of(mesh.bounds));
  mesh.polygons = polygons_of(cells);
  make_tree(cells, mesh);
  if (time.x <= 0 && time.y >= 0) prove_cells(flow, field, seed, cells, mesh);
  mesh.gaps = cells.gaps();
  mesh.streamlines = lines.count();
  mesh.short_lines = lines.short_lines();
  mesh.steps = lines.steps();
  mesh.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return mesh;
}

}  // namespace smurf
