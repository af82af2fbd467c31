// Interrogator and HitList: walking. Questions are checked here; what is reached becomes columns or rows.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <vector>

#include "smurf/error.hpp"
#include "smurf/interrogator.hpp"
#include "surfaces/queries.hpp"

namespace smurf {
namespace {

// A part of the diagonal of the surface's bounds.
constexpr float usual_tolerance = 1e-3f;

bool is_distance(float distance) { return std::isfinite(distance) && distance > 0; }

void require_distance(float distance) {
  if (!is_distance(distance))
    throw Error(ErrorCode::usage, fmt::format("the distance of a walk must be positive and finite, not {}", distance));
}

void require_directions(std::size_t points, std::size_t directions, std::string_view what) {
  if (points != directions)
    throw Error(ErrorCode::usage, fmt::format("walking needs one direction per {}: {} {}s, {} directions", what, points,
                                              what, directions));
}

std::string vector_text(const glm::vec3& v) { return fmt::format("({}, {}, {})", v.x, v.y, v.z); }

// What is wrong with a point that is not walked from; empty where nothing is.
std::string fault_of(WalkStatus status, const glm::vec3& point, const glm::vec3& direction, float distance,
                     float tolerance) {
  switch (status) {
    case WalkStatus::off_surface:
      return fmt::format("{} is farther than {} from the surface", vector_text(point), tolerance);
    case WalkStatus::no_direction:
      return fmt::format("its direction {} has no part along the surface", vector_text(direction));
    case WalkStatus::invalid:
      return fmt::format("location {}, direction {}, distance {}; numbers must be finite, and the distance positive",
                         vector_text(point), vector_text(direction), distance);
    default:
      return {};
  }
}

// Walks, and refuses bad points where they are errors.
void walk_checked(SurfaceQueries& queries, const WalkStart& start, const WalkOptions& options, const WalkSink& sink) {
  queries.walk(start, options, [&](const WalkedPoints& walked) {
    if (options.bad_points == BadPoints::error) {
      for (std::size_t i = 0; i < walked.status.size(); i++) {
        const std::size_t point = walked.first + i;
        const std::string fault =
            fault_of(walked.status[i], start.points.locations[point], start.points.directions[point],
                     start.distances[start.distances.size() == 1 ? 0 : point], options.tolerance);
        if (!fault.empty()) throw Error(ErrorCode::input, fmt::format("cannot walk from point {}: {}", point, fault));
      }
    }
    sink(walked);
  });
}

WalkOptions with_tolerance(WalkOptions options, float diagonal) {
  if (std::isnan(options.tolerance) || std::isinf(options.tolerance))
    throw Error(ErrorCode::usage, fmt::format("the tolerance of a walk must be finite, not {}", options.tolerance));
  if (options.tolerance < 0) options.tolerance = std::isfinite(diagonal) ? usual_tolerance * diagonal : 0.0f;
  return options;
}

template <class T>
void put(Values<T>& column, std::size_t first, std::span<const T> values) {
  std::copy(values.begin(), values.end(), column.begin() + std::ptrdiff_t(first));
}

Neighbors neighbors_of(SurfaceQueries& queries, bool coordinates, const WalkStart& start, const WalkOptions& options) {
  const std::size_t size = start.points.locations.size();
  if (size == 0) return {};
  Values<glm::vec3> locations(size), normals(size), directions(size);
  Values<SurfaceCoordinates> places(coordinates ? size : 0);
  Values<float> chords(size);
  Values<WalkStatus> status(size);
  walk_checked(queries, start, options, [&](const WalkedPoints& walked) {
    if (walked.step != 1) return;
    put(locations, walked.first, walked.locations);
    put(normals, walked.first, walked.normals);
    put(directions, walked.first, walked.directions);
    if (coordinates) put(places, walked.first, walked.coordinates);
    put(chords, walked.first, walked.chords);
    put(status, walked.first, walked.status);
  });
  return {std::move(locations), std::move(normals), std::move(directions),
          std::move(places),    std::move(chords),  std::move(status)};
}

// Rows of all steps of a tile become those of its paths.
class PathRows {
 public:
  PathRows(bool coordinates, int steps) : coordinates_(coordinates), steps_(steps) { paths_.offsets.push_back(0); }

