// Surfaces s(u, v) on a device: leaves, a hierarchy of boxes over them, and the pieces (kernels/patch/layout.inc).
//
// Coordinates are relative to the middle of the surface and in a unit, a power of two, in which it is 1 to 2 in size:
// floats then err by parts of the surface's size, wherever it lies.
//
// Device memory: about 125 bytes a leaf, 128 a piece, and the control points.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "bvh/hierarchy.hpp"
#include "expression/source.hpp"
#include "kernels/patch/layout.inc"
#include "patches/bezier_source.hpp"
#include "patches/expression_source.hpp"
#include "patches/leaves.hpp"
#include "surfaces/kinds.hpp"
#include "surfaces/parametric/definition.hpp"
#include "surfaces/resident_surface.hpp"

namespace smurf {
namespace {

constexpr double half_step = 0x1p-24;  // the rounding of a float, relative
static_assert(LEAF_KIND_REGULAR == int(LeafKind::regular) && LEAF_KIND_OPEN == int(LeafKind::open) &&
              LEAF_KIND_CAP == int(LeafKind::cap));
static_assert(double(LEAF_REACH) == leaf_reach);

// Words to which numbers are written.
class Words {
 public:
  explicit Words(std::vector<std::uint32_t>& words) : words_(words) {}
  // Room for `count` more; returns where it begins.
  std::size_t add(std::size_t count) {
    const std::size_t at = words_.size();
    words_.resize(at + count);
    return at;
  }
  void put(std::size_t at, float value) { words_[at] = std::bit_cast<std::uint32_t>(value); }
  void put(std::size_t at, std::int32_t value) { words_[at] = std::uint32_t(value); }
  void put(std::size_t at, const glm::dvec3& v) {
    for (int axis = 0; axis < 3; axis++) put(at + std::size_t(axis), float(v[axis]));
  }

