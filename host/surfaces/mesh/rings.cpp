#include "surfaces/mesh/rings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <climits>
#include <cmath>
#include <cstring>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "kernels/mesh/layout.inc"
#include "numerics/parallel.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using std::uint32_t;
using std::uint64_t;

constexpr std::size_t fewest_points = MESH_RING_FEWEST;  // a fit goes on beyond two rings until it has so many,
constexpr std::size_t most_points = MESH_RING_MOST - 1;  // and takes no more than these beyond the first ring
constexpr std::size_t most_passed_on = 32;     // a vertex with more neighbours is the hub of a fan: it leads no further
constexpr std::size_t vertices_in_task = 256;  // whole slices

// Vertices are sorted by how many entries their fans and rings have, between these bounds.
constexpr int least_fan = 5, fan_keys = 8;
constexpr int least_entries = 10, entry_keys = 32;

// Fewer are not worth a thread.
constexpr std::size_t faces_for_threads = 20'000;
constexpr std::size_t vertices_for_threads = 200'000;

void require_room(std::size_t words, const Mesh& mesh) {
  constexpr std::size_t most = (std::size_t(1) << 31) - 1;
  if (words > most)
    throw Error(
        ErrorCode::memory,
        fmt::format("normals of a mesh of {} vertices and {} triangles take tables of {} words; kernels can number {}",
                    mesh.vertex_count(), mesh.face_count(), words, most));
}

// A triangle at one of its corners.
struct Pair {
  uint32_t from, to;  // the other two corners, in order
};

// The corners of a mesh by vertex (mesh/layout.inc).
class Pairs {
 public:
  Pairs(std::span<const uint32_t> corners, std::size_t vertices)
      : first_(corners.data()),
        second_(first_ + vertices + 1),
        triangles_(first_ + MESH_CORNER_PARTS * (vertices + 1)) {}
  std::size_t size(uint32_t vertex) const { return in_first(vertex) + second_[vertex + 1] - second_[vertex]; }
  Pair at(uint32_t vertex, std::size_t i) const {
    const std::size_t here = in_first(vertex);
    const uint32_t* words = triangles_ + 2 * (i < here ? first_[vertex] + i : second_[vertex] + (i - here));
    return {words[0], words[1]};
  }
  std::vector<Pair> operator[](uint32_t vertex) const { return first(vertex, size(vertex)); }
  std::vector<Pair> first(uint32_t vertex, std::size_t count) const {
    std::vector<Pair> pairs(count);
    for (std::size_t i = 0; i < count; i++) pairs[i] = at(vertex, i);
    return pairs;
  }

 private:
  std::size_t in_first(uint32_t vertex) const { return first_[vertex + 1] - first_[vertex]; }

  const uint32_t* first_;
  const uint32_t* second_;
  const uint32_t* triangles_;
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

// Rings of vertices, one at a time.
class RingFinder {
 public:
  RingFinder(const Mesh& mesh, const Pairs& pairs) : mesh_(mesh), pairs_(pairs) {}

  // Valid until the next call.
  const Ring& find(uint32_t vertex) {
    set_fan(vertex, ring_);
    find_points(vertex, ring_);
    return ring_;
  }

 private:
  void set_fan(uint32_t vertex, Ring& ring) {
    const std::vector<Pair> around = pairs_[vertex];
    std::vector<uint32_t>& fan = ring.entries;
    fan.resize(around.size() + 1);
    FanKind kind = FanKind::irregular;
    if (!around.empty())
      kind = around.size() <= most_passed_on ? chain(around, fan.data()) : chain_many(around, fan.data());
    // An edge of more triangles is met again.
    if (kind != FanKind::irregular && is_repeated(std::span(fan).first(fan.size() - (kind == FanKind::closed ? 1 : 0))))
      kind = FanKind::irregular;
    if (kind == FanKind::irregular) return set_irregular(vertex, around, ring);
    fan[0] = ~fan[0];
    ring.state = kind == FanKind::open ? MESH_BOUNDARY : 0;
    ring.fan = fan.size();
    ring.points = kind == FanKind::closed ? 1 : 0;
  }

