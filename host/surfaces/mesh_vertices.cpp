#include "surfaces/mesh_vertices.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <span>
#include <vector>

#include "mesh_parameters.inc"
#include "parallel.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using std::uint32_t;
using std::uint64_t;

constexpr std::size_t fewest_points = 12;   // a fit goes on beyond two rings until it has so many,
constexpr std::size_t most_points = 64;     // and takes no more than these beyond the first ring
constexpr std::size_t most_passed_on = 32;  // a vertex with more neighbours is the hub of a fan: it leads no further
constexpr int most_copied = 12;             // neighbours of those whose fans are passed on as they stand
constexpr std::size_t slices_in_task = 128;
constexpr std::size_t header = 3 * MESH_SLICE;  // words of a slice before its entries

void require_room(std::size_t words, const Mesh& mesh) {
  constexpr std::size_t most = (std::size_t(1) << 31) - 1;
  if (words > most)
    throw Error(
        ErrorCode::memory,
        fmt::format("normals of a mesh of {} vertices and {} triangles take tables of {} words; kernels can number {}",
                    mesh.vertex_count(), mesh.face_count(), words, most));
}

// The other two corners of a triangle, in order.
struct Pair {
  uint32_t from, to;
};

// Those of all triangles, by vertex: counted, then filled in the order of faces.
class Pairs {
 public:
  explicit Pairs(const Mesh& mesh) : first_(mesh.vertex_count() + 1), pairs_(3 * mesh.face_count()) {
    // Where each row ends, then counted down to where it begins.
    for (const glm::uvec3& face : mesh.faces()) first_[face.x]++, first_[face.y]++, first_[face.z]++;
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    const auto faces = mesh.faces();
    for (std::size_t i = faces.size(); i-- > 0;) {
      const glm::uvec3 f = faces[i];
      pairs_[--first_[f.z]] = {f.x, f.y};
      pairs_[--first_[f.y]] = {f.z, f.x};
      pairs_[--first_[f.x]] = {f.y, f.z};
    }
  }
  std::span<const Pair> operator[](uint32_t vertex) const {
    return {pairs_.data() + first_[vertex], first_[vertex + 1] - first_[vertex]};
  }
  std::size_t first(uint32_t vertex) const { return first_[vertex]; }
  // Says that it will be wanted where a row stands.
  void ask_for_row(uint32_t vertex) const { __builtin_prefetch(&first_[vertex]); }

 private:
  std::vector<uint32_t> first_;
  Values<Pair> pairs_;
};

// Which numbers were met since it was last cleared.
class Met {
 public:
  // Room for `most` numbers.
  void clear(std::size_t most) {
    if (4 * most > table_.size())
      table_.assign(std::bit_ceil(4 * most), 0), shift_ = std::countl_zero(table_.size()) + 1;
    stamp_++;
  }
  // Whether the number is new.
  bool add(uint32_t number) {
    const uint64_t word = stamp_ << 32 | number;
    std::size_t at = std::size_t(uint64_t(number) * 0x9e3779b97f4a7c15u >> shift_);
    while (table_[at] >> 32 == stamp_ && table_[at] != word) at = (at + 1) & (table_.size() - 1);
    const bool is_new = table_[at] != word;
    table_[at] = word;
    return is_new;
  }

 private:
  std::vector<uint64_t> table_ = std::vector<uint64_t>(1024);
  int shift_ = 54;
  uint64_t stamp_ = 0;  // fewer than 2^32 vertices
};

enum class FanKind : std::uint8_t { closed, open, irregular };

struct Ring {
  std::vector<uint32_t> entries;
  std::size_t fan = 0, points = 0;  // where the fans end, and where the points of the fit begin
  int state = 0;                    // MESH_BOUNDARY + MESH_NO_CURVATURE

  uint32_t number(std::size_t i) const { return std::min(entries[i], ~entries[i]); }
};

