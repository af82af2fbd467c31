#include "smurf/curvature_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "smurf/error.hpp"
#include "techniques/curvature/line_field.hpp"

namespace smurf {
namespace {

constexpr double turn_allowed = 0.97;     // cosine, from the first to the last stage of a step
constexpr double least_part = 1.0 / 256;  // of the longest step

using Status = CurvatureLineStatus;

struct Row {
  glm::vec3 position;
  double arc;
  float k1, k2;
  Status status;
};

// A line on its way to one side.
struct Line {
  LinePlace place;
  glm::dvec3 direction;
  double step, arc = 0;
  std::size_t steps = 0;
  bool ended = false;
  std::vector<Row> rows = {};

  void add(const LinePlace& at, Status status) { rows.push_back({glm::vec3(at.position), arc, at.k1, at.k2, status}); }
  void end(Status status) {
    ended = true;
    rows.back().status = status;
  }
};

class Advance {
 public:
  Advance(const LineField& field, const CurvatureLineOptions& options, double longest)
      : field_(field), options_(options), longest_(longest) {}

  // A step of each line that has not ended.
  void operator()(std::vector<Line>& lines) const {
    std::vector<Try> tries;
    for (Line& line : lines) {
      if (line.ended) continue;
      const double h = std::min(line.step, options_.length - line.arc);
      tries.push_back({&line, h, line.direction, line.direction, line.place.normal});
    }
    // Stages at 1/2, 1/2 and 1, with weights 1, 2, 2, 1; then the step itself.
    for (const auto& [part, weight] : {std::pair(0.5, 2.0), std::pair(0.5, 2.0), std::pair(1.0, 1.0)})
      stage(tries, part, weight);
    for (Try& t : tries) t.last = t.sum / 6.0;
    const std::vector<LinePlace> places = evaluate(tries, 1.0);
    for (std::size_t i = 0; i < tries.size(); i++) finish(tries[i], places[i]);
  }

 private:
  struct Try {
    Line* line;
    double h;
    glm::dvec3 last, sum;  // the last stage's direction, and the weighted sum of all
    glm::dvec3 normal;
    bool found = true, defined = true, straight = true;
  };

  std::vector<LinePlace> evaluate(const std::vector<Try>& tries, double part) const {
    std::vector<Guess> guesses;
    guesses.reserve(tries.size());
    for (const Try& t : tries) guesses.push_back({t.line->place.position + part * t.h * t.last, t.normal, t.h});
    return field_.at(guesses);
  }

  void stage(std::vector<Try>& tries, double part, double weight) const {
    const std::vector<LinePlace> places = evaluate(tries, part);
    for (std::size_t i = 0; i < tries.size(); i++) {
      Try& t = tries[i];
      t.found = t.found && places[i].found;
      t.defined = t.defined && (!places[i].found || places[i].defined);
      if (!places[i].found || !places[i].defined || places[i].umbilic) {
        t.straight = t.straight && !places[i].umbilic;
        t.sum += weight * t.last;
        continue;
      }
      const glm::dvec3 direction = along_line(places[i].direction, t.last);
      t.straight = t.straight && glm::dot(direction, t.line->direction) > turn_allowed;
      t.last = direction;
      t.normal = places[i].normal;
      t.sum += weight * direction;
    }
  }

  void finish(Try& t, const LinePlace& place) const {
    Line& line = *t.line;
    const bool good = t.found && t.defined && t.straight && place.found && place.defined && !place.umbilic;
    if (good) {
      line.arc += t.h;
      line.steps++;
      line.direction = along_line(place.direction, t.last);
      line.place = place;
      line.step = std::min(2 * line.step, longest_);
      line.add(place, Status::regular);
      if (line.arc >= options_.length * (1 - 1e-12)) line.end(Status::length);
      else if (line.steps >= options_.most_steps) line.end(Status::steps);
      return;
    }
    line.step = 0.5 * t.h;
    if (line.step >= least_part * longest_) return;
    if (!t.found || !place.found) return line.end(Status::boundary);
    if (!t.defined || !place.defined) return line.end(Status::undefined);
    pass_umbilic(line);
  }