  static bool is_repeated(std::span<const uint32_t> numbers) {
    std::vector<uint32_t> sorted(numbers.begin(), numbers.end());
    std::ranges::sort(sorted);
    return std::ranges::adjacent_find(sorted) != sorted.end();
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
        if (pairs_.size(ring.number(i)) <= most_passed_on) add(pairs_[ring.number(i)], entries);
      }
      entries.resize(std::min(entries.size(), most));
      from = to;
      to = entries.size();
    }
    // What a hub leads to is taken where there is nothing else.
    for (std::size_t i = begin; i < entries.size() && entries.size() - begin + 1 < fewest_points; i++) {
      add(pairs_.first(ring.number(i), std::min(fewest_points, pairs_.size(ring.number(i)))), entries);
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
  Met met_;
  Ring ring_;
};

// What a task plans for a stretch of vertices.
struct Part {
  std::vector<uint32_t> rows;   // of each slice
  std::vector<uint32_t> rings;  // made here: head and entries
};

// Which vertex stands at which place: in the order of how far their fans and then their rings reach, so that lanes end
// together.
void sort_by_ring(std::span<const int> keys, std::span<uint32_t> order) {
  std::array<uint32_t, fan_keys * entry_keys + 1> begin{};
  for (const int key : keys) begin[std::size_t(key) + 1]++;
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  for (std::size_t i = 0; i < keys.size(); i++) order[begin[std::size_t(keys[i])]++] = uint32_t(i);
}

}  // namespace

float mesh_unit(const Mesh& mesh) {
  float size = 0;
  for (int axis = 0; axis < 3; axis++)
    size = std::max({size, std::abs(mesh.lower()[axis]), std::abs(mesh.upper()[axis])});
  return std::ldexp(1.0f, std::clamp(-std::ilogb(size), -126, 126));
}

MeshCorners corners_by_vertex(const Mesh& mesh, float unit) {
  const std::size_t count = mesh.vertex_count();
  const auto faces = mesh.faces();
  const auto positions = mesh.vertices();
  const std::size_t begins = MESH_CORNER_PARTS * (count + 1);
  const std::size_t words = begins + 6 * faces.size() + 2;
  require_room(std::max(words, MESH_VERTEX_WORDS * count), mesh);
  MeshCorners result = {Values<uint32_t>(words), Values<glm::vec4>(count)};
  uint32_t* const triangles = result.corners.data() + begins;
  Values<uint32_t> next_of_parts(MESH_CORNER_PARTS * count);
  // Threads that wrote to the same lines of memory would wait for each other, so each part has its own tables.
  const auto make_part = [&](std::size_t part) {
    const std::size_t begin = part * faces.size() / MESH_CORNER_PARTS,
                      end = (part + 1) * faces.size() / MESH_CORNER_PARTS;
    const auto own_faces = faces.subspan(begin, end - begin);
    uint32_t* const first = result.corners.data() + part * (count + 1);
    const auto next = std::span(next_of_parts).subspan(part * count, count);
    std::ranges::fill(next, 0);
    for (const glm::uvec3& face : own_faces) next[face.x]++, next[face.y]++, next[face.z]++;
    uint32_t sum = uint32_t(3 * begin);
    for (std::size_t v = 0; v < count; v++) {
      first[v] = sum;
      sum += next[v];
      next[v] = first[v];
    }
    first[count] = sum;
    // Written in turn first: a core gets lines that others have read much faster so than line by line from anywhere.
    std::fill(triangles + 6 * begin, triangles + 6 * end, 0);
    for (const glm::uvec3& face : own_faces) {
      const auto put = [&](uint32_t corner, uint32_t from, uint32_t to) {
        uint32_t* const words = triangles + 2 * std::size_t(next[corner]++);
        words[0] = from;
        words[1] = to;
      };
      put(face.x, face.y, face.z);
      put(face.y, face.z, face.x);
      put(face.z, face.x, face.y);
    }
  };
  // The places last: the thread that began first is done first.
  constexpr std::size_t tasks = MESH_CORNER_PARTS + 1;
  const auto make = [&](std::size_t task) {
    if (task < MESH_CORNER_PARTS) return make_part(task);
    for (std::size_t v = 0; v < count; v++) result.places[v] = glm::vec4(unit * positions[v], 0.0f);
  };
  if (faces.size() < faces_for_threads) {
    for (std::size_t task = 0; task < tasks; task++) make(task);
  } else {
    parallel_for(tasks, make);
  }
  return result;
}