  void take(const WalkedPoints& walked) {
    if (walked.step == 0) lengths_.assign(walked.status.size(), 0);
    for (std::size_t i = 0; i < walked.status.size(); i++) {
      const bool before = walked.step == 0 || goes_on(status_[(std::size_t(walked.step) - 1) * lengths_.size() + i]);
      if (before) lengths_[i]++;
    }
    locations_.insert(locations_.end(), walked.locations.begin(), walked.locations.end());
    status_.insert(status_.end(), walked.status.begin(), walked.status.end());
    if (coordinates_) places_.insert(places_.end(), walked.coordinates.begin(), walked.coordinates.end());
    if (walked.step == steps_) write();
  }
  Paths result() { return std::move(paths_); }

 private:
  void write() {
    const std::size_t count = lengths_.size();
    for (std::size_t i = 0; i < count; i++) {
      for (std::uint32_t step = 0; step < lengths_[i]; step++) {
        const std::size_t at = step * count + i;
        paths_.steps.push_back(step);
        paths_.status.push_back(status_[at]);
        paths_.locations.push_back(locations_[at]);
        if (coordinates_) paths_.coordinates.push_back(places_[at]);
      }
      paths_.offsets.push_back(paths_.status.size());
    }
    locations_.clear();
    status_.clear();
    places_.clear();
  }

  const bool coordinates_;
  const int steps_;
  Paths paths_;
  std::vector<std::uint32_t> lengths_;  // rows of each path
  // Of the tile, step by step.
  std::vector<glm::vec3> locations_;
  std::vector<WalkStatus> status_;
  std::vector<SurfaceCoordinates> places_;
};

// Steps of a tile wait on the host until their paths are whole.
std::size_t rows_that_wait() { return std::size_t(1) << 24; }

}  // namespace

std::string_view name_of(WalkStatus status) {
  switch (status) {
    case WalkStatus::start:
      return "start";
    case WalkStatus::reached:
      return "reached";
    case WalkStatus::crease:
      return "crease";
    case WalkStatus::boundary:
      return "boundary";
    case WalkStatus::unreachable:
      return "unreachable";
    case WalkStatus::undefined:
      return "undefined";
    case WalkStatus::unresolved:
      return "unresolved";
    case WalkStatus::off_surface:
      return "off_surface";
    case WalkStatus::no_direction:
      return "no_direction";
    case WalkStatus::invalid:
      return "invalid";
  }
  return "unknown";
}

Neighbors Interrogator::neighbors(std::span<const glm::vec3> points, std::span<const glm::vec3> directions,
                                  std::span<const float> distances, const WalkOptions& options) const {
  require_directions(points.size(), directions.size(), "point");
  if (distances.size() != points.size())
    throw Error(ErrorCode::usage,
                fmt::format("walking needs one distance per point, or one for all: {} points, {} distances",
                            points.size(), distances.size()));
  return neighbors_of(*queries_, parts_ > 0, {{points, {}, directions}, distances, 1, false},
                      with_tolerance(options, diagonal_));
}

Neighbors Interrogator::neighbors(std::span<const glm::vec3> points, std::span<const glm::vec3> directions,
                                  float distance, const WalkOptions& options) const {
  require_directions(points.size(), directions.size(), "point");
  require_distance(distance);
  return neighbors_of(*queries_, parts_ > 0, {{points, {}, directions}, {&distance, 1}, 1, false},
                      with_tolerance(options, diagonal_));
}

Paths Interrogator::walk(std::span<const glm::vec3> points, std::span<const glm::vec3> directions, float distance,
                         std::uint32_t steps, const WalkOptions& options) const {
  require_directions(points.size(), directions.size(), "point");
  require_distance(distance);
  if (steps < 1 || steps > std::uint32_t(std::numeric_limits<int>::max()) - 1)
    throw Error(ErrorCode::usage, fmt::format("a walk takes 1 to 2147483646 steps, not {}", steps));
  WalkOptions complete = with_tolerance(options, diagonal_);
  const std::size_t most = std::max<std::size_t>(rows_that_wait() / (std::size_t(steps) + 1), 1);
  complete.tile = complete.tile == 0 ? std::min(most, std::size_t(1) << 18) : complete.tile;
  PathRows rows(parts_ > 0, int(steps));
  walk_checked(*queries_, {{points, {}, directions}, {&distance, 1}, int(steps)}, complete,
               [&](const WalkedPoints& walked) { rows.take(walked); });
  return rows.result();
}

Neighbors HitList::neighbors(std::span<const glm::vec3> directions, float distance, const WalkOptions& options) const {
  require_directions(size(), directions.size(), "hit");
  require_distance(distance);
  return neighbors_of(*queries_, !coordinates_.empty(),
                      {{locations_, coordinates_, directions}, {&distance, 1}, 1, false},
                      with_tolerance(options, diagonal_));
}

}  // namespace smurf
