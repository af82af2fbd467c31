// Streamlines and samples of a vector field on an executor.
//
// Lines are traced in rounds: in each, every line that goes on takes up to some number of steps, and keeps up to some
// number of positions (kernels/flow/trace.inc). Between rounds, lines that have ended leave the list, so that lanes
// stay full. What a line is does not depend on how it is cut into rounds, to the bit.
//
// Device memory: 132 bytes a line, and the positions of one round, for `lines_in_tile` lines at most.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "flows/kinds.hpp"
#include "flows/queries.hpp"
#include "flows/resident_flow.hpp"
#include "kernels/flow/layout.inc"
#include "numerics/parallel.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

constexpr std::size_t lines_in_tile = 1 << 15;
constexpr std::size_t points_in_tile = 1 << 18;
// Positions of a line in a round, and steps, with those that were tried in vain. Few lines have longer rounds.
constexpr std::size_t positions_of_all = 1 << 18;
constexpr int fewest_positions = 64, most_positions = 256;
constexpr int turns_for_position = 2;
constexpr int turns_of_ends = 256;
constexpr std::size_t lines_in_chunk = 64;
constexpr std::size_t worth_threads = 1 << 16;  // positions
static_assert(fewest_positions >= TRACE_LEAST_ROOM);
// Of a step of Dormand and Prince's method, of the domain's extent: a step must not pass over what is small.
constexpr double longest_step = 1.0 / 32;

static_assert(FLOW_INSIDE == int(FlowStatus::inside) && FLOW_TIME == int(FlowStatus::time) &&
              FLOW_DOMAIN == int(FlowStatus::domain) && FLOW_BLANKED == int(FlowStatus::blanked) &&
              FLOW_STAGNATION == int(FlowStatus::stagnation) && FLOW_STEPS == int(FlowStatus::steps) &&
              FLOW_LENGTH == int(FlowStatus::length) && FLOW_UNDEFINED == int(FlowStatus::undefined));

std::uint32_t word_of(double value) { return std::bit_cast<std::uint32_t>(float(value)); }

// What a float leaves out of a number.
double rest_of(double value) { return value - double(float(value)); }

// What a round keeps: of each line of its list so many positions, in rows of the same length.
struct Round {
  int room = 1;  // positions in a row
  Values<float> points;
  std::vector<std::uint32_t> list, counts;
};

// The lines of a tile in one direction, seeds left out.
struct Half {
  std::vector<Round> rounds;
  std::vector<std::uint32_t> sizes;  // positions of each line
  std::vector<FlowStatus> end;
  std::uint64_t steps = 0;
};

// Floats of a position that is kept.
std::size_t width_of(const TraceOptions& options) {
  return std::size_t(TRACE_POINT_WORDS) * std::size_t(1 + options.variation);
}

}  // namespace

class DeviceFlowQueries final : public FlowQueries {
 public:
  DeviceFlowQueries(Executor& executor, const std::shared_ptr<const VectorFieldDefinition>& field,
                    const PrepareOptions& options)
      : executor_(executor), field_(field), flow_(reside(*field, executor_, options)) {
    const Bounds bounds = field->bounds();
    const glm::dvec3 size = bounds.upper - bounds.lower;
    extent_ = std::max({size.x, size.y, size.z});
    sample_ = flow_->program(KernelId::sample_flow);
  }

  Streamlines trace(const FlowSeeds& seeds, const TraceOptions& options) override {
    const std::size_t count = seeds.positions.size();
    Program program = flow_->program(KernelId::trace_lines);
    program.modules["integrator"] =
        kernel_source(options.integrator == Integrator::rk4 ? "flow/rk4.inc" : "flow/dormand_prince.inc");
    program.defines["VARIATION"] = fmt::format("{}", options.variation);
    program.defines["ARC_LENGTH"] = options.length > 0 ? "1" : "0";
    executor_.prepare(program);
    Streamlines lines;
    lines.offsets.push_back(0);
    for (std::size_t first = 0; first < count; first += lines_in_tile) {
      const std::size_t end = std::min(count, first + lines_in_tile);
      const Half forward = trace_half(program, seeds, first, end, options, options.time);
      const Half back = options.both ? trace_half(program, seeds, first, end, options, -options.time) : Half{};
      append(seeds, first, end, options, forward, back, lines);
      if (options.progress) options.progress(end, count);
    }
    return lines;
  }