  // The field turns too fast to be followed, or has no direction.
  void pass_umbilic(Line& line) const {
    const double radius = 0.25 * longest_;
    // What stops the line lies just ahead.
    const Guess ahead{line.place.position + least_part * longest_ * line.direction, line.place.normal, longest_};
    const LinePlace centre = field_.at({&ahead, 1}).front();
    if (!centre.found) return line.end(Status::boundary);
    if (!centre.defined) return line.end(Status::undefined);
    const UmbilicExit exit = exit_of(field_, centre, line.direction, radius);
    line.arc += least_part * longest_;
    line.steps++;
    line.add(centre, Status::umbilic);
    if (!exit.goes_on || line.arc + radius > options_.length) return line.end(Status::umbilic);
    line.arc += radius;
    line.place = exit.place;
    line.direction = along_line(exit.place.direction, exit.direction);
    line.step = radius;
    line.add(line.place, Status::regular);
  }

  const LineField& field_;
  const CurvatureLineOptions& options_;
  const double longest_;
};

// Of the two signs of a direction the one by which its greatest component is positive, on every device.
glm::dvec3 forward(const glm::dvec3& direction) {
  const glm::dvec3 size = glm::abs(direction);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  return direction[axis] < 0 ? -direction : direction;
}

Line begun(const LinePlace& seed, const glm::vec3& point, double sign, double step) {
  Line line{seed, sign * forward(seed.direction), step};
  line.add(seed, Status::regular);
  if (!seed.found) line.rows.back().position = point;
  if (!seed.found || !seed.defined) line.end(Status::undefined);
  else if (seed.umbilic) line.end(Status::umbilic);
  return line;
}

void check(const CurvatureLineOptions& options) {
  const auto refuse = [](const std::string& what) { throw Error(ErrorCode::usage, "lines of curvature: " + what); };
  if (options.principal != 1 && options.principal != 2)
    refuse(fmt::format("the principal direction must be 1 or 2, not {}", options.principal));
  if (!(options.length > 0) || !std::isfinite(options.length))
    refuse(fmt::format("the length must be positive and finite, not {}", options.length));
  if (!(options.step >= 0) || !std::isfinite(options.step))
    refuse(fmt::format("the step must be positive and finite, not {}", options.step));
  if (!(options.reach >= 0) || !std::isfinite(options.reach))
    refuse(fmt::format("the reach of seeds must be positive and finite, not {}", options.reach));
}

void append(const Line& line, bool backwards, CurvatureLines& out) {
  const auto put = [&](const Row& row) {
    out.positions.push_back(row.position);
    out.arcs.push_back(float(backwards ? -row.arc : row.arc));
    out.k1.push_back(row.k1);
    out.k2.push_back(row.k2);
    out.status.push_back(row.status);
  };
  if (!backwards) {
    for (const Row& row : line.rows) put(row);
  } else {
    // Without the seed, which the other half has.
    for (std::size_t i = line.rows.size(); i > 1; i--) put(line.rows[i - 1]);
  }
}

}  // namespace

std::string_view name_of(CurvatureLineStatus status) {
  constexpr std::string_view names[] = {"regular", "umbilic", "boundary", "undefined", "length", "steps"};
  return names[std::size_t(status)];
}

CurvatureLines curvature_lines(const Interrogator& query, const Bounds& bounds, std::span<const glm::vec3> seeds,
                               const CurvatureLineOptions& options) {
  check(options);
  const double extent = glm::length(bounds.upper - bounds.lower);
  const double longest = options.step > 0 ? options.step : extent / 400;
  const LineField field(query, options.principal, extent);
  const std::vector<LinePlace> starts = field.near(seeds, options.reach > 0 ? options.reach : extent / 100);
  std::vector<Line> lines;
  for (std::size_t i = 0; i < seeds.size(); i++) {
    lines.push_back(begun(starts[i], seeds[i], 1, longest));
    if (options.both) lines.push_back(begun(starts[i], seeds[i], -1, longest));
  }
  const Advance advance(field, options, longest);
  for (std::size_t ended = 0, before = lines.size() + 1; ended < lines.size();) {
    ended = std::size_t(std::count_if(lines.begin(), lines.end(), [](const Line& line) { return line.ended; }));
    if (options.progress && ended != before) options.progress(ended, lines.size());
    before = ended;
    if (ended < lines.size()) advance(lines);
  }
  CurvatureLines out;
  const std::size_t halves = options.both ? 2 : 1;
  for (std::size_t i = 0; i < lines.size(); i += halves) {
    if (options.both) append(lines[i + 1], true, out);
    append(lines[i], false, out);
    out.offsets.push_back(out.positions.size());
  }
  return out;
}

}  // namespace smurf