// The neighbours in turn, if there is one fan of triangles; a closed one ends with the neighbour that it begins with.
FanKind chain(std::span<const Pair> around, uint32_t* entries) {
  std::array<Pair, most_passed_on> rest;
  std::copy(around.begin(), around.end(), rest.begin());
  std::size_t left = around.size() - 1, size = 2;
  const uint32_t begin = rest[left].from;
  uint32_t end = rest[left].to;
  entries[0] = begin;
  entries[1] = end;
  while (left > 0) {
    std::size_t i = 0;
    while (i < left && rest[i].from != end) i++;
    if (i == left) break;
    end = rest[i].to;
    entries[size++] = end;
    rest[i] = rest[--left];
  }
  if (left == 0 && end == begin) return FanKind::closed;
  while (left > 0) {
    std::size_t i = 0;
    while (i < left && rest[i].to != entries[0]) i++;
    if (i == left) return FanKind::irregular;
    std::copy_backward(entries, entries + size, entries + size + 1);
    entries[0] = rest[i].from;
    size++;
    rest[i] = rest[--left];
  }
  return FanKind::open;
}

FanKind chain_many(std::span<const Pair> around, uint32_t* entries) {
  std::vector<Pair> sorted(around.begin(), around.end());
  std::ranges::sort(sorted, {}, &Pair::from);
  std::vector<uint32_t> ends;
  for (const Pair& pair : sorted) ends.push_back(pair.to);
  std::ranges::sort(ends);
  uint32_t end = sorted[0].from;
  for (const Pair& pair : sorted) {
    if (!std::ranges::binary_search(ends, pair.from)) end = pair.from;
  }
  entries[0] = end;
  for (std::size_t i = 0; i < sorted.size(); i++) {
    const auto next = std::ranges::lower_bound(sorted, end, {}, &Pair::from);
    if (next == sorted.end() || next->from != end) return FanKind::irregular;
    end = next->to;
    entries[i + 1] = end;
  }
  return end == entries[0] ? FanKind::closed : FanKind::open;
}

// The fans of all vertices: for each as many neighbours as it has triangles, and one more.
class Fans {
 public:
  Fans(const Mesh& mesh, const Pairs& pairs)
      : pairs_(pairs),
        kinds_(mesh.vertex_count()),
        entries_(3 * mesh.face_count() + mesh.vertex_count() + std::size_t(2 * most_copied)) {
    const std::size_t count = mesh.vertex_count();
    parallel_for((count + step - 1) / step, [&](std::size_t task) {
      for (std::size_t v = task * step; v < std::min((task + 1) * step, count); v++) find(uint32_t(v));
    });
  }
  FanKind kind(uint32_t vertex) const { return kinds_[vertex]; }
  std::span<const uint32_t> operator[](uint32_t vertex) const {
    return {entries_.data() + pairs_.first(vertex) + vertex, pairs_[vertex].size() + 1};
  }
  void ask_for(uint32_t vertex) const {
    __builtin_prefetch(entries_.data() + pairs_.first(vertex) + vertex);
    __builtin_prefetch(&kinds_[vertex]);
  }

 private:
  static constexpr std::size_t step = 2048;

  void find(uint32_t vertex) {
    const std::span<const Pair> around = pairs_[vertex];
    uint32_t* entries = entries_.data() + pairs_.first(vertex) + vertex;
    FanKind kind = FanKind::irregular;
    if (!around.empty()) kind = around.size() <= most_passed_on ? chain(around, entries) : chain_many(around, entries);
    // An edge of more triangles is met again.
    if (kind != FanKind::irregular) {
      const std::size_t last = around.size() - (kind == FanKind::closed ? 1 : 0);
      if (is_repeated({entries, last + 1})) kind = FanKind::irregular;
    }
    kinds_[vertex] = kind;
  }

