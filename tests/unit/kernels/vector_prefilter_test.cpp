// Coefficients of the interpolating cubic B-spline as kernels make them (kernels/flow/prefilter.inc), run on the host,
// against the systems of equations solved in double; and the margin about them (kernels/flow/pad.inc).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "unit/kernels/one_lane.hpp"

#define BUFFER_WORDS                                               \
  using Buffer = std::uint32_t*;                                   \
  FN real load_real(Buffer b, integer i) { return as_real(b[i]); } \
  FN word load_word(Buffer b, integer i) { return b[i]; }          \
  FN void store_word(Buffer b, integer i, word v, mask m) {        \
    if (m) b[i] = v;                                               \
  }                                                                \
  FN void store_real(Buffer b, integer i, real v, mask m) { store_word(b, i, as_word(v), m); }

namespace prefilter {
using namespace one_lane;
using one_lane::separate::multiply_add;
BUFFER_WORDS
#include "kernels/flow/prefilter.inc"
}  // namespace prefilter
namespace pad {
using namespace one_lane;
using one_lane::separate::multiply_add;
BUFFER_WORDS
#include "kernels/flow/pad.inc"
}  // namespace pad

namespace smurf {
namespace {

constexpr std::uint32_t mark = 0x7fc01234u;  // of fourth words: a NaN that no calculation makes

// Gaussian elimination with pivots; rows hold the right-hand side last.
std::vector<double> solve(std::vector<std::vector<double>> rows) {
  const std::size_t n = rows.size();
  for (std::size_t k = 0; k < n; k++) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < n; i++)
      if (std::abs(rows[i][k]) > std::abs(rows[pivot][k])) pivot = i;
    std::swap(rows[k], rows[pivot]);
    for (std::size_t i = k + 1; i < n; i++) {
      const double factor = rows[i][k] / rows[k][k];
      for (std::size_t j = k; j <= n; j++) rows[i][j] -= factor * rows[k][j];
    }
  }
  std::vector<double> x(n);
  for (std::size_t k = n; k-- > 0;) {
    double rest = rows[k][n];
    for (std::size_t j = k + 1; j < n; j++) rest -= rows[k][j] * x[j];
    x[k] = rest / rows[k][k];
  }
  return x;
}

// Coefficients of a line: the spline takes the values at the nodes, and either its second derivatives vanish at the
// ends, or the last node is the first.
std::vector<double> coefficients(const std::vector<double>& values, bool periodic) {
  const std::size_t n = periodic ? values.size() - 1 : values.size();
  std::vector<std::vector<double>> rows(n, std::vector<double>(n + 1, 0.0));
  for (std::size_t k = 0; k < n; k++) {
    rows[k][n] = values[k];
    if (!periodic && (k == 0 || k == n - 1)) {
      rows[k][k] = 1;
      continue;
    }
    rows[k][k] += 4.0 / 6;
    rows[k][(k + n - 1) % n] += 1.0 / 6;
    rows[k][(k + 1) % n] += 1.0 / 6;
  }
  std::vector<double> c = solve(rows);
  if (periodic) c.push_back(c[0]);
  return c;
}

struct Vectors {
  int size[3];
  std::vector<std::uint32_t> words;

  std::size_t at(int i, int j, int k, int component) const {
    return std::size_t(4 * (i + size[0] * (j + size[1] * k)) + component);
  }
  double value(int i, int j, int k, int component) const {
    return double{one_lane::as_real(words[at(i, j, k, component)])};
  }
};

Vectors random_vectors(int x, int y, int z, unsigned seed) {
  Vectors v{{x, y, z}, std::vector<std::uint32_t>(std::size_t(4 * x * y * z), mark)};
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (std::size_t i = 0; i < v.words.size(); i++)
    if (i % 4 != 3) v.words[i] = one_lane::as_word(uniform(random));
  return v;
}

// A line along an axis, of which the other two indices are given.
std::vector<double> line_of(const Vectors& v, int axis, int a, int b, int component) {
  std::vector<double> line;
  for (int k = 0; k < v.size[axis]; k++) {
    int index[3];
    index[axis] = k;
    index[(axis + 1) % 3] = a;
    index[(axis + 2) % 3] = b;
    line.push_back(v.value(index[0], index[1], index[2], component));
  }
  return line;
}

