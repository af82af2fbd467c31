// The reference's answers for vector fields: lines and samples, seeds and points in parallel.
#include "flows/queries.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "flows/kinds.hpp"
#include "numerics/parallel.hpp"
#include "reference/flow/line.hpp"
#include "reference/flow/variation.hpp"

namespace smurf {
namespace {

using glm::dvec3;

constexpr std::size_t tile = 1024;  // lines between two reports of progress

// A line with its variation, from its seed on, or from its beginning where it goes both ways.
struct Rows {
  std::vector<LinePoint> points;
  std::vector<dvec3> first, second;
  FlowStatus end = FlowStatus::inside, beginning = FlowStatus::inside;
  std::uint64_t steps = 0;
};

class FlowReference final : public FlowQueries {
 public:
  explicit FlowReference(const VectorFieldDefinition& definition) : flow_(refer(definition)) {}

  Streamlines trace(const FlowSeeds& seeds, const TraceOptions& options) override {
    const std::size_t count = seeds.positions.size();
    Streamlines lines;
    lines.offsets.push_back(0);
    for (std::size_t begin = 0; begin < count; begin += tile) {
      const std::size_t end = std::min(count, begin + tile);
      std::vector<Rows> rows(end - begin);
      parallel_for(end - begin, [&](std::size_t i) { rows[i] = line_of(seeds, begin + i, options); });
      for (const Rows& line : rows) append(line, options.variation, lines);
      if (options.progress) options.progress(end, count);
    }
    return lines;
  }

  FlowSamples sample(std::span<const glm::vec3> points, int derivatives) override {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    const std::size_t count = points.size();
    FlowSamples samples;
    samples.value.assign(count, glm::vec3(nan));
    samples.status.assign(count, FlowStatus::inside);
    samples.cell.assign(count, -1);
    samples.local.assign(count, glm::vec3(nan));
    if (derivatives > 0) samples.jacobian.assign(count, glm::mat3(glm::vec3(nan), glm::vec3(nan), glm::vec3(nan)));
    if (derivatives > 1) {
      std::array<glm::vec3, 6> none;
      none.fill(glm::vec3(nan));
      samples.hessian.assign(count, none);
    }
    parallel_for(count, [&](std::size_t i) {
      const dvec3 point(points[i]);
      const ReferenceFlow::Value at = flow_->at(point, slack_of(*flow_, point));
      samples.status[i] = at.place.status;
      if (at.place.piece >= 0 && flow_->has_cells()) {
        samples.cell[i] = at.place.piece;
        samples.local[i] = glm::vec3(at.place.local);
      }
      if (at.place.status != FlowStatus::inside) return;
      samples.value[i] = glm::vec3(at.vector);
      if (derivatives > 0) samples.jacobian[i] = glm::mat3(flow_->jacobian(at.place, point));
      if (derivatives > 1) {
        const std::array<dvec3, 6> second = flow_->hessian(at.place, point);
        for (std::size_t k = 0; k < 6; k++) samples.hessian[i][k] = glm::vec3(second[k]);
      }
    });
    return samples;
  }

  std::size_t device_bytes() const override { return 0; }

 private:
  Rows line_of(const FlowSeeds& seeds, std::size_t index, const TraceOptions& options) const {
    if (!options.both) return one_way(seeds, index, options, options.time);
    const double time = std::abs(options.time);
    Rows back = one_way(seeds, index, options, -time), line = one_way(seeds, index, options, time);
    // The seed, which both halves begin with, stands once.
    const auto join = [](auto& before, auto& after) {
      if (before.empty()) return;
      std::ranges::reverse(before);
      before.insert(before.end(), after.begin() + 1, after.end());
      after = std::move(before);
    };
    line.beginning = back.end;
    line.steps += back.steps;
    join(back.points, line.points);
    join(back.first, line.first);
    join(back.second, line.second);
    return line;
  }

  Rows one_way(const FlowSeeds& seeds, std::size_t index, const TraceOptions& options, double time) const {
    LineRequest request;
    request.time = time;
    request.stagnation = options.stagnation;
    if (options.length > 0) request.length = options.length;
    bool cut = false;
    if (options.integrator == Integrator::rk4) {
      // Positions are those at multiples of the step; its own steps are the reference's business.
      request.interval = options.interval > 0 ? options.interval : options.step;
      const double longest = options.most_steps * options.step;
      cut = longest < std::abs(time) * (1 - 1e-9);
      if (cut) request.time = std::copysign(longest, time);
    } else {
      request.interval = options.interval;
      request.most_steps = options.most_steps;
    }
    if (options.ends_only) request.interval = std::numeric_limits<double>::infinity();
    ReferenceLine line = trace_line(*flow_, seeds.positions[index], request);
    Rows rows;
    rows.end = cut && line.end == FlowStatus::time ? FlowStatus::steps : line.end;
    rows.steps = line.steps.size();
    if (options.variation > 0) {
      const dvec3 second = seeds.second_tangents.empty() ? dvec3(0.0) : seeds.second_tangents[index];
      LineVariation variation = vary_line(*flow_, line, request, seeds.tangents[index], second, options.variation);
      rows.first = std::move(variation.first);
      rows.second = std::move(variation.second);
    }
    rows.points = std::move(line.points);
    return rows;
  }

  static void append(const Rows& line, int variation, Streamlines& lines) {
    for (const LinePoint& point : line.points) {
      lines.positions.push_back(glm::vec3(point.position));
      lines.times.push_back(float(point.time));
    }
    if (variation > 0)
      for (const dvec3& v : line.first) lines.first.push_back(glm::vec3(v));
    if (variation > 1)
      for (const dvec3& v : line.second) lines.second.push_back(glm::vec3(v));
    lines.offsets.push_back(lines.positions.size());
    lines.end.push_back(line.end);
    lines.beginning.push_back(line.beginning);
    lines.steps += line.steps;
  }

  std::shared_ptr<const ReferenceFlow> flow_;
};

}  // namespace

std::unique_ptr<FlowQueries> trace_by_reference(const VectorFieldDefinition& definition) {
  return std::make_unique<FlowReference>(definition);
}

}  // namespace smurf