  static bool is_repeated(std::span<const uint32_t> numbers) {
    if (numbers.size() <= most_passed_on) {
      bool found = false;
      for (std::size_t i = 1; i < numbers.size(); i++) {
        for (std::size_t k = 0; k < i; k++) found |= numbers[i] == numbers[k];
      }
      return found;
    }
    std::vector<uint32_t> sorted(numbers.begin(), numbers.end());
    std::ranges::sort(sorted);
    return std::ranges::adjacent_find(sorted) != sorted.end();
  }

  const Pairs& pairs_;
  std::vector<FanKind> kinds_;
  Values<uint32_t> entries_;
};

// Where `number` stands once among the first `length` of most_copied numbers.
std::size_t place_in(const uint32_t* numbers, uint32_t length, uint32_t number) {
  using Four = uint32_t __attribute__((vector_size(16)));
  Four sum = {0, 0, 0, 0}, place = {0, 1, 2, 3};
  for (int k = 0; k < most_copied; k += 4, place += 4) {
    Four four;
    std::memcpy(&four, numbers + k, sizeof four);
    sum += Four(four == number) & Four(place < length) & place;
  }
  return sum[0] + sum[1] + sum[2] + sum[3];
}

// The rings of a slice's vertices.
class Rings {
 public:
  Rings(const Mesh& mesh, const Pairs& pairs, const Fans& fans) : mesh_(mesh), pairs_(pairs), fans_(fans) {}

  // Those of the `count` vertices from `first` on. In step, because what vertices' neighbours lead to may stand anywhere in memory: it is asked
  // for ahead, for the whole slice at once.
  std::span<const Ring> find(uint32_t first, std::size_t count) {
    for (std::size_t i = 0; i < count; i++) set_fan(first + uint32_t(i), rings_[i]);
    for (std::size_t i = 0; i < count; i++) {
      for (std::size_t k = rings_[i].points; k < rings_[i].entries.size(); k++) pairs_.ask_for_row(rings_[i].number(k));
    }
    for (std::size_t i = 0; i < count; i++) {
      for (std::size_t k = rings_[i].points; k < rings_[i].entries.size(); k++) fans_.ask_for(rings_[i].number(k));
    }
    for (std::size_t i = 0; i < count; i++) {
      if (!add_second_ring(first + uint32_t(i), rings_[i])) find_points(first + uint32_t(i), rings_[i]);
    }
    return {rings_.data(), count};
  }

 private:
  void set_fan(uint32_t vertex, Ring& ring) {
    const FanKind kind = fans_.kind(vertex);
    if (kind == FanKind::irregular) return set_irregular(vertex, pairs_[vertex], ring);
    const std::span<const uint32_t> fan = fans_[vertex];
    ring.entries.assign(fan.begin(), fan.end());
    ring.entries[0] = ~fan[0];
    ring.state = kind == FanKind::open ? MESH_BOUNDARY : 0;
    ring.fan = fan.size();
    ring.points = kind == FanKind::closed ? 1 : 0;
  }

  // Where all fans about are closed: past the vertex and the two neighbours beside it, the fan of each neighbour runs through the second ring,
  // and ends with what the next neighbour's begins with. False where that is not enough, or may meet a vertex twice; `ring` is then as before.
  bool add_second_ring(uint32_t vertex, Ring& ring) {
    const std::span<const uint32_t> fan = fans_[vertex];
    if (fans_.kind(vertex) != FanKind::closed || fan.size() > 17) return false;
    std::vector<uint32_t>& entries = ring.entries;
    entries.resize(fan.size() + fan.size() * copied + 2 * copied);
    uint32_t* next = entries.data() + fan.size();
    bool enough = true;
    for (const uint32_t neighbour : fan.subspan(1)) {
      const std::span<const uint32_t> other = fans_[neighbour];
      const std::size_t length = other.size() - 1;
      enough = fans_.kind(neighbour) == FanKind::closed && length >= 4 && length <= std::size_t(most_copied);
      if (!enough) break;
      // Without branches that depend on the mesh, as they would be guessed wrong.
      const uint32_t* row = other.data();
      const std::size_t at = place_in(row, uint32_t(length), vertex);
      const std::size_t past = at + 2, start = past < length ? past : past - length;
      std::memcpy(next, row + start, copied * sizeof(uint32_t));
      std::memcpy(next + std::min(length - start, copied), row, copied * sizeof(uint32_t));
      // The last of them is the next neighbour's first.
      next += length - 4;
    }
    const auto size = std::size_t(next - entries.data());
    enough = enough && size >= fewest_points && size - 1 <= most_points;
    bool again = false;
    if (enough) {
      for (const uint32_t number : fan.subspan(1)) again |= mark(number, vertex);
      for (std::size_t i = fan.size(); i < size; i++) again |= mark(entries[i], vertex);
    }
    entries.resize(enough && !again ? size : fan.size());
    return enough && !again;
  }

