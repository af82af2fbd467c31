#include "reference/parametric/facets.hpp"

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "expression/evaluate.hpp"
#include "expression/graph.hpp"
#include "expression/parser.hpp"
#include "surfaces/parametric/definition.hpp"

namespace smurf {
namespace {

using expression::Evaluator;
using expression::NodeId;
using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

// ---- Expressions

class ExpressionFacet : public ReferenceFacet {
 public:
  explicit ExpressionFacet(const ParametricExpressions& given) : ExpressionFacet(given, functions_of(given)) {
    lower = part_lower = given.lower;
    upper = part_upper = given.upper;
    border = {true, true, true, true};
  }

  ReferenceJet at(double u, double v, int order) const override {
    thread_local std::vector<double> scratch;
    const std::array<double, 2> variables{u, v};
    std::array<double, 18> values{};
    constexpr std::array<std::size_t, 3> counts{3, 9, 18};
    const auto level = std::size_t(order);
    evaluators_[level](std::span(variables), std::span(values).first(counts[level]), scratch);
    const auto vector = [&](std::size_t i) { return dvec3(values[i], values[i + 1], values[i + 2]); };
    return {vector(0), vector(3), vector(6), vector(9), vector(12), vector(15)};
  }

 private:
  struct Functions {
    expression::Graph graph;
    std::vector<NodeId> roots;  // s, s_u, s_v, s_uu, s_uv, s_vv
  };

  static Functions functions_of(const ParametricExpressions& given) {
    static const std::vector<std::string> names{"u", "v"};
    Functions f;
    for (const std::string& text : given.position)
      f.roots.push_back(expression::parse(f.graph, text, names, given.parameters));
    const auto differentiate = [&](std::size_t from, int variable) {
      for (std::size_t i = from; i < from + 3; i++)
        f.roots.push_back(expression::derivative(f.graph, f.roots[i], variable));
    };
    differentiate(0, 0);
    differentiate(0, 1);
    differentiate(3, 0);
    differentiate(3, 1);
    differentiate(6, 1);
    return f;
  }

  ExpressionFacet(const ParametricExpressions&, const Functions& f)
      : evaluators_{Evaluator(f.graph, std::span(f.roots).first(3)), Evaluator(f.graph, std::span(f.roots).first(9)),
                    Evaluator(f.graph, f.roots)} {}

  std::array<Evaluator, 3> evaluators_;  // by order
};

// ---- B-splines

constexpr int most_functions = most_patch_degree + 1;
using BasisFunctions = std::array<std::array<double, most_functions>, 3>;  // by order of the derivative

// The degree + 1 basis functions that do not vanish on [knots[span], knots[span + 1]], and their derivatives (A2.3).
BasisFunctions basis_functions(const std::vector<double>& knots, int degree, std::size_t span, double t, int order) {
  const auto p = std::size_t(degree);
  std::array<std::array<double, most_functions>, most_functions> ndu{};  // functions above, knot differences below
  std::array<double, most_functions> left{}, right{};
  ndu[0][0] = 1;
  for (std::size_t j = 1; j <= p; j++) {
    left[j] = t - knots[span + 1 - j];
    right[j] = knots[span + j] - t;
    double saved = 0;
    for (std::size_t r = 0; r < j; r++) {
      ndu[j][r] = right[r + 1] + left[j - r];
      const double part = ndu[r][j - 1] / ndu[j][r];
      ndu[r][j] = saved + right[r + 1] * part;
      saved = left[j - r] * part;
    }
    ndu[j][j] = saved;
  }
  BasisFunctions out{};
  for (std::size_t j = 0; j <= p; j++) out[0][j] = ndu[j][p];
  for (int r = 0; r <= degree; r++) {
    std::array<std::array<double, most_functions>, 2> a{};
    std::size_t now = 0, next = 1;
    a[0][0] = 1;
    for (int k = 1; k <= std::min(order, degree); k++) {
      const int rk = r - k, pk = degree - k;
      const auto at = [&](int i, int j) { return ndu[std::size_t(i)][std::size_t(j)]; };
      double sum = 0;
      if (r >= k) {
        a[next][0] = a[now][0] / at(pk + 1, rk);
        sum = a[next][0] * at(rk, pk);
      }
      const int first = rk >= -1 ? 1 : -rk, last = r - 1 <= pk ? k - 1 : degree - r;
      for (int j = first; j <= last; j++) {
        const auto c = std::size_t(j);
        a[next][c] = (a[now][c] - a[now][c - 1]) / at(pk + 1, rk + j);
        sum += a[next][c] * at(rk + j, pk);
      }
      if (r <= pk) {
        a[next][std::size_t(k)] = -a[now][std::size_t(k - 1)] / at(pk + 1, r);
        sum += a[next][std::size_t(k)] * at(r, pk);
      }
      out[std::size_t(k)][std::size_t(r)] = sum;
      std::swap(now, next);
    }
  }
  double factor = degree;
  for (int k = 1; k <= std::min(order, degree); k++) {
    for (std::size_t j = 0; j <= p; j++) out[std::size_t(k)][j] *= factor;
    factor *= degree - k;
  }
  return out;
}

class PatchFacet : public ReferenceFacet {
 public:
  PatchFacet(std::shared_ptr<const std::vector<Patch>> patches, std::size_t number, std::array<std::size_t, 2> spans)
      : patches_(std::move(patches)), patch_((*patches_)[number]), spans_(spans) {
    const Patch& patch = patch_;
    part = std::uint32_t(number);
    for (int d = 0; d < 2; d++) {
      const auto axis = std::size_t(d);
      const std::vector<double>& knots = patch.knots[axis];
      const std::size_t span = spans[axis];
      lower[d] = knots[span];
      upper[d] = knots[span + 1];
      part_lower[d] = patch.lower(d);
      part_upper[d] = patch.upper(d);
      // A knot of degree + 1 times parts the patch.
      const auto parts = [&](double knot) { return std::ranges::count(knots, knot) > patch.degree[axis]; };
      border[2 * axis] = lower[d] == part_lower[d] || parts(lower[d]);
      border[2 * axis + 1] = upper[d] == part_upper[d] || parts(upper[d]);
    }
  }