  FlowSamples sample(std::span<const glm::vec3> points, int derivatives) override {
    FlowSamples out;
    const std::size_t count = points.size();
    out.value.resize(count);
    out.jacobian.resize(derivatives > 0 ? count : 0);
    out.hessian.resize(derivatives > 1 ? count : 0);
    out.status.resize(count);
    out.cell.resize(count);
    out.local.resize(count);
    const std::size_t tile = std::min(count, points_in_tile);
    const std::size_t columns = std::size_t(derivatives == 0   ? SAMPLE_JACOBIAN
                                            : derivatives == 1 ? SAMPLE_HESSIAN
                                                               : SAMPLE_WORDS);
    if (count == 0) return out;
    ensure(sample_points_, tile, "points");
    ensure(columns_, tile * columns, "samples");
    std::vector<std::uint32_t> words(tile * columns);
    for (std::size_t first = 0; first < count; first += tile) {
      const std::size_t here = std::min(tile, count - first);
      sample_points_.write(points.subspan(first, here));
      launch(executor_, sample_,
             arguments::sample_flow{.flow = flow_->buffers(),
                                    .points = sample_points_.get(),
                                    .columns = columns_.get(),
                                    .first = 0,
                                    .end = int(here),
                                    .stride = int(here),
                                    .order = derivatives},
             here);
      columns_.read(std::span(words).first(here * columns));
      const auto column = [&](int c, std::size_t i) { return words[std::size_t(c) * here + i]; };
      const auto three = [&](int c, std::size_t i) {
        return glm::vec3(std::bit_cast<float>(column(c, i)), std::bit_cast<float>(column(c + 1, i)),
                         std::bit_cast<float>(column(c + 2, i)));
      };
      for (std::size_t i = 0; i < here; i++) {
        out.status[first + i] = FlowStatus(column(SAMPLE_STATUS, i));
        out.cell[first + i] = std::int32_t(column(SAMPLE_CELL, i));
        out.local[first + i] = three(SAMPLE_LOCAL, i);
        out.value[first + i] = three(SAMPLE_VALUE, i);
        if (derivatives > 0)
          out.jacobian[first + i] =
              glm::mat3(three(SAMPLE_JACOBIAN, i), three(SAMPLE_JACOBIAN + 3, i), three(SAMPLE_JACOBIAN + 6, i));
        for (int k = 0; derivatives > 1 && k < 6; k++)
          out.hessian[first + i][std::size_t(k)] = three(SAMPLE_HESSIAN + 3 * k, i);
      }
    }
    return out;
  }

  std::size_t device_bytes() const override { return flow_->bytes(); }

 private:
  template <class T>
  void ensure(TypedBuffer<T>& buffer, std::size_t count, std::string_view purpose) {
    if (!buffer || buffer.bytes() < count * sizeof(T)) buffer = TypedBuffer<T>(executor_, count, purpose);
  }

  void write_options(const TraceOptions& options, double time) {
    std::array<std::uint32_t, TRACE_OPTION_WORDS> words{};
    const auto put = [&](int at, double value) { words[std::size_t(at)] = word_of(value); };
    put(TRACE_OPTION_TIME, time);
    put(TRACE_OPTION_TIME_LOW, rest_of(time));
    put(TRACE_OPTION_STEP, options.step);
    put(TRACE_OPTION_TOLERANCE, options.tolerance);
    put(TRACE_OPTION_RELATIVE, options.tolerance / extent_);
    put(TRACE_OPTION_INTERVAL, options.interval);
    put(TRACE_OPTION_LENGTH, options.length);
    put(TRACE_OPTION_STAGNATION, options.stagnation);
    put(TRACE_OPTION_LONGEST, longest_step * extent_);
    words[TRACE_OPTION_MOST_STEPS] = std::uint32_t(options.most_steps);
    ensure(options_, words.size(), "options of lines");
    options_.write(words);
  }

  void write_lines(const FlowSeeds& seeds, std::size_t first, std::size_t end) {
    const std::size_t count = end - first;
    std::vector<std::uint32_t> words(count * TRACE_WORDS, 0);
    const auto put = [&](int column, std::size_t i, std::uint32_t word) {
      words[std::size_t(column) * count + i] = word;
    };
    const auto put_three = [&](int column, const std::vector<glm::dvec3>& list, std::size_t i) {
      for (int axis = 0; axis < 3 && !list.empty(); axis++) put(column + axis, i, word_of(list[first + i][axis]));
    };
    for (std::size_t i = 0; i < count; i++) {
      put_three(TRACE_X, seeds.positions, i);
      for (int axis = 0; axis < 3; axis++)
        put(TRACE_X_LOW + axis, i, word_of(rest_of(seeds.positions[first + i][axis])));
      put(TRACE_CELL, i, std::uint32_t(-1));
      put_three(TRACE_FIRST, seeds.tangents, i);
      put_three(TRACE_SECOND, seeds.second_tangents, i);
    }
    ensure(lines_, words.size(), "lines");
    lines_.write(words);
  }