MeshRings plan_rings(const Mesh& mesh, MeshCorners& corners, std::span<const uint32_t> ring_sizes) {
  const std::size_t count = mesh.vertex_count(), slices = (count + MESH_SLICE - 1) / MESH_SLICE;
  const Pairs pairs(corners.corners, count);
  MeshRings result;
  result.plan.resize(slices + 1 + count);
  const auto order = std::span(result.plan).subspan(slices + 1, count);
  std::vector<Part> parts((count + vertices_in_task - 1) / vertices_in_task);
  const auto plan_part = [&](std::size_t task) {
    Part& part = parts[task];
    std::optional<RingFinder> finder;
    const std::size_t first = task * vertices_in_task, number = std::min(vertices_in_task, count - first);
    std::array<uint32_t, vertices_in_task> words;  // of the plan
    std::array<int, vertices_in_task> fans, entries;
    int least = INT_MAX;
    for (std::size_t i = 0; i < number; i++) {
      words[i] = uint32_t(first + i);
      fans[i] = int(ring_sizes[first + i] % MESH_RING_ENTRIES);
      entries[i] = int(ring_sizes[first + i] / MESH_RING_ENTRIES);
      least = std::min(least, entries[i]);
    }
    for (std::size_t i = 0; least == 0 && i < number; i++) {
      if (entries[i] != 0) continue;
      if (!finder) finder.emplace(mesh, pairs);
      const uint32_t vertex = words[i];
      const Ring& ring = finder->find(vertex);
      corners.places[vertex].w = float(ring.state);
      fans[i] = int(ring.fan);
      entries[i] = int(ring.entries.size());
      words[i] = ~uint32_t(part.rings.size());
      part.rings.insert(part.rings.end(),
                        {uint32_t(ring.fan), uint32_t(ring.points), uint32_t(ring.entries.size()), vertex});
      for (const uint32_t entry : ring.entries) part.rings.push_back(4 * std::min(entry, ~entry) + (entry > ~entry));
    }
    std::array<int, vertices_in_task> keys;
    for (std::size_t i = 0; i < number; i++)
      keys[i] = (std::clamp(fans[i], least_fan, least_fan + fan_keys - 1) - least_fan) * entry_keys +
                (std::clamp(entries[i], least_entries, least_entries + entry_keys - 1) - least_entries);
    std::array<uint32_t, vertices_in_task> sorted;
    sort_by_ring(std::span(keys).first(number), sorted);
    for (std::size_t begin = 0; begin < number; begin += MESH_SLICE) {
      int most = 0;
      for (std::size_t i = begin; i < std::min(begin + MESH_SLICE, number); i++) {
        order[first + i] = words[sorted[i]];
        most = std::max(most, entries[sorted[i]]);
      }
      part.rows.push_back(uint32_t(MESH_RING_HEAD + most));
    }
  };
  if (count < vertices_for_threads && std::ranges::count(ring_sizes, 0u) < std::ptrdiff_t(vertices_in_task)) {
    for (std::size_t task = 0; task < parts.size(); task++) plan_part(task);
  } else {
    parallel_for(parts.size(), plan_part);
  }

  std::size_t slice = 0, begin = slices, next = result.plan.size();
  for (std::size_t task = 0; task < parts.size(); task++) {
    const Part& part = parts[task];
    for (const uint32_t rows : part.rows) {
      result.plan[slice++] = uint32_t(begin);
      begin += MESH_SLICE * std::size_t(rows);
      require_room(begin, mesh);
    }
    if (part.rings.empty()) continue;
    require_room(next + part.rings.size(), mesh);
    const std::size_t first = task * vertices_in_task;
    for (uint32_t& word : order.subspan(first, std::min(vertices_in_task, count - first))) {
      if (word > ~word) word -= uint32_t(next);
    }
    next += part.rings.size();
  }
  result.plan[slices] = uint32_t(begin);
  result.ring_words = begin;
  const std::size_t first_ring = result.plan.size();
  if (next > first_ring) {
    result.plan.resize(next);
    uint32_t* to = result.plan.data() + first_ring;
    for (const Part& part : parts) to = std::ranges::copy(part.rings, to).out;
  }
  return result;
}

}  // namespace smurf