  // Whether this number, or another of the same remainder, was marked for the vertex.
  bool mark(uint32_t number, uint32_t vertex) {
    uint32_t& marked = marked_[number % marks];
    const bool again = marked == vertex;
    marked = vertex;
    return again;
  }

  // Each triangle as a fan of its own, then the neighbours.
  void set_irregular(uint32_t vertex, std::span<const Pair> around, Ring& ring) {
    std::vector<uint32_t>& entries = ring.entries;
    entries.clear();
    for (const Pair& pair : around) entries.push_back(pair.from), entries.push_back(pair.to);
    const int states = mesh_.vertex_states()[vertex];
    ring.state = ((states & vertex_boundary) != 0 ? MESH_BOUNDARY : 0) +
                 ((states & (vertex_non_manifold | vertex_unreferenced)) != 0 ? MESH_NO_CURVATURE : 0);
    ring.fan = ring.points = entries.size();
    met_.clear(entries.size());
    for (std::size_t i = 0; i < ring.fan; i++) {
      if (met_.add(entries[i])) entries.push_back(entries[i]);
      if (i % 2 == 0) entries[i] = ~entries[i];
    }
  }

  // Neighbours ring by ring behind the first.
  void find_points(uint32_t vertex, Ring& ring) {
    std::vector<uint32_t>& entries = ring.entries;
    const std::size_t begin = ring.points, most = std::max(entries.size(), begin + most_points);
    met_.clear(entries.size() + most_points + 2 * most_passed_on + 1);
    met_.add(vertex);
    for (std::size_t i = begin; i < entries.size(); i++) met_.add(ring.number(i));
    std::size_t from = begin, to = entries.size();
    for (int number = 1; from < to && (number < 2 || to - begin + 1 < fewest_points); number++) {
      for (std::size_t i = from; i < to && entries.size() < most; i++) {
        const std::span<const Pair> around = pairs_[ring.number(i)];
        if (around.size() <= most_passed_on) add(around, entries);
      }
      entries.resize(std::min(entries.size(), most));
      from = to;
      to = entries.size();
    }
    // What a hub leads to is taken where there is nothing else.
    for (std::size_t i = begin; i < entries.size() && entries.size() - begin + 1 < fewest_points; i++) {
      const std::span<const Pair> around = pairs_[ring.number(i)];
      add(around.first(std::min(fewest_points, around.size())), entries);
      entries.resize(std::min(entries.size(), begin + fewest_points));
    }
  }

  // Appends the corners that were not met, without branches that depend on it.
  void add(std::span<const Pair> around, std::vector<uint32_t>& entries) {
    std::size_t size = entries.size();
    entries.resize(size + 2 * around.size());
    uint32_t* next = entries.data() + size;
    uint32_t open = 0;
    for (const Pair& pair : around) {
      *next = pair.from;
      next += met_.add(pair.from);
      open += pair.from - pair.to;
    }
    // About a vertex within the surface each neighbour is the first of one pair, and the second of another.
    if (open != 0) {
      for (const Pair& pair : around) {
        *next = pair.to;
        next += met_.add(pair.to);
      }
    }
    entries.resize(std::size_t(next - entries.data()));
  }

