#include "surfaces/patch_form.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/patch/layout.inc"

namespace smurf {
namespace {

constexpr double greatest_more = 1e30;
constexpr double half_step = 0x1p-24;  // the rounding of a float, relative
static_assert(LEAF_KIND_REGULAR == int(LeafKind::regular) && LEAF_KIND_OPEN == int(LeafKind::open) &&
              LEAF_KIND_CAP == int(LeafKind::cap));
static_assert(double(LEAF_REACH) == leaf_reach);

float rounded_up(double value) {
  const auto rounded = float(value);
  return double(rounded) >= value ? rounded : std::nextafter(rounded, std::numeric_limits<float>::infinity());
}

double largest(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

PatchFrame frame_of(const Bounds& bounds) {
  const double extent = largest(bounds.upper - bounds.lower);
  // Exponents whose power and inverse are floats.
  const int exponent = std::clamp(std::ilogb(extent), -120, 120);
  return {glm::dvec3(glm::vec3(0.5 * (bounds.lower + bounds.upper))), std::ldexp(1.0, -exponent)};
}

void upload_words(Executor& executor, const std::vector<std::uint32_t>& words, TypedBuffer<std::uint32_t>& buffer,
                  std::string_view purpose) {
  buffer = TypedBuffer<std::uint32_t>(executor, words.size(), purpose);
  buffer.write(words);
}

void put_borders(Words& words, std::size_t at, const PatchTopology& topology, std::size_t piece) {
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

// What each side meets, as PIECE_ACROSS has it; by four times the piece plus the side.
std::vector<std::int32_t> sides_across(const PatchTopology& topology) {
  const auto runs_along = [](std::size_t side) { return side % 4 == 1 || side % 4 == 2; };
  std::vector<std::int32_t> across(4 * topology.pieces.size(), -1);
  std::vector<std::size_t> first(topology.edges, across.size());
  for (std::size_t side = 0; side < across.size(); side++) {
    const PieceBorders& borders = topology.pieces[side / 4];
    const std::uint32_t edge = borders.edges[side % 4];
    if (edge == no_edge) continue;
    const std::size_t other = first[edge];
    if (other == across.size()) {
      first[edge] = side;
      continue;
    }
    const bool reversed = (runs_along(side) == runs_along(other)) != borders.turned[side % 4];
    across[side] = std::int32_t(2 * other + (reversed ? 1 : 0));
    across[other] = std::int32_t(2 * side + (reversed ? 1 : 0));
  }
  return across;
}

}  // namespace

PatchForm::PatchForm(const Bounds& bounds) : frame_(frame_of(bounds)) {}

void PatchForm::add_pieces(const PieceSource& source, const PatchTopology& topology,
                           const std::vector<PatchLeaf>& leaves, std::span<const ParameterBox> more) {
  Words records(pieces);
  const std::vector<std::int32_t> across = sides_across(topology);
  for (std::size_t piece = 0; piece < source.size(); piece++) {
    const std::size_t at = records.add(PIECE_WORDS);
    for (std::size_t i = 0; i < 4; i++) records.put(at + PIECE_ACROSS + i, across[4 * piece + i]);
    const ParameterBox range = source.range(piece);
    records.put(at + PIECE_LOWER_U, float(range.lower.x));
    records.put(at + PIECE_LOWER_V, float(range.lower.y));
    records.put(at + PIECE_UPPER_U, float(range.upper.x));
    records.put(at + PIECE_UPPER_V, float(range.upper.y));
    put_borders(records, at, topology, piece);
  }
  for (const ParameterBox& box : more) {
    const std::size_t at = records.add(PIECE_WORDS);
    records.put(at + PIECE_FROM_U, float(box.lower.x));
    records.put(at + PIECE_FROM_V, float(box.lower.y));
    records.put(at + PIECE_BY_U, float(box.upper.x - box.lower.x));
    records.put(at + PIECE_BY_V, float(box.upper.y - box.lower.y));
    records.put(at + PIECE_UPPER_U, 1.0f);
    records.put(at + PIECE_UPPER_V, 1.0f);
    for (std::size_t i = 0; i < 4; i++) {
      records.put(at + PIECE_EDGES + i, std::int32_t(-1));
      records.put(at + PIECE_VERTICES + i, std::int32_t(-1));
      records.put(at + PIECE_SIDE_POLES + i, std::int32_t(-1));
      records.put(at + PIECE_ACROSS + i, std::int32_t(-1));
    }
  }
  for (const PatchLeaf& leaf : leaves) {
    if (leaf.kind != LeafKind::cap) continue;
    const std::size_t at = PIECE_WORDS * std::size_t(leaf.piece) + PIECE_CAPS + std::size_t(leaf.side);
    const auto reach = float(2 * (leaf.side < 2 ? leaf.half.x : leaf.half.y));
    records.put(at, std::max(reach, std::bit_cast<float>(pieces[at])));
  }
  poles_ = pieces.size();
  for (const Pole& pole : topology.poles) {
    const std::size_t at = records.add(POLE_WORDS);
    records.put(at + POLE_KNOWN, std::int32_t(!pole.has_normal ? 0 : (pole.has_curvature ? 2 : 1)));
    records.put(at + POLE_NORMAL, pole.normal);
    const glm::dmat3& s = pole.shape;
    records.put(at + POLE_SHAPE, glm::dvec3(s[0][0], s[1][1], s[2][2]));
    records.put(at + POLE_SHAPE + 3, glm::dvec3(s[0][1], s[0][2], s[1][2]));
  }
  put_sides_of_poles(topology);
}

void PatchForm::put_sides_of_poles(const PatchTopology& topology) {
  Words records(pieces);
  std::vector<std::vector<std::int32_t>> sides(topology.poles.size());
  for (std::size_t piece = 0; piece < topology.pieces.size(); piece++) {
    for (std::size_t side = 0; side < 4; side++) {
      const auto pole = std::int32_t(pieces[PIECE_WORDS * piece + PIECE_SIDE_POLES + side]);
      if (pole >= 0) sides[std::size_t(pole)].push_back(std::int32_t(4 * piece + side));
    }
  }
  for (std::size_t pole = 0; pole < sides.size(); pole++) {
    const std::size_t at = poles_ + POLE_WORDS * pole;
    std::size_t to = records.add(sides[pole].size());
    records.put(at + POLE_SIDES, std::int32_t(to));
    records.put(at + POLE_SIDE_COUNT, std::int32_t(sides[pole].size()));
    for (const std::int32_t side : sides[pole]) records.put(to++, side);
  }
}

void PatchForm::put_bezier(std::size_t number, const BezierPiece& piece, const glm::dvec2& start, bool rational) {
  Words records(pieces), coordinates(points);
  const std::size_t at = PIECE_WORDS * number;
  records.put(at + PIECE_PART, std::int32_t(piece.patch));
  records.put(at + PIECE_POINTS, std::int32_t(points.size()));
  const glm::dvec2 by = piece.upper - piece.lower;
  records.put(at + PIECE_FROM_U, float(piece.lower.x));
  records.put(at + PIECE_FROM_V, float(piece.lower.y));
  records.put(at + PIECE_BY_U, float(by.x));
  records.put(at + PIECE_BY_V, float(by.y));
  records.put(at + PIECE_START_U, float(start.x));
  records.put(at + PIECE_START_V, float(start.y));
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
    const std::size_t to = coordinates.add(rational ? 4 : 3);
    coordinates.put(to, (glm::dvec3(p) - p.w * frame_.centre) * frame_.unit - p.w * centre);
    if (rational) coordinates.put(to + 3, float(p.w));
  }
}

void PatchForm::upload(Executor& executor, const std::vector<PatchLeaf>& leaves, const Bounds& bounds,
                       const std::function<double(const PatchLeaf&)>& more, std::size_t parts, std::size_t part_count) {
  const Bvh hierarchy = upload_leaves(executor, leaves, bounds, more);
  stack_ = std::size_t(hierarchy.stack);
  upload_words(executor, pieces, pieces_, "pieces of a surface");
  upload_words(executor, points, points_, "control points");
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
  uniforms.put(PATCH_OFF, rounded_up(off * frame_.unit));
  uniforms.put(PATCH_POLES, std::int32_t(poles_));
  uniforms.put(PATCH_PARTS, std::int32_t(parts));
  uniforms.put(PATCH_PART_COUNT, std::int32_t(part_count));
  upload_words(executor, words, uniforms_, "surface uniforms");
}

std::map<std::string, std::string> PatchForm::defines() const {
  return {{"BVH_STACK", fmt::format("{}", std::max(64u, std::bit_ceil(unsigned(stack_))))}};
}

BufferGroup PatchForm::buffers() const {
  return {{"uniforms", uniforms_.get()},
          {"nodes", nodes_.get()},
          {"leaves", leaves_.get()},
          {"pieces", pieces_.get()},
          {"points", points_.get()}};
}

std::size_t PatchForm::bytes() const {
  return uniforms_.bytes() + nodes_.bytes() + leaves_.bytes() + pieces_.bytes() + points_.bytes();
}

// The leaves in the order of the hierarchy.
Bvh PatchForm::upload_leaves(Executor& executor, const std::vector<PatchLeaf>& leaves, const Bounds& bounds,
                             const std::function<double(const PatchLeaf&)>& more) {
  const double world = std::max(largest(bounds.lower), largest(bounds.upper));
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
    put_leaf(records, at, leaves[one[0]], world, more(leaves[one[0]]));
    return std::uint32_t(at / LEAF_WORDS);
  });
  upload_words(executor, hierarchy.nodes, nodes_, "hierarchy of a surface");
  upload_words(executor, words, leaves_, "leaves of a surface");
  return hierarchy;
}

// By how much the device is off in a position, in its unit: the evaluation, the rounding of its parameters, of m and
// of the sum with a centre; `world` is the greatest coordinate that is subtracted.
double PatchForm::error_of(const PatchLeaf& leaf, double world) const {
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

void PatchForm::put_leaf(Words& words, std::size_t at, const PatchLeaf& leaf, double world, double more) const {
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
  words.put(at + LEAF_MORE, rounded_up(std::min(more * frame_.unit, greatest_more)));
  const auto sum = [](const glm::dvec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); };
  words.put(at + LEAF_LENGTHS, rounded_up(leaf.kind == LeafKind::open ? sum(box) : sum(a) + sum(b)));
}

}  // namespace smurf