  Half trace_half(const Program& program, const FlowSeeds& seeds, std::size_t first, std::size_t end,
                  const TraceOptions& options, double time) {
    const std::size_t count = end - first;
    write_options(options, time);
    write_lines(seeds, first, end);
    ensure(counts_, count, "counts of positions");
    ensure(list_, count, "list of lines");
    Half half;
    half.sizes.assign(count, 0);
    half.end.assign(count, FlowStatus::inside);
    std::vector<float> last(count, 0.0f);  // time of each line's last position; that of the seed is 0
    std::vector<std::uint32_t> list(count);
    for (std::size_t i = 0; i < count; i++) list[i] = std::uint32_t(i);
    while (!list.empty()) {
      Round round = run_round(program, list, count, options);
      list.clear();
      for (std::size_t k = 0; k < round.list.size(); k++) {
        const std::uint32_t line = round.list[k];
        half.end[line] = FlowStatus(round.counts[k] >> 16);
        round.counts[k] &= 0xffffu;
        if (half.end[line] == FlowStatus::inside) list.push_back(line);
        if (round.counts[k] > 0) drop_repeated(round, k, options, last[line]);
        half.sizes[line] += round.counts[k];
      }
      if (!options.ends_only) half.rounds.push_back(std::move(round));
    }
    std::vector<std::uint32_t> taken(count);
    lines_.read(taken, TRACE_TAKEN * count);
    for (const std::uint32_t steps : taken) half.steps += steps;
    if (options.ends_only) half.rounds.push_back(ends(count, options, half.sizes));
    return half;
  }

  // One round of the lines in the list, of `count` lines in all.
  Round run_round(const Program& program, const std::vector<std::uint32_t>& list, std::size_t count,
                  const TraceOptions& options) {
    Round round;
    round.list = list;
    round.counts.resize(list.size());
    list_.write(list);
    const auto each = int(std::min<std::size_t>(positions_of_all / list.size(), most_positions));
    const int room = options.ends_only ? 0 : std::max(each, fewest_positions);
    round.room = room;
    round.points.resize(list.size() * std::size_t(room) * width_of(options));
    // Devices that share the host's memory write there.
    std::unique_ptr<DeviceBuffer> shared;
    if (!round.points.empty()) {
      shared = executor_.share_results(round.points.data(), round.points.size() * sizeof(float), "positions of lines");
      if (!shared) ensure(points_, round.points.size(), "positions of lines");
    }
    launch(executor_, program,
           arguments::trace_lines{.flow = flow_->buffers(),
                                  .options = options_.get(),
                                  .list = list_.get(),
                                  .lines = lines_.get(),
                                  .points = shared ? shared.get() : points_.get(),
                                  .counts = counts_.get(),
                                  .count = int(list.size()),
                                  .stride = int(count),
                                  .room = room,
                                  .turns = options.ends_only ? turns_of_ends : turns_for_position * room,
                                  .begin = 0},
           list.size());
    counts_.read(round.counts);
    if (!shared && !round.points.empty()) points_.read(round.points);
    return round;
  }

  // At a border the last step may have been kept already.
  static void drop_repeated(Round& round, std::size_t k, const TraceOptions& options, float& last) {
    const std::size_t width = width_of(options);
    const float* times = round.points.data() + k * std::size_t(round.room) * width + 3;
    const std::size_t count = round.counts[k];
    const float before = count > 1 ? times[(count - 2) * width] : last;
    last = times[(count - 1) * width];
    if (before == last) round.counts[k]--;
  }

  // Where all lines stand, as if they had been kept, of those that have left their seed.
  Round ends(std::size_t count, const TraceOptions& options, std::vector<std::uint32_t>& sizes) {
    std::vector<std::uint32_t> words(count * TRACE_WORDS);
    lines_.read(words);
    const auto number = [&](int column, std::size_t i) {
      return std::bit_cast<float>(words[std::size_t(column) * count + i]);
    };
    const std::size_t row = width_of(options);
    Round round;
    round.points.resize(count * row);
    for (std::size_t i = 0; i < count; i++) {
      float* point = round.points.data() + i * row;
      sizes[i] = number(TRACE_TIME, i) != 0 ? 1 : 0;
      round.list.push_back(std::uint32_t(i));
      round.counts.push_back(sizes[i]);
      point[3] = number(TRACE_TIME, i);
      for (int axis = 0; axis < 3; axis++) {
        point[axis] = number(TRACE_X + axis, i);
        if (options.variation > 0) point[4 + axis] = number(TRACE_FIRST + axis, i);
        if (options.variation > 1) point[8 + axis] = number(TRACE_SECOND + axis, i);
      }
    }
    return round;
  }