  const Mesh& mesh_;
  const Pairs& pairs_;
  static constexpr std::size_t marks = 4096, copied = std::size_t(most_copied) - 4;
  const Fans& fans_;
  Met met_;
  std::vector<uint32_t> marked_ = std::vector<uint32_t>(marks, ~0u);
  std::array<Ring, MESH_SLICE> rings_;
};

// Slices of a stretch of vertices, and where each begins among the words.
struct Slices {
  std::vector<uint32_t> words, starts;
};

Slices slices_of(const Mesh& mesh, const Pairs& pairs, const Fans& fans, std::size_t begin, std::size_t end, float unit,
                 Values<std::uint32_t>& places) {
  Slices result;
  result.words.reserve((end - begin) * 26);
  Rings finder(mesh, pairs, fans);
  const auto positions = mesh.vertices();
  for (std::size_t slice = begin; slice < end; slice += MESH_SLICE) {
    const std::span<const Ring> rings = finder.find(uint32_t(slice), std::min<std::size_t>(MESH_SLICE, end - slice));
    std::size_t width = 0;
    for (const Ring& ring : rings) width = std::max(width, ring.entries.size());
    const std::size_t start = result.words.size();
    result.starts.push_back(uint32_t(start));
    result.words.resize(start + header + MESH_SLICE * width);
    for (std::size_t lane = 0; lane < rings.size(); lane++) {
      const Ring& ring = rings[lane];
      const std::size_t v = slice + lane;
      for (int axis = 0; axis < 3; axis++)
        places[4 * v + std::size_t(axis)] = std::bit_cast<uint32_t>(unit * positions[v][axis]);
      places[4 * v + 3] = std::bit_cast<uint32_t>(float(ring.state));
      uint32_t* words = result.words.data() + start + lane;
      words[0] = uint32_t(ring.fan);
      words[MESH_SLICE] = uint32_t(ring.points);
      words[2 * MESH_SLICE] = uint32_t(ring.entries.size());
      words += header;
      for (std::size_t i = 0; i < ring.entries.size(); i++) words[MESH_SLICE * i] = ring.entries[i];
    }
  }
  return result;
}

}  // namespace

float mesh_unit(const Mesh& mesh) {
  float size = 0;
  for (int axis = 0; axis < 3; axis++)
    size = std::max({size, std::abs(mesh.lower()[axis]), std::abs(mesh.upper()[axis])});
  return std::ldexp(1.0f, std::clamp(-std::ilogb(size), -126, 126));
}

MeshVertices vertices_of(const Mesh& mesh, float unit) {
  const std::size_t count = mesh.vertex_count();
  require_room(std::max(3 * mesh.face_count(), MESH_VERTEX_WORDS * count), mesh);
  const Pairs pairs(mesh);
  const Fans fans(mesh, pairs);
  MeshVertices result;
  result.places.resize(4 * count);
  constexpr std::size_t step = slices_in_task * MESH_SLICE;
  std::vector<Slices> parts((count + step - 1) / step);
  parallel_for(parts.size(), [&](std::size_t task) {
    parts[task] = slices_of(mesh, pairs, fans, task * step, std::min((task + 1) * step, count), unit, result.places);
  });

  // The starts of all slices, then the slices.
  std::size_t words = (count + MESH_SLICE - 1) / MESH_SLICE;
  std::vector<std::size_t> begin;
  for (const Slices& part : parts) begin.push_back(words), words += part.words.size();
  require_room(words, mesh);
  result.rings.resize(words);
  for (std::size_t task = 0; task < parts.size(); task++) {
    const Slices& part = parts[task];
    for (std::size_t i = 0; i < part.starts.size(); i++)
      result.rings[task * slices_in_task + i] = uint32_t(begin[task] + part.starts[i]);
    std::memcpy(result.rings.data() + begin[task], part.words.data(), part.words.size() * sizeof(uint32_t));
  }
  return result;
}

}  // namespace smurf
