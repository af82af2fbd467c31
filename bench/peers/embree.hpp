// Embree as a peer: a triangle mesh traced on all hardware threads, rays and hits in host memory.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "peers/isosurface_mesh.hpp"
#include "smurf/rays.hpp"

namespace smurf::bench {

// Per ray t (infinity without a hit) and the geometric normal, not normalised.
struct ClosestHits {
  std::vector<float> t;
  std::vector<glm::vec3> normals;
};

// Per ray its sorted hits as compressed rows.
struct AllHits {
  std::vector<std::uint64_t> offsets;
  std::vector<float> t;
  std::vector<glm::vec3> normals;
};

// Grids of quadrilaterals, `width` by `width` vertices each, row by row, one grid after the other.
struct GridMesh {
  std::vector<glm::vec3> vertices;
  std::size_t grids = 0;
  unsigned width = 0;
};

class EmbreeScene {
 public:
  explicit EmbreeScene(const TriangleMesh& mesh, bool robust = false);
  explicit EmbreeScene(const GridMesh& mesh);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  void closest_single(const RayBatch& rays, ClosestHits& hits) const;
  // Packets of 16 rays: tiles of 4×4 pixels where the batch is an image, else 16 rays in a row.
  void closest_packets(const RayBatch& rays, ClosestHits& hits) const;
  // Every hit, collected by a filter function that lets the traversal go on, then sorted.
  void all(const RayBatch& rays, AllHits& hits) const;

 private:
  void begin(bool robust, bool grids);
  // `count` triangles or grids of so many bytes each.
  void fill(const std::vector<glm::vec3>& vertices, const void* faces, std::size_t count, std::size_t bytes,
            bool grids);

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace smurf::bench
