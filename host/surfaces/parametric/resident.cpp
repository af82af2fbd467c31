// Surfaces s(u, v) on a device: expressions become device source, patches Bézier pieces.
#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "expression/source.hpp"
#include "kernels/patch/layout.inc"
#include "patches/bezier_source.hpp"
#include "patches/expression_source.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/parametric/definition.hpp"
#include "surfaces/patch_form.hpp"
#include "surfaces/resident_surface.hpp"

namespace smurf {
namespace {

class ResidentParametric final : public ResidentSurface {
 public:
  ResidentParametric(const ParametricSurface& surface, Executor& executor, const PrepareOptions& options)
      : form_(surface.bounds()) {
    const glm::dvec3 size = surface.bounds().upper - surface.bounds().lower;
    const std::vector<PatchLeaf> leaves =
        make_leaves(surface.pieces(), surface.topology(), std::max({size.x, size.y, size.z}), options.progress);
    form_.add_pieces(surface.pieces(), surface.topology(), leaves);
    const std::size_t parts = form_.pieces.size();
    if (surface.patches.empty()) {
      put_expressions(dynamic_cast<const ExpressionSource&>(surface.pieces()));
    } else {
      put_patches(surface, dynamic_cast<const BezierSource&>(surface.pieces()));
    }
    form_.upload(
        executor, leaves, surface.bounds(), [](const PatchLeaf&) { return 0.0; }, parts,
        std::max<std::size_t>(surface.patches.size(), 1));
    modules_["surface"] = kernel_source("patch/surface.inc");
    modules_["frame"] = kernel_source("patch/frame.inc");
    modules_["map"] = kernel_source("patch/no_map.inc");
    modules_["walk"] = kernel_source("patch/walk.inc");
    defines_.merge(form_.defines());
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override { return form_.buffers(); }
  std::size_t bytes() const override { return form_.bytes(); }
  int room_words() const override { return PATCH_ROOM_WORDS; }
  bool update(const SurfaceDefinition&) override { return false; }

 private:
  // One piece, whose parameters are those of the surface.
  void put_expressions(const ExpressionSource& source) {
    Words records(form_.pieces);
    form_.points.resize(1);
    records.put(PIECE_BY_U, 1.0f);
    records.put(PIECE_BY_V, 1.0f);
    records.put(PIECE_START_U, float(source.range(0).lower.x));
    records.put(PIECE_START_V, float(source.range(0).lower.y));
    expression::Graph graph = source.graph();
    std::vector<expression::NodeId> roots;
    const expression::NodeId unit = graph.constant(form_.frame().unit);
    for (int axis = 0; axis < 3; axis++) {
      const expression::NodeId middle = graph.constant(form_.frame().centre[axis]);
      roots.push_back(graph.multiply(graph.subtract(source.nodes()[std::size_t(axis)], middle), unit));
    }
    for (std::size_t i = 3; i < 18; i++) roots.push_back(graph.multiply(source.nodes()[i], unit));
    const std::vector<expression::NodeId> point(roots.begin(), roots.begin() + 9);
    const std::string tangents =
        "  p.s = make3({0}, {1}, {2});\n  p.u = make3({3}, {4}, {5});\n  p.v = make3({6}, {7}, {8});\n";
    std::string text = "#include \"arithmetic/real_number.inc\"\n";
    text += expression::function_source(graph, point, "FN PatchPoint expression_point(real v0, real v1)", "",
                                        "  PatchPoint p;\n" + tangents + "  return p;\n");
    text += expression::function_source(graph, roots, "FN PatchShape expression_shape(real v0, real v1)", "",
                                        "  PatchShape p;\n" + tangents +
                                            "  p.uu = make3({9}, {10}, {11});\n  p.uv = make3({12}, {13}, {14});\n"
                                            "  p.vv = make3({15}, {16}, {17});\n  return p;\n");
    text +=
        "FN PatchPoint position_at(Surface surface, int piece, real u, real v) { return expression_point(u, v); }\n"
        "FN PatchPoint position_each(Surface surface, integer piece, real u, real v) {\n"
        "  return expression_point(u, v);\n}\n"
        "FN PatchShape shape_each(Surface surface, integer piece, real u, real v) { return expression_shape(u, v); }\n"
        "FN integer piece_of(Surface surface, Coordinates c) { return splat_integer(0); }\n";
    modules_["position"] = text;
    defines_["WALK_PART"] = "0.0625f";  // expressions may be anything
  }

  void put_patches(const ParametricSurface& surface, const BezierSource& source) {
    const std::vector<BezierPiece>& pieces = source.pieces();
    int degree_u = 1, degree_v = 1;
    bool is_rational = false;
    for (const BezierPiece& piece : pieces) {
      degree_u = std::max(degree_u, piece.degree[0]);
      degree_v = std::max(degree_v, piece.degree[1]);
      for (const glm::dvec4& p : piece.points) is_rational = is_rational || p.w != 1;
    }
    for (std::size_t i = 0; i < pieces.size(); i++) {
      const Patch& patch = surface.patches[pieces[i].patch];
      form_.put_bezier(i, elevated(pieces[i], degree_u, degree_v), {patch.lower(0), patch.lower(1)}, is_rational);
    }
    put_parts(surface, pieces, form_.pieces);
    modules_["position"] = kernel_source("parametric/patches.inc");
    defines_["BEZIER_U"] = fmt::format("{}", degree_u);
    defines_["BEZIER_V"] = fmt::format("{}", degree_v);
    defines_["BEZIER_RATIONAL"] = is_rational ? "1" : "0";
  }

  // Of each patch its first piece, how many there are, and the knots between them.
  static void put_parts(const ParametricSurface& surface, const std::vector<BezierPiece>& pieces,
                        std::vector<std::uint32_t>& words) {
    Words records(words);
    const std::size_t first = records.add(PART_WORDS * surface.patches.size());
    std::size_t piece = 0;
    for (std::size_t p = 0; p < surface.patches.size(); p++) {
      const std::size_t begin = piece;
      std::vector<double> knots_u, knots_v;
      std::size_t count_u = 0;
      for (; piece < pieces.size() && pieces[piece].patch == p; piece++) {
        if (pieces[piece].lower.y == pieces[begin].lower.y) {
          if (count_u++ > 0) knots_u.push_back(pieces[piece].lower.x);
        } else if (pieces[piece].lower.x == pieces[begin].lower.x) {
          knots_v.push_back(pieces[piece].lower.y);
        }
      }
      const std::size_t at = first + PART_WORDS * p;
      records.put(at + PART_PIECES, std::int32_t(begin));
      records.put(at + PART_COUNT_U, std::int32_t(knots_u.size() + 1));
      records.put(at + PART_COUNT_V, std::int32_t(knots_v.size() + 1));
      const std::size_t breaks = records.add(knots_u.size() + knots_v.size());
      records.put(at + PART_BREAKS, std::int32_t(breaks));
      for (std::size_t i = 0; i < knots_u.size(); i++) records.put(breaks + i, float(knots_u[i]));
      for (std::size_t i = 0; i < knots_v.size(); i++) records.put(breaks + knots_u.size() + i, float(knots_v[i]));
    }
  }

  PatchForm form_;
  std::map<std::string, std::string> modules_, defines_;
};

}  // namespace

std::unique_ptr<ResidentSurface> reside_parametric(const SurfaceDefinition& definition, Executor& executor,
                                                   const PrepareOptions& options) {
  return std::make_unique<ResidentParametric>(dynamic_cast<const ParametricSurface&>(definition), executor, options);
}

}  // namespace smurf
