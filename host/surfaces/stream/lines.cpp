#include "surfaces/stream/lines.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "numerics/parallel.hpp"

namespace smurf {
namespace {

constexpr double beside_corner = 1e-7;    // of u, where one-sided tangents are taken
constexpr double off_row = 1e-3;          // of an interval: how far the time of a row may be from it
constexpr std::size_t lines_at_once = 4;  // a task

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// Along time, or against it (-1).
float greatest_rate(const glm::mat3& jacobian, float direction) {
  Eigen::Matrix3f symmetric;
  for (int c = 0; c < 3; c++) {
    for (int r = 0; r < 3; r++) symmetric(r, c) = direction * 0.5f * (jacobian[c][r] + jacobian[r][c]);
  }
  if (!symmetric.allFinite()) return std::numeric_limits<float>::infinity();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(symmetric, Eigen::EigenvaluesOnly);
  // The closed form rounds.
  return solver.eigenvalues().maxCoeff() + 1e-5f * symmetric.norm();
}

}  // namespace

double StreamSection::start_of(int piece) const {
  if (piece == 0) return start;
  return piece == pieces ? end : start + std::ldexp(end - start, piece - pieces);
}

double StreamSection::at(int row) const {
  const int piece = row / rows_of_piece();
  return piece == pieces ? end : start_of(piece) + interval(row) * (row - piece * rows_of_piece());
}

double StreamSection::interval(int row) const {
  const int piece = std::min(row / rows_of_piece(), pieces - 1);
  return (start_of(piece + 1) - start_of(piece)) / rows_of_piece();
}

double StreamSection::row_of(double time) const {
  int piece = 0;
  while (piece + 1 < pieces && std::abs(time - start) >= std::abs(start_of(piece + 1) - start)) piece++;
  const int first = piece * rows_of_piece();
  const double row = first + (time - start_of(piece)) / interval(first);
  // Rows before the first one and behind the last one are as far apart as those next to them.
  return (end - start) * (time - start) < 0 ? (time - start) / interval(0) : row;
}

void StreamLines::set_rows(int pieces, int rows_of_piece) {
  for (StreamSection& section : sections_) {
    section.pieces = pieces;
    section.rows = pieces * rows_of_piece;
  }
}

StreamLines::StreamLines(FlowQueries& flow, const VectorFieldDefinition& field, const SeedCurve& curve,
                         const glm::dvec2& time, double tolerance)
    : flow_(flow), curve_(curve), smooth_(field.smoothness() >= 2), tolerance_(tolerance) {
  if (time.x >= 0) {
    sections_.push_back({time.x, time.y});
  } else if (time.y <= 0) {
    sections_.push_back({time.y, time.x});
  } else {
    sections_ = {{0, time.x}, {0, time.y}};
  }
}

std::vector<StreamLine> StreamLines::trace(std::span<const StreamSeed> seeds) {
  std::vector<StreamLine> lines(seeds.size());
  if (seeds.empty()) return lines;
  const glm::dvec2 range = curve_.range();
  FlowSeeds at;
  for (const StreamSeed& seed : seeds) {
    const SeedPoint point = curve_.at(seed.u);
    const SeedPoint sided =
        seed.side == 0 ? point : curve_.at(seed.u + seed.side * beside_corner * (range.y - range.x));
    const auto finite = [](const glm::dvec3& v) { return is_finite(v) ? v : glm::dvec3(0.0); };
    at.positions.push_back(point.position);
    at.tangents.push_back(finite(sided.first));
    at.second_tangents.push_back(finite(sided.second));
  }
  count_ += seeds.size();
  for (std::size_t s = 0; s < sections_.size(); s++) {
    trace_section(int(s), at, lines);
    fill_fields(int(s), lines);
  }
  for (const StreamLine& line : lines) {
    bool is_short = false;
    for (std::size_t s = 0; s < sections_.size(); s++) is_short = is_short || line.reached(int(s)) < sections_[s].rows;
    short_lines_ += is_short ? 1 : 0;
  }
  return lines;
}

void StreamLines::trace_section(int section, const FlowSeeds& seeds, std::span<StreamLine> lines) {
  const StreamSection& times = sections_[std::size_t(section)];
  TraceOptions options;
  options.tolerance = tolerance_;
  options.variation = smooth_ ? 2 : 1;
  options.stagnation = -1;  // where nothing moves the surface stays, and its derivatives do not
  // To where the rows begin.
  FlowSeeds begin = seeds;
  std::vector<std::size_t> whose;
  for (std::size_t i = 0; i < lines.size(); i++) whose.push_back(i);
  if (times.start != 0) {
    options.time = times.start;
    options.ends_only = true;
    const Streamlines ends = flow_.trace(seeds, options);
    steps_ += ends.steps;
    begin = {};
    whose.clear();
    for (std::size_t i = 0; i < lines.size(); i++) {
      if (ends.end[i] != FlowStatus::time) continue;
      const auto last = std::size_t(ends.offsets[i + 1] - 1);
      begin.positions.emplace_back(ends.positions[last]);
      begin.tangents.emplace_back(ends.first[last]);
      begin.second_tangents.push_back(smooth_ ? glm::dvec3(ends.second[last]) : glm::dvec3(0.0));
      whose.push_back(i);
    }
    options.ends_only = false;
  }
  for (int piece = 0; piece < times.pieces && !whose.empty(); piece++) {
    const int before = piece * times.rows_of_piece();
    const double interval = times.interval(before);
    options.time = times.start_of(piece + 1) - times.start_of(piece);
    options.interval = std::abs(interval);
    const Streamlines traced = flow_.trace(begin, options);
    steps_ += traced.steps;
    FlowSeeds next;
    std::vector<std::size_t> whose_next;
    for (std::size_t k = 0; k < whose.size(); k++) {
      std::vector<StreamNode>& nodes = lines[whose[k]].nodes[std::size_t(section)];
      const auto first = std::size_t(traced.offsets[k]), end = std::size_t(traced.offsets[k + 1]);
      // A seed without a field is no row.
      if (end - first == 1 && traced.end[k] != FlowStatus::time) continue;
      nodes.reserve(nodes.size() + end - first);
      // The first row of a piece is the last one of the piece before it.
      for (std::size_t i = first + (piece > 0 ? 1 : 0); i < end; i++) {
        const double row = before + double(traced.times[i]) / interval;
        if (int(nodes.size()) > before + times.rows_of_piece() || std::abs(row - double(nodes.size())) > off_row) break;
        StreamNode node;
        node.x = traced.positions[i];
        node.u = traced.first[i];
        if (smooth_) node.uu = traced.second[i];
        nodes.push_back(node);
      }
      lines[whose[k]].last[std::size_t(section)] = traced.positions[end - 1];
      if (traced.end[k] != FlowStatus::time || int(nodes.size()) != before + times.rows_of_piece() + 1) continue;
      next.positions.emplace_back(nodes.back().x);
      next.tangents.emplace_back(nodes.back().u);
      next.second_tangents.emplace_back(nodes.back().uu);
      whose_next.push_back(whose[k]);
    }
    begin = std::move(next);
    whose = std::move(whose_next);
  }
}

void StreamLines::fill_fields(int section, std::span<StreamLine> lines) {
  std::vector<glm::vec3> points;
  std::vector<std::size_t> first;
  for (const StreamLine& line : lines) {
    first.push_back(points.size());
    for (const StreamNode& node : line.nodes[std::size_t(section)]) points.push_back(node.x);
  }
  if (points.empty()) return;
  const FlowSamples samples = flow_.sample(points, 1);
  const StreamSection& times = sections_[std::size_t(section)];
  const float direction = times.end < times.start ? -1 : 1;
  parallel_for((lines.size() + lines_at_once - 1) / lines_at_once, [&](std::size_t task) {
    for (std::size_t l = lines_at_once * task; l < std::min(lines.size(), lines_at_once * (task + 1)); l++) {
      std::vector<StreamNode>& nodes = lines[l].nodes[std::size_t(section)];
      for (std::size_t i = 0; i < nodes.size(); i++) {
        const std::size_t at = first[l] + i;
        // At the border of the domain the last position may be outside by rounding.
        if (samples.status[at] != FlowStatus::inside) {
          nodes.resize(i);
          break;
        }
        StreamNode& node = nodes[i];
        const glm::mat3& jacobian = samples.jacobian[at];
        node.v = samples.value[at];
        node.uv = jacobian * node.u;
        node.vv = jacobian * node.v;
        node.rate = greatest_rate(jacobian, direction);
        node.slope = std::sqrt(glm::dot(jacobian[0], jacobian[0]) + glm::dot(jacobian[1], jacobian[1]) +
                               glm::dot(jacobian[2], jacobian[2]));
      }
    }
  });
}

}  // namespace smurf