  static void append(const FlowSeeds& seeds, std::size_t first, std::size_t end, const TraceOptions& options,
                     const Half& forward, const Half& back, Streamlines& lines) {
    const std::size_t count = end - first, before = lines.positions.size();
    std::vector<std::uint64_t> at(count);  // of each line's seed
    std::uint64_t total = before;
    for (std::size_t i = 0; i < count; i++) {
      const std::uint64_t behind = options.both ? back.sizes[i] : 0;
      at[i] = total + behind;
      total += behind + 1 + forward.sizes[i];
      lines.offsets.push_back(total);
      lines.end.push_back(forward.end[i]);
      lines.beginning.push_back(options.both ? back.end[i] : FlowStatus::inside);
    }
    lines.positions.resize(total);
    lines.times.resize(total);
    lines.first.resize(options.variation > 0 ? total : 0);
    lines.second.resize(options.variation > 1 ? total : 0);
    for (std::size_t i = 0; i < count; i++) {
      lines.positions[at[i]] = glm::vec3(seeds.positions[first + i]);
      lines.times[at[i]] = 0.0f;
      if (options.variation > 0) lines.first[at[i]] = glm::vec3(seeds.tangents[first + i]);
      if (options.variation > 1)
        lines.second[at[i]] =
            seeds.second_tangents.empty() ? glm::vec3(0.0f) : glm::vec3(seeds.second_tangents[first + i]);
    }
    place(forward, options, at, 1, lines);
    place(back, options, at, -1, lines);
    lines.steps += forward.steps + back.steps;
  }

  // Puts the positions of a half where they belong: behind those of the seeds, or before them in the other order.
  static void place(const Half& half, const TraceOptions& options, const std::vector<std::uint64_t>& at,
                    std::int64_t side, Streamlines& lines) {
    const std::size_t width = width_of(options);
    // Where the first position of each row goes.
    std::vector<std::vector<std::uint64_t>> to(half.rounds.size());
    std::vector<std::pair<std::size_t, std::size_t>> chunks;  // round, first row
    std::vector<std::uint32_t> done(at.size(), 0);
    for (std::size_t r = 0; r < half.rounds.size(); r++) {
      const Round& round = half.rounds[r];
      for (std::size_t k = 0; k < round.list.size(); k++) {
        if (k % lines_in_chunk == 0) chunks.emplace_back(r, k);
        const std::uint32_t line = round.list[k];
        to[r].push_back(std::uint64_t(std::int64_t(at[line]) + side * std::int64_t(done[line] + 1)));
        done[line] += round.counts[k];
      }
    }
    const auto place_chunk = [&](std::size_t c) {
      const auto [r, first] = chunks[c];
      const Round& round = half.rounds[r];
      for (std::size_t k = first; k < std::min(round.list.size(), first + lines_in_chunk); k++) {
        const float* p = round.points.data() + k * std::size_t(round.room) * width;
        for (std::size_t i = 0; i < round.counts[k]; i++, p += width) {
          const auto place = std::size_t(std::int64_t(to[r][k]) + side * std::int64_t(i));
          lines.positions[place] = {p[0], p[1], p[2]};
          lines.times[place] = p[3];
          if (options.variation > 0) lines.first[place] = {p[4], p[5], p[6]};
          if (options.variation > 1) lines.second[place] = {p[8], p[9], p[10]};
        }
      }
    };
    if (lines.positions.size() < worth_threads) {
      for (std::size_t c = 0; c < chunks.size(); c++) place_chunk(c);
    } else {
      parallel_for(chunks.size(), place_chunk);
    }
  }

  Executor& executor_;
  std::shared_ptr<const VectorFieldDefinition> field_;
  std::unique_ptr<ResidentFlow> flow_;
  double extent_ = 1;
  Program sample_;
  TypedBuffer<glm::vec3> sample_points_;
  TypedBuffer<std::uint32_t> columns_, options_, lines_, list_, counts_;
  TypedBuffer<float> points_;
};

std::unique_ptr<FlowQueries> trace_on_device(Executor& executor,
                                             const std::shared_ptr<const VectorFieldDefinition>& field,
                                             const PrepareOptions& options) {
  return std::make_unique<DeviceFlowQueries>(executor, field, options);
}

}  // namespace smurf