  ReferenceJet at(double u, double v, int order) const override {
    const int p = patch_.degree[0], q = patch_.degree[1];
    const BasisFunctions nu = basis_functions(patch_.knots[0], p, spans_[0], u, order);
    const BasisFunctions nv = basis_functions(patch_.knots[1], q, spans_[1], v, order);
    std::array<dvec4, 6> sums{};  // of the homogeneous surface: s, u, v, uu, uv, vv
    for (auto& sum : sums) sum = dvec4(0);
    for (int j = 0; j <= q; j++) {
      const std::size_t row =
          (spans_[1] - std::size_t(q) + std::size_t(j)) * std::size_t(patch_.size[0]) + spans_[0] - std::size_t(p);
      std::array<dvec4, 3> along{dvec4(0), dvec4(0), dvec4(0)};
      for (int i = 0; i <= p; i++) {
        const dvec4& point = patch_.points[row + std::size_t(i)];
        for (std::size_t k = 0; k <= std::size_t(order); k++) along[k] += nu[k][std::size_t(i)] * point;
      }
      const auto b = std::size_t(j);
      sums[0] += nv[0][b] * along[0];
      if (order > 0) {
        sums[1] += nv[0][b] * along[1];
        sums[2] += nv[1][b] * along[0];
      }
      if (order > 1) {
        sums[3] += nv[0][b] * along[2];
        sums[4] += nv[1][b] * along[1];
        sums[5] += nv[2][b] * along[0];
      }
    }
    // A4.4, for each derivative in turn.
    const double w = sums[0].w;
    ReferenceJet jet;
    jet.s = dvec3(sums[0]) / w;
    jet.u = (dvec3(sums[1]) - sums[1].w * jet.s) / w;
    jet.v = (dvec3(sums[2]) - sums[2].w * jet.s) / w;
    jet.uu = (dvec3(sums[3]) - 2 * sums[1].w * jet.u - sums[3].w * jet.s) / w;
    jet.uv = (dvec3(sums[4]) - sums[1].w * jet.v - sums[2].w * jet.u - sums[4].w * jet.s) / w;
    jet.vv = (dvec3(sums[5]) - 2 * sums[2].w * jet.v - sums[5].w * jet.s) / w;
    return jet;
  }

 private:
  std::shared_ptr<const std::vector<Patch>> patches_;
  const Patch& patch_;  // one of them
  std::array<std::size_t, 2> spans_;
};

// The knots that begin a rectangle.
std::vector<std::size_t> spans_of(const Patch& patch, std::size_t axis) {
  std::vector<std::size_t> spans;
  const std::vector<double>& knots = patch.knots[axis];
  for (auto i = std::size_t(patch.degree[axis]); i < std::size_t(patch.size[axis]); i++) {
    if (knots[i] < knots[i + 1]) spans.push_back(i);
  }
  return spans;
}

}  // namespace

std::vector<std::unique_ptr<ReferenceFacet>> reference_facets(const ParametricSurface& surface) {
  std::vector<std::unique_ptr<ReferenceFacet>> facets;
  if (surface.patches.empty()) {
    facets.push_back(std::make_unique<ExpressionFacet>(surface.expressions));
    return facets;
  }
  const auto patches = std::make_shared<const std::vector<Patch>>(surface.patches);
  for (std::size_t number = 0; number < patches->size(); number++) {
    const Patch& patch = (*patches)[number];
    for (const std::size_t v : spans_of(patch, 1)) {
      for (const std::size_t u : spans_of(patch, 0))
        facets.push_back(std::make_unique<PatchFacet>(patches, number, std::array{u, v}));
    }
  }
  return facets;
}

}  // namespace smurf
