// The workloads whose throughput is measured, by `smurf bench` and by bench/: defined once.
//
// A workload is a surface, what is asked of it, and the sizes at which it is asked: image widths for rays (as many rays
// where they are no image), numbers of points for probes. Cost must grow with the size; two sizes each make that
// visible.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "smurf/camera.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/mesh.hpp"
#include "smurf/surface.hpp"

namespace smurf::workloads {

enum class Kind { first_hit, all_hits, probe };

struct Workload {
  std::string name;  // "W1-first"
  std::string text;  // one line
  Kind kind = Kind::first_hit;
  std::uint32_t properties = 0;  // evaluated along with the hits
  std::vector<int> sizes;        // ascending; square images' widths, or numbers of points
  double isovalue = 0;
  Reconstruction reconstruction = Reconstruction::trilinear;
  // One of these: samples, a mesh or patches, read or computed at the first call and shared with other workloads; or
  std::function<Volume()> volume;
  std::function<Mesh()> mesh;
  std::function<std::vector<Patch>()> patches;
  std::string equation;  // of an implicit surface, and where it is looked at
  Domain domain;
  std::array<std::string, 3> position{};  // of a surface s(u, v), and its ranges of u and v
  glm::dvec2 u{0.0}, v{0.0};
  std::function<RayBatch(const Bounds&, int width)> rays;

  bool casts() const { return kind != Kind::probe; }
  std::string_view unit() const { return casts() ? "Mrays/s" : "Mprobes/s"; }
  std::size_t count(int size) const { return casts() ? std::size_t(size) * std::size_t(size) : std::size_t(size); }
  CastOptions cast_options() const;
  Surface surface() const;
  bool samples() const { return bool(volume); }
  bool parametric() const { return patches || !position[0].empty(); }
  // In what errors are told: of places the grid's shortest step, or for others a pixel of 1024 across the surface's
  // box; of values their range.
  double length_unit() const;
  double value_unit() const;
};

// What cannot be measured here, and why.
struct Missing {
  std::string name, reason;
};

struct Catalogue {
  std::vector<Workload> workloads;
  std::vector<Missing> missing;
};

// Those whose name contains `filter` (case ignored). Data are looked for in $SMURF_DATA, then in the folder shared/data
// beside the sources; the bundled headsq in the sources; the bunny where $SMURF_BUNNY says.
Catalogue catalogue(std::string_view filter = {});

// bunny00.off (Debian package libcgal-demo), which $SMURF_BUNNY names; else a bumpy sphere of about as many triangles,
// with which nothing measured on the bunny can be compared, and why. It is read or computed at the first call.
struct BunnyOrSphere {
  std::function<Mesh()> mesh;
  bool is_bunny = false;
  std::string why_not;
};
BunnyOrSphere bunny_or_sphere();
// The sphere with waves of a tenth of its radius, closed, of about so many triangles.
Mesh bumpy_sphere(std::size_t triangles);

// The teapot of 32 bicubic patches, where the development data is at hand; else a ring of 32 such patches, with which
// nothing measured on the teapot can be compared, and why.
struct TeapotOrRing {
  std::function<std::vector<Patch>()> patches;
  bool is_teapot = false;
  std::string why_not;
};
TeapotOrRing teapot_or_ring();
// Eight patches around and four across, closed and nearly a torus.
std::vector<Patch> bicubic_ring();

// Random chords of the sphere around a box, width² of them: origin and origin + direction are uniform on the sphere and
// t runs on behind. No two neighbours go together.
RayBatch random_chords(const Bounds& bounds, int width);

RayBatch rays_of(const Workload& workload, const Surface& surface, int width);
// Uniform over the surface's domain, the same for every device and run.
std::vector<glm::vec3> points_of(const Surface& surface, int count);

// Integers below `bound` from a fixed seed, the same on every platform.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits();
  std::size_t below(std::size_t bound) { return std::size_t(bits() % bound); }
  double unit() { return double(bits() >> 11) * 0x1p-53; }

 private:
  std::uint64_t state_;
};

}  // namespace smurf::workloads