// The first pass makes |e| <= 2.2 |f| at most, whose rounding fades in the second one by 2 - √3 a node (1.4 in sum);
// the coefficients are 3 |f| at most, rounded once: 2^-24 · (1.4·2.2 + 3) of the greatest value.
constexpr double allowed = 6.1 * 0x1p-24;

double worst_error(int x, int y, int z, int axis, bool periodic) {
  const Vectors before = random_vectors(x, y, z, unsigned(x + 100 * y + 10000 * z + axis));
  Vectors after = before;
  const int lines = x * y * z / before.size[axis];
  for (int item = 0; item < 3 * lines + 2; item++)  // with items beyond the last, as in a group that is not full
    prefilter::vector_prefilter_item(after.words.data(), item, x, y, z, axis, periodic ? 1 : 0);
  double worst = 0;
  for (int a = 0; a < before.size[(axis + 1) % 3]; a++) {
    for (int b = 0; b < before.size[(axis + 2) % 3]; b++) {
      for (int component = 0; component < 3; component++) {
        const std::vector<double> expected = coefficients(line_of(before, axis, a, b, component), periodic);
        const std::vector<double> made = line_of(after, axis, a, b, component);
        for (std::size_t k = 0; k < made.size(); k++) worst = std::max(worst, std::abs(made[k] - expected[k]));
      }
    }
  }
  for (std::size_t i = 3; i < after.words.size(); i += 4) EXPECT_EQ(after.words[i], mark);
  return worst;
}

TEST(VectorPrefilter, NaturalLinesOfAnyLength) {
  for (const int n : {2, 3, 4, 5, 16, 17, 18, 60}) {
    EXPECT_LE(worst_error(n, 3, 2, 0, false), allowed) << n << " nodes along x";
    EXPECT_LE(worst_error(3, n, 2, 1, false), allowed) << n << " nodes along y";
    EXPECT_LE(worst_error(2, 3, n, 2, false), allowed) << n << " nodes along z";
  }
}

TEST(VectorPrefilter, PeriodicLinesOfAnyLength) {
  for (const int n : {4, 5, 6, 28, 29, 30, 60}) {
    EXPECT_LE(worst_error(n, 3, 2, 0, true), allowed) << n << " nodes along x";
    EXPECT_LE(worst_error(3, n, 2, 1, true), allowed) << n << " nodes along y";
    EXPECT_LE(worst_error(2, 3, n, 2, true), allowed) << n << " nodes along z";
  }
}

// Through c(-1), c(0), c(1) the spline is the value and has second derivative 0 where an axis is natural, and goes
// round where it is periodic.
TEST(VectorPrefilter, TheMarginGoesOnAsTheEndsDo) {
  for (int periodic = 0; periodic < 8; periodic++) {
    const Vectors from = random_vectors(4, 5, 6, unsigned(periodic));
    Vectors to{{6, 7, 8}, std::vector<std::uint32_t>(4 * 6 * 7 * 8, 0)};
    for (int item = 0; item < 6 * 7 * 8 + 3; item++)
      pad::vector_pad_node(const_cast<std::uint32_t*>(from.words.data()), to.words.data(), item, 4, 5, 6, periodic);
    const auto pad_of = [&](int component, int i, int j, int k, auto&& self) -> double {
      const int index[3] = {i, j, k};
      for (int axis = 0; axis < 3; axis++) {
        const int n = from.size[axis], at = index[axis];
        if (at >= 0 && at < n) continue;
        const auto other = [&](int moved) {
          int next[3] = {i, j, k};
          next[axis] = moved;
          return self(component, next[0], next[1], next[2], self);
        };
        if ((periodic >> axis & 1) != 0) return other(at < 0 ? n - 2 : 1);
        return at < 0 ? 2 * other(0) - other(1) : 2 * other(n - 1) - other(n - 2);
      }
      return from.value(i, j, k, component);
    };
    for (int k = -1; k <= 6; k++) {
      for (int j = -1; j <= 5; j++) {
        for (int i = -1; i <= 4; i++) {
          // Eight terms, of size 8 at most, 27 in sum.
          for (int component = 0; component < 3; component++)
            EXPECT_NEAR(to.value(i + 1, j + 1, k + 1, component), pad_of(component, i, j, k, pad_of), 8 * 27 * 0x1p-24);
          EXPECT_EQ(to.words[to.at(i + 1, j + 1, k + 1, 3)], mark);
        }
      }
    }
  }
}

}  // namespace
}  // namespace smurf
