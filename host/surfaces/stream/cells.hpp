// Which cells a stream surface consists of: boxes of a lattice in (u, τ), refined until patches over them are within
// the tolerance of the streamlines.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "surfaces/stream/lines.hpp"

namespace smurf {

// Position and derivatives at a corner of a cell, by u and by τ.
struct StreamCorner {
  glm::dvec3 x{0.0}, u{0.0}, v{0.0}, uv{0.0};
};

// The bicubic Hermite patch of four corners over a box of sides du × dv, at (s, t) of [0, 1]².
glm::dvec3 hermite_position(const std::array<StreamCorner, 4>& corners, double du, double dv, double s, double t);

// A box of the lattice. Times before the seed have negative rows.
struct LatticeBox {
  int strip = 0;
  std::int32_t column = 0, columns = 0;  // in u: the first, and how many
  std::int32_t row = 0, rows = 0;
  bool operator<(const LatticeBox& other) const {
    return std::tie(strip, column, columns, row, rows) <
           std::tie(other.strip, other.column, other.columns, other.row, other.rows);
  }
};

class StreamCells {
 public:
  StreamCells(StreamLines& lines, const SeedCurve& curve, double tolerance, double extent);
  // Throws Error (memory) that says what was reached.
  void refine();
  // Halves cells that turned out to need it, by their numbers in cells(), in time (true) or in u, and refines them
  // further.
  void refine_further(const std::map<std::size_t, bool>& halved);

  const std::vector<LatticeBox>& cells() const { return cells_; }
  // Where streamlines end within the box: a part of the surface is missing there. The box in space that it lies in.
  struct Border {
    LatticeBox box;
    glm::dvec3 lower, upper;
  };
  const std::vector<Border>& borders() const { return borders_; }
  const std::vector<glm::dvec2>& gaps() const { return gaps_; }  // ranges of u, where the surface is torn

  // The lattice.
  double u_at(std::int32_t column) const;
  double time_at(std::int32_t row) const;
  std::int32_t columns() const { return bases_ << halvings_; }
  std::int32_t base_columns() const { return 1 << halvings_; }  // cells are boxes of so many columns, or halves
  std::int32_t base_rows() const;
  std::int32_t lowest_row() const;
  std::int32_t highest_row() const;
  const std::vector<StreamSection>& sections() const { return lines_.sections(); }
  // The node of a strip's streamline; null where it was not traced, or does not get there. Row 0 is in both sections,
  // the same but for the rates of what is before and behind it.
  const StreamNode* node(int strip, std::int32_t column, std::int32_t row, bool before = false) const;
  double tolerance_of_step() const { return lines_.tolerance(); }
  glm::dvec2 range_of(int strip) const;  // of u
  // Of a box that was halved.
  bool was_halved_in_time(const LatticeBox& box) const { return halved_in_time_.contains(box); }
  std::array<StreamCorner, 4> corners(const LatticeBox& box) const;  // as they were traced
  // What the integrator may err by there.
  double noise_of(const LatticeBox& box) const;
  // How far the streamline in the middle of a box, and those along its sides, are from its patch at most.
  double deviation(const LatticeBox& box, const std::array<StreamCorner, 4>& corners) const;

 private:
  enum class Verdict { leaf, split_u, split_v, border, gap, nothing };
  struct Found {
    std::vector<LatticeBox> next, cells, halved_in_time;
    std::vector<Border> borders;
    std::vector<glm::dvec2> gaps;
    double deviation = 0;
  };
  void make_strips(const SeedCurve& curve);
  void choose_rows();
  bool are_rows_dense_enough(int& pieces, int& rows) const;  // else what to try next
  bool do_most_lines_end_soon() const;
  double greatest_stretch() const;                                      // of the seed curve, by the flow
  void trace(const std::vector<std::pair<int, std::int32_t>>& wanted);  // strip, column
  void join_corners();
  void refine_pending(std::vector<LatticeBox> pending);
  void look_at(LatticeBox box, Found& found) const;
  Verdict judge(const LatticeBox& box, double& deviation) const;
  Verdict judge_incomplete(const LatticeBox& box) const;
  bool is_at_rest(const LatticeBox& box) const;
  Border border_of(const LatticeBox& box) const;

  int section_of(const LatticeBox& box) const;
  const StreamLine* line(int strip, std::int32_t column) const;
  static std::int64_t key(int strip, std::int32_t column) { return (std::int64_t(strip) << 32) | std::int64_t(column); }

  StreamLines& lines_;
  double tolerance_, extent_;
  glm::dvec2 range_{0.0};
  std::int32_t bases_ = 1, halvings_ = 14;
  struct Strip {
    std::int32_t begin, end;  // bases
  };
  std::vector<Strip> strips_;
  std::unordered_map<std::int64_t, std::size_t> index_;
  std::vector<StreamLine> traced_;
  std::size_t nodes_ = 0;
  std::vector<LatticeBox> cells_;
  std::set<LatticeBox> halved_in_time_;
  std::vector<Border> borders_;
  std::vector<glm::dvec2> gaps_;
};

}  // namespace smurf
