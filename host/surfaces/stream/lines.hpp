// Streamlines from places of a seed curve, at rows of times: what cells of a stream surface are made of.
//
// A row holds the position and, by the variational equations, x_u and x_uu; and of the field there x_τ = v,
// x_uτ = Dv·x_u and x_ττ = Dv·v. Times before the seed and after it are two sections, each with rows of its own: row 0
// of both is next to the seed. Where times begin apart from 0, seeds are traced there first. Rows are even in time, or
// where lines end long before the time asked for denser towards the seed.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "flows/definition.hpp"
#include "flows/queries.hpp"
#include "flows/seeds/seed_curve.hpp"

namespace smurf {

struct StreamNode {
  glm::vec3 x{0.0f}, u{0.0f}, v{0.0f}, uu{0.0f}, uv{0.0f}, vv{0.0f};
  // How fast neighbours go apart at most: the greatest eigenvalue of the symmetric part of Dv, or of -Dv before the
  // seed.
  float rate = 0;
  float slope = 0;  // |Dv|, of Frobenius
};

// Rows of times in pieces, each with as many rows at even times. Every piece is twice as long as the one before it, but
// the second, which is as long as the first.
struct StreamSection {
  double start = 0;  // τ of row 0
  double end = 0;    // τ of the last row; before `start` where lines are traced back
  int rows = 0;      // the number of the last row
  int pieces = 1;
  int rows_of_piece() const { return rows / pieces; }
  double start_of(int piece) const;  // τ; of the number of pieces the end
  double at(int row) const;
  double interval(int row) const;    // from a row to the next
  double row_of(double time) const;  // between rows
};

// Of one or two sections.
struct StreamLine {
  std::array<std::vector<StreamNode>, 2> nodes{};  // as many as were reached
  std::array<glm::vec3, 2> last{};                 // the last position, also between rows
  std::array<int, 2> rest{};                       // the row from which on it hardly moves, or past the last one
  int reached(int section) const { return int(nodes[std::size_t(section)].size()) - 1; }
};

// A place of the seed curve, and at corners whether it belongs to what is before or behind: -1 or 1, else 0.
struct StreamSeed {
  double u = 0;
  int side = 0;
};

class StreamLines {
 public:
  // `tolerance`: of one step, in units of space.
  StreamLines(FlowQueries& flow, const VectorFieldDefinition& field, const SeedCurve& curve, const glm::dvec2& time,
              double tolerance);

  const std::vector<StreamSection>& sections() const { return sections_; }
  // All sections have the same numbers.
  void set_rows(int pieces, int rows_of_piece);
  bool is_smooth() const { return smooth_; }
  double tolerance() const { return tolerance_; }
  void set_tolerance(double tolerance) { tolerance_ = tolerance; }

  std::vector<StreamLine> trace(std::span<const StreamSeed> seeds);

  std::uint64_t steps() const { return steps_; }
  std::size_t count() const { return count_; }
  std::size_t short_lines() const { return short_lines_; }  // that end before the time asked for

 private:
  void trace_section(int section, const FlowSeeds& seeds, std::span<StreamLine> lines);
  void fill_fields(int section, std::span<StreamLine> lines);

  FlowQueries& flow_;
  const SeedCurve& curve_;
  bool smooth_;
  double tolerance_;
  std::vector<StreamSection> sections_;
  std::uint64_t steps_ = 0;
  std::size_t count_ = 0, short_lines_ = 0;
};

}  // namespace smurf