 private:
  std::vector<std::uint32_t>& words_;
};

float rounded_up(double value) {
  const auto rounded = float(value);
  return double(rounded) >= value ? rounded : std::nextafter(rounded, std::numeric_limits<float>::infinity());
}

double largest(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

// From the surface's own coordinates to those of its device form.
struct Frame {
  glm::dvec3 centre;
  double unit;
  glm::dvec3 operator()(const glm::dvec3& p) const { return (p - centre) * unit; }
};

Frame frame_of(const Bounds& bounds) {
  const double extent = largest(bounds.upper - bounds.lower);
  // Exponents whose power and inverse are floats.
  const int exponent = std::clamp(std::ilogb(extent), -120, 120);
  return {glm::dvec3(glm::vec3(0.5 * (bounds.lower + bounds.upper))), std::ldexp(1.0, -exponent)};
}

class ResidentParametric final : public ResidentSurface {
 public:
  ResidentParametric(const ParametricSurface& surface, Executor& executor, const PrepareOptions& options)
      : frame_(frame_of(surface.bounds())) {
    const double extent = largest(surface.bounds().upper - surface.bounds().lower);
    const std::vector<PatchLeaf> leaves = make_leaves(surface.pieces(), surface.topology(), extent, options.progress);
    const Bvh hierarchy = upload_leaves(executor, surface, leaves);
    upload_pieces(executor, surface, leaves);
    modules_["surface"] = kernel_source("parametric/surface.inc");
    defines_["BVH_STACK"] = fmt::format("{}", std::max(64u, std::bit_ceil(unsigned(hierarchy.stack))));
    std::vector<std::uint32_t> words;
    Words uniforms(words);
    uniforms.add(PATCH_UNIFORM_WORDS);
    uniforms.put(PATCH_CENTRE, frame_.centre);
    uniforms.put(PATCH_UNIT, float(frame_.unit));
    float size = 0;
    for (int axis = 0; axis < 3; axis++) {
      uniforms.put(std::size_t(PATCH_LOWER + axis), hierarchy.bounds.lower[axis]);
      uniforms.put(std::size_t(PATCH_UPPER + axis), hierarchy.bounds.upper[axis]);
      size = std::max(size, hierarchy.bounds.upper[axis] - hierarchy.bounds.lower[axis]);
    }
    uniforms.put(PATCH_EXTENT, size);
    uniforms.put(PATCH_POLES, std::int32_t(poles_));
    uniforms.put(PATCH_PARTS, std::int32_t(parts_));
    uniforms.put(PATCH_PART_COUNT, std::int32_t(std::max<std::size_t>(surface.patches.size(), 1)));
    upload(executor, words, uniforms_, "surface uniforms");
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override {
    return {{"uniforms", uniforms_.get()},
            {"nodes", nodes_.get()},
            {"leaves", leaves_.get()},
            {"pieces", pieces_.get()},
            {"points", points_.get()}};
  }
  std::size_t bytes() const override {
    return uniforms_.bytes() + nodes_.bytes() + leaves_.bytes() + pieces_.bytes() + points_.bytes();
  }
  int room_words() const override { return PATCH_ROOM_WORDS; }
  bool update(const SurfaceDefinition&) override { return false; }

 private:
  using WordBuffer = TypedBuffer<std::uint32_t>;

  static void upload(Executor& executor, const std::vector<std::uint32_t>& words, WordBuffer& buffer,
                     std::string_view purpose) {
    buffer = WordBuffer(executor, words.size(), purpose);
    buffer.write(words);
  }

  // The leaves in the order of the hierarchy.
  Bvh upload_leaves(Executor& executor, const ParametricSurface& surface, const std::vector<PatchLeaf>& leaves) {
    const double world = std::max(largest(surface.bounds().lower), largest(surface.bounds().upper));
    std::vector<BvhBox> boxes;
    double error = 0;
    for (const PatchLeaf& leaf : leaves) {
      boxes.push_back({glm::vec3(frame_(leaf.lower)), glm::vec3(frame_(leaf.upper))});
      error = std::max(error, error_of(leaf, world));
    }
    BvhOptions options;
    options.most_in_leaf = 1;
    // Boxes reach beyond their leaves by what roots at their borders may be off, and rays.
    options.margin = float(std::min(4 * error, 1e-3) + 0x1p-19);
    std::vector<std::uint32_t> words;
    Words records(words);
    Bvh hierarchy = build_bvh(std::move(boxes), options, [&](std::span<const std::uint32_t> one) {
      const std::size_t at = records.add(LEAF_WORDS);
      put_leaf(records, at, leaves[one[0]], world);
      return std::uint32_t(at / LEAF_WORDS);
    });
    upload(executor, hierarchy.nodes, nodes_, "hierarchy of a surface");
    upload(executor, words, leaves_, "leaves of a surface");
    return hierarchy;
  }

  // By how much the device is off in a position, in its unit: the evaluation, the rounding of its parameters, of m and
  // of the sum with a centre; `world` is the greatest coordinate that is subtracted.
  double error_of(const PatchLeaf& leaf, double world) const {
    double error = largest(leaf.error) * frame_.unit + 2 * half_step * (2 + world * frame_.unit);
    const auto moved = [&](double length, double centre, double half) {
      return half > 0 ? length / half * 2 * half_step * (std::abs(centre) + 2 * half) : 0;
    };
    if (leaf.kind == LeafKind::regular) {
      error += moved(largest(leaf.a) * frame_.unit, leaf.centre.x, leaf.half.x);
      error += moved(largest(leaf.b) * frame_.unit, leaf.centre.y, leaf.half.y);
    }
    return error;
  }

  void put_leaf(Words& words, std::size_t at, const PatchLeaf& leaf, double world) const {
    const bool is_regular = leaf.kind == LeafKind::regular;
    const glm::dvec3 a = leaf.a * frame_.unit, b = leaf.b * frame_.unit;
    const glm::dvec3 m = leaf.kind == LeafKind::open ? 0.5 * (leaf.lower + leaf.upper) : leaf.m;
    const glm::dvec3 box = (leaf.upper - leaf.lower) * frame_.unit;
    words.put(at + LEAF_M, frame_(m));
    if (is_regular) {
      words.put(at + LEAF_A, a);
      words.put(at + LEAF_B, b);
      for (int axis = 0; axis < 3; axis++) {
        const double rounding = 2 * half_step * (std::abs(a[axis]) + std::abs(b[axis]));
        words.put(at + std::size_t(LEAF_E + axis), rounded_up(leaf.e[axis] * frame_.unit * (1 + 1e-6) + rounding));
      }
    }
    if (leaf.kind == LeafKind::cap) {
      words.put(at + LEAF_E, a);
      words.put(at + LEAF_CAP_B, b);
    }
    words.put(at + LEAF_ERROR, rounded_up(error_of(leaf, world)));
    words.put(at + LEAF_U, float(leaf.centre.x));
    words.put(at + LEAF_V, float(leaf.centre.y));
    words.put(at + LEAF_HALF_U, float(leaf.half.x));
    words.put(at + LEAF_HALF_V, float(leaf.half.y));
    words.put(at + LEAF_PIECE, std::int32_t(leaf.piece));
    words.put(at + LEAF_KIND, std::int32_t(leaf.kind) + (leaf.kind == LeafKind::cap ? LEAF_KINDS * leaf.side : 0));
    const auto sum = [](const glm::dvec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); };
    words.put(at + LEAF_LENGTHS, rounded_up(leaf.kind == LeafKind::open ? sum(box) : sum(a) + sum(b)));
  }

  void upload_pieces(Executor& executor, const ParametricSurface& surface, const std::vector<PatchLeaf>& leaves) {
    std::vector<std::uint32_t> words, points;
    Words records(words);
    const PieceSource& source = surface.pieces();
    for (std::size_t piece = 0; piece < source.size(); piece++) {
      const std::size_t at = records.add(PIECE_WORDS);
      const ParameterBox range = source.range(piece);
      records.put(at + PIECE_LOWER_U, float(range.lower.x));
      records.put(at + PIECE_LOWER_V, float(range.lower.y));
      records.put(at + PIECE_UPPER_U, float(range.upper.x));
      records.put(at + PIECE_UPPER_V, float(range.upper.y));
      put_borders(records, at, surface.topology(), piece);
    }
    for (const PatchLeaf& leaf : leaves) {
      if (leaf.kind != LeafKind::cap) continue;
      const std::size_t at = PIECE_WORDS * std::size_t(leaf.piece) + PIECE_CAPS + std::size_t(leaf.side);
      const auto reach = float(2 * (leaf.side < 2 ? leaf.half.x : leaf.half.y));
      records.put(at, std::max(reach, std::bit_cast<float>(words[at])));
    }
    poles_ = words.size();
    for (const Pole& pole : surface.topology().poles) {
      const std::size_t at = records.add(POLE_WORDS);
      records.put(at + POLE_KNOWN, std::int32_t(!pole.has_normal ? 0 : (pole.has_curvature ? 2 : 1)));
      records.put(at + POLE_NORMAL, pole.normal);
      const glm::dmat3& s = pole.shape;
      records.put(at + POLE_SHAPE, glm::dvec3(s[0][0], s[1][1], s[2][2]));
      records.put(at + POLE_SHAPE + 3, glm::dvec3(s[0][1], s[0][2], s[1][2]));
    }
    parts_ = words.size();
    if (surface.patches.empty()) {
      put_expressions(dynamic_cast<const ExpressionSource&>(source), records);
      points.resize(1);
    } else {
      put_patches(surface, dynamic_cast<const BezierSource&>(source), words, points);
    }
    upload(executor, words, pieces_, "pieces of a surface");
    upload(executor, points, points_, "control points");
  }

  static void put_borders(Words& words, std::size_t at, const PatchTopology& topology, std::size_t piece) {
    const PieceBorders& borders = topology.pieces[piece];
    for (std::size_t i = 0; i < 4; i++) {
      const std::uint32_t edge = borders.edges[i];
      words.put(at + PIECE_EDGES + i, edge == no_edge ? -1 : std::int32_t(2 * edge + (borders.turned[i] ? 1 : 0)));
      words.put(at + PIECE_VERTICES + i, std::int32_t(borders.vertices[i]));
      std::int32_t found = -1;
      // Of a side's two corners, the first.
      const std::uint32_t corner = borders.vertices[i == 1 ? 1 : (i == 3 ? 2 : 0)];
      for (std::size_t p = 0; borders.collapsed[i] && p < topology.poles.size(); p++) {
        if (topology.poles[p].vertex == corner) found = std::int32_t(p);
      }
      words.put(at + PIECE_SIDE_POLES + i, found);
    }
  }

  // One piece, whose parameters are those of the surface.
  void put_expressions(const ExpressionSource& source, Words& records) {
    records.put(PIECE_BY_U, 1.0f);
    records.put(PIECE_BY_V, 1.0f);
    records.put(PIECE_START_U, float(source.range(0).lower.x));
    records.put(PIECE_START_V, float(source.range(0).lower.y));
    expression::Graph graph = source.graph();
    std::vector<expression::NodeId> roots;
    const expression::NodeId unit = graph.constant(frame_.unit);
    for (int axis = 0; axis < 3; axis++) {
      const expression::NodeId middle = graph.constant(frame_.centre[axis]);
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
  }

  void put_patches(const ParametricSurface& surface, const BezierSource& source, std::vector<std::uint32_t>& words,
                   std::vector<std::uint32_t>& points) {
    Words records(words), coordinates(points);
    const std::vector<BezierPiece>& pieces = source.pieces();
    int degree_u = 1, degree_v = 1;
    bool is_rational = false;
    for (const BezierPiece& piece : pieces) {
      degree_u = std::max(degree_u, piece.degree[0]);
      degree_v = std::max(degree_v, piece.degree[1]);
      for (const glm::dvec4& p : piece.points) is_rational = is_rational || p.w != 1;
    }
    for (std::size_t i = 0; i < pieces.size(); i++) {
      const BezierPiece piece = elevated(pieces[i], degree_u, degree_v);
      const Patch& patch = surface.patches[piece.patch];
      const std::size_t at = PIECE_WORDS * i;
      records.put(at + PIECE_PART, std::int32_t(piece.patch));
      records.put(at + PIECE_POINTS, std::int32_t(points.size()));
      const glm::dvec2 by = piece.upper - piece.lower;
      records.put(at + PIECE_FROM_U, float(piece.lower.x));
      records.put(at + PIECE_FROM_V, float(piece.lower.y));
      records.put(at + PIECE_BY_U, float(by.x));
      records.put(at + PIECE_BY_V, float(by.y));
      records.put(at + PIECE_START_U, float(patch.lower(0)));
      records.put(at + PIECE_START_V, float(patch.lower(1)));
      // Control points relative to the middle of their hull, which is a float itself.
      glm::dvec3 lower(std::numeric_limits<double>::max()), upper(-lower);
      for (const glm::dvec4& p : piece.points) {
        if (!(p.w > 0)) continue;
        lower = glm::min(lower, frame_(glm::dvec3(p) / p.w));
        upper = glm::max(upper, frame_(glm::dvec3(p) / p.w));
      }
      const glm::dvec3 centre = glm::dvec3(glm::vec3(0.5 * (lower + upper)));
      records.put(at + PIECE_CENTRE, centre);
      for (const glm::dvec4& p : piece.points) {
        const std::size_t to = coordinates.add(is_rational ? 4 : 3);
        coordinates.put(to, (glm::dvec3(p) - p.w * frame_.centre) * frame_.unit - p.w * centre);
        if (is_rational) coordinates.put(to + 3, float(p.w));
      }
    }
    put_parts(surface, pieces, words);
    modules_["position"] = kernel_source("patch/bezier.inc");
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

  const Frame frame_;
  std::size_t poles_ = 0, parts_ = 0;
  std::map<std::string, std::string> modules_, defines_;
  WordBuffer uniforms_, nodes_, leaves_, pieces_, points_;
};

}  // namespace

std::unique_ptr<ResidentSurface> reside_parametric(const SurfaceDefinition& definition, Executor& executor,
                                                   const PrepareOptions& options) {
  return std::make_unique<ResidentParametric>(dynamic_cast<const ParametricSurface&>(definition), executor, options);
}

}  // namespace smurf
