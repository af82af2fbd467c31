// Meshes: triangles over shared vertices.
//
// Coordinates are floats; what a file states more precisely is rounded to the nearest float. Polygons of more than
// three corners are split into triangles. Triangles without area are no surface: they are dropped, and counted. A mesh
// is oriented by its faces: the normal of triangle (a, b, c) is that of (b-a) x (c-a), so that corners run
// counter-clockwise when seen from where it points to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string_view>

namespace smurf {

struct MeshOptions {
  // Joins vertices whose coordinates are equal (0 and -0 are). Files without connectivity (STL) are always welded.
  bool weld = false;
};

// What was done to the faces and vertices as given; nothing is changed that is not counted here.
struct MeshRepairs {
  std::uint64_t polygons_split = 0;         // faces of more than three corners; n corners give n-2 triangles
  std::uint64_t small_faces = 0;            // faces of less than three corners, dropped
  std::uint64_t repeated_corners = 0;       // triangles that name a vertex twice (after welding), dropped
  std::uint64_t zero_area = 0;              // triangles of three vertices that lie exactly on one line, dropped
  std::uint64_t welded_vertices = 0;        // vertices that were joined to an earlier one
  std::uint64_t unreferenced_vertices = 0;  // vertices that no triangle uses; they are kept, and belong to no surface
  std::uint64_t ignored_elements = 0;       // of a file: lines, points, curves and others that are no polygons
  friend bool operator==(const MeshRepairs&, const MeshRepairs&) = default;
};

// Of a whole mesh. `mixed`: some edges are inconsistently oriented. `open`: consistent, but not closed. Otherwise by
// the sign of the enclosed volume, to which cavities count as negative; `flat` when it is zero to rounding.
enum class MeshOrientation : std::uint32_t { outward, inward, flat, open, mixed };
std::string_view name_of(MeshOrientation orientation);

// Of a vertex, as bits. `boundary`: on an edge of a single triangle. `non_manifold`: on an edge of more than two
// triangles, or its triangles form more than one fan.
enum VertexState : std::uint8_t {
  vertex_regular = 0,
  vertex_boundary = 1,
  vertex_non_manifold = 2,
  vertex_unreferenced = 4
};

struct MeshTopology {
  std::uint64_t vertices = 0;  // those that triangles use
  std::uint64_t edges = 0;
  std::uint64_t faces = 0;                  // triangles
  std::uint64_t boundary_edges = 0;         // of one triangle
  std::uint64_t non_manifold_edges = 0;     // of more than two
  std::uint64_t inconsistent_edges = 0;     // whose triangles do not run through it to and fro in turn
  std::uint64_t non_manifold_vertices = 0;  // VertexState
  std::uint64_t components = 0;             // connected by shared vertices
  std::int64_t euler_characteristic = 0;    // vertices - edges + faces
  bool closed =
      false;  // every edge has an even number of triangles: every line crosses the mesh an even number of times
  bool manifold = false;  // no edge and no vertex is non-manifold; there may be a boundary
  MeshOrientation orientation = MeshOrientation::open;
  double area = 0;
  double volume = 0;  // signed, of a closed mesh; 0 of others
};

// Immutable; copies share the arrays. Takes 12 bytes a vertex and 16 a triangle; its topology, found when first asked
// for in O(n log n), 1 byte a vertex more, and while it is being found 36 bytes a triangle and 8 a vertex.
class Mesh {
 public:
  std::size_t vertex_count() const { return vertices().size(); }
  std::size_t face_count() const { return faces().size(); }
  std::span<const glm::vec3> vertices() const;
  std::span<const glm::uvec3> faces() const;  // triangles, as indices of vertices
  // Per triangle the number of the face that it was made of, as given: in the file's order, counting those that were
  // dropped.
  std::span<const std::uint32_t> source_faces() const;
  std::uint64_t source_face_count() const;
  const MeshRepairs& repairs() const;
  std::size_t bytes() const;

  // The box around all triangles.
  glm::vec3 lower() const;
  glm::vec3 upper() const;

  const MeshTopology& topology() const;
  std::span<const std::uint8_t> vertex_states() const;  // VertexState bits

 private:
  friend class MeshBuilder;
  struct Data;
  explicit Mesh(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  std::shared_ptr<const Data> data_;
};

// From arrays, which are copied. Throws Error (input) on a coordinate that is not finite, on an index without a vertex,
// and when no triangle with area is left.
Mesh make_mesh(std::span<const glm::vec3> vertices, std::span<const glm::uvec3> faces, const MeshOptions& options = {});

// From polygons: face i has sizes[i] corners, which follow each other in `corners`. Polygons should be nearly flat and
// must not have more than 16384 corners; concave ones are split along diagonals inside.
Mesh make_mesh(std::span<const glm::vec3> vertices, std::span<const std::uint32_t> corners,
               std::span<const std::uint32_t> sizes, const MeshOptions& options = {});

// From a file: OFF, OBJ, PLY (text and binary) and STL (text and binary) with the file's own vertices and faces, all
// groups and objects; normals, texture coordinates and colours are not read. STL, which has no connectivity, is always
// welded. Other formats as far as the library assimp reads them, placed by the nodes of their scene, and always welded,
// because assimp takes vertices apart.
// Throws Error (input) that names the file, and for text the line: missing, no mesh, truncated, longer than it says,
// indices without a vertex, and what make_mesh does not take.
Mesh load_mesh(const std::filesystem::path& file, const MeshOptions& options = {});

}  // namespace smurf
