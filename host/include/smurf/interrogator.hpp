// Interrogation: a surface made resident on a device, asked in batches.
//
//   auto device = smurf::open_device("opencl");
//   auto query  = smurf::Interrogator(device, smurf::isosurface(volume, 0.5));
//   auto hits   = query.cast(rays, {.hits = smurf::Hits::all});
//   auto kappa  = hits.principal_curvatures();   // evaluated on the device now, kept for later
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "smurf/coordinates.hpp"
#include "smurf/device.hpp"
#include "smurf/rays.hpp"
#include "smurf/surface.hpp"
#include "smurf/values.hpp"
#include "smurf/walk.hpp"

namespace smurf {

// Per hit. `isolated`: proved to be exactly one root. `tangent`: the field stays within rounding of the surface over
// the whole enclosure, which may hold no root, one, or several. `unresolved`: the enclosure could not be decided (for
// instance a ray that starts on the surface). Surfaces given by expressions, and surfaces s(u, v): hits that floats
// leave open are decided in double precision, so that rounding is that of doubles; double roots stay, and enclosures
// hold the roots of the expression with its constants in double. A ray that lies in a surface s(u, v) over a stretch
// has one `unresolved` hit for it, but none on a flat patch. `bracketed` (black boxes, which are known by their values
// alone): the computed values at the ends of the enclosure have opposite signs, or one is 0; a continuous function has
// a root there. Nothing is proved: other roots between samples may have been missed. `sampled` (stream surfaces): a
// root that was found where the flow stretches more than bounds can follow; that there is no other next to it is not
// proved. By the back-stream method hits are `bracketed` where one cell of its table is sure of a change of sign, else
// `sampled`; other roots may have been missed.
enum class HitStatus : std::uint32_t { isolated = 1, tangent = 2, unresolved = 3, bracketed = 4, sampled = 5 };
std::string_view name_of(HitStatus status);

// Per ray. `invalid`: not finite, a zero direction, or t_min > t_max; on meshes and surfaces s(u, v), by devices, also
// 5·10¹¹ times as far out as the surface.
enum class RayStatus : std::uint32_t { ok = 0, invalid = 1 };

// Per point, as bits. `umbilic`: the principal curvatures agree to rounding, directions are arbitrary.
// `boundary`: the point was clamped to the border of the surface (walking), or its curvature comes from one side of it
// only (a triangle at the border of a mesh). `undefined`: no gradient, outside of the domain, or within reach of
// samples that are not finite; the values asked for are NaN. `crease`: a min, max or abs of the surface's expression
// turns from one argument to the other within rounding of the point, and the gradient with it; normal and curvature are
// those of one side. `singular`: x_u and x_v span no plane there (a pole, a collapsed edge of a patch); normal and
// curvature are the limit where there is one, else the point is `undefined`, too.
enum PointStatus : std::uint32_t { regular = 0, umbilic = 1, boundary = 2, undefined = 4, crease = 8, singular = 16 };

// Properties of surface points, as bits.
enum class Property : std::uint32_t {
  value = 1,              // the field's value (kinds with a field)
  normal = 2,             // unit normal
  gauss = 4,              // k1·k2, per unit length squared
  mean = 8,               // (k1+k2)/2, per unit length
  principal = 16,         // k1 >= k2
  directions = 32,        // unit principal directions d1, d2
  normal_curvature = 64,  // along a given direction, projected to the tangent plane
  parameters = 128,       // surface coordinates (kinds that have them)
  location = 256,         // the surface point itself (kinds that have coordinates): of a probe the nearest one
  distance = 512,         // of a probe's points to the surface
  inside = 1024,          // of a probe's points: 1 inside, 0 outside (level sets, closed meshes)
};
constexpr std::uint32_t operator|(Property a, Property b) { return std::uint32_t(a) | std::uint32_t(b); }
constexpr std::uint32_t operator|(std::uint32_t a, Property b) { return a | std::uint32_t(b); }
constexpr bool contains(std::uint32_t set, Property p) { return (set & std::uint32_t(p)) != 0; }

// What a cast tells of each ray. `any`: whether it has a hit, whichever is found; `count`: how many it has: both keep no
// rows, and answer by HitList::counts() and flagged().
enum class Hits { first, all, any, count };
enum class BadRays { flag, error };  // flag: the ray has no hits and RayStatus::invalid; error: the call throws

struct CastOptions {
  Hits hits = Hits::first;
  BadRays bad_rays = BadRays::flag;
  std::uint32_t properties = 0;  // evaluated along with the hits; others follow on demand
  std::size_t tile = 0;          // rays on the device at a time; 0 lets the device decide. Results do not depend on it.
  std::function<void(std::size_t done, std::size_t total)> progress = {};  // called after each tile
};

// What was measured at a list of points. Columns that were not asked for are empty.
struct PointProperties {
  Column<float> value, gauss, mean, k1, k2, normal_curvature;
  // Of a probe. `distance`: never negative, and not finite where there is no surface; right to 2^-20 of the greatest
  // coordinate. Meshes, surfaces s(u, v) and stream surfaces: to the nearest point of what rays meet. Level sets: to the
  // nearest point that a search from samples of the surface finds, 96 lines each way across the domain; parts of the
  // surface that none of these lines meets may be missed, so that it is a bound from above. On trilinear grids and at
  // borders, where the search settles by short steps, to about 1e-4 of a 96th of the domain more. `inside`: 1 or 0, not
  // a number where it is not known. Isosurfaces: 1 on the denser side, f > level; implicit surfaces: f < level; closed
  // meshes: where a ray out of the point crosses the mesh an odd number of times.
  Column<float> distance, inside;
  Column<glm::vec3> normal, d1, d2, location;
  Column<SurfaceCoordinates> coordinates;
  Column<std::uint32_t> status;  // PointStatus bits
  std::uint32_t measured = 0;    // Property bits
};

class SurfaceQueries;  // internal: a surface on one device
class SpaceQueries;    // internal: distance and inside

// Per ray the sorted hits, as compressed rows: the hits of ray i are offsets()[i] .. offsets()[i+1]-1.
// Properties are evaluated on the device when first asked for and kept.
// Of Hits::any and Hits::count there are no rows and no offsets, but counts.
class HitList {
 public:
  std::size_t ray_count() const { return ray_status_.size(); }
  std::size_t size() const { return t_.size(); }
  std::span<const std::uint64_t> offsets() const { return offsets_; }
  std::span<const std::uint32_t> rays() const { return rays_; }  // per hit, the index of its ray
  std::span<const float> t() const { return t_; }
  std::span<const HitStatus> status() const { return status_; }
  // Half the width of the enclosure in t: the root, or all roots of a cluster, lie in t ± uncertainty.
  std::span<const float> uncertainty() const { return uncertainty_; }
  std::span<const RayStatus> ray_status() const { return ray_status_; }
  // Per ray. Hits::count: the number of hits, the same as Hits::all has rows. Hits::any: 1 where there is a hit, else 0.
  // Invalid rays have 0. None for other casts.
  std::span<const std::uint32_t> counts() const { return counts_; }
  // How many of those counted are `tangent` or `unresolved`, after all that was done to resolve them. Hits::any: 1 where
  // the ray has such hits only, so that it is not known to have one.
  std::span<const std::uint32_t> flagged() const { return flagged_; }
  std::span<const glm::vec3> locations() const { return locations_; }
  // One per hit; none for kinds without surface coordinates.
  std::span<const SurfaceCoordinates> coordinates() const { return coordinates_; }

  std::span<const glm::vec3> normals() const;
  std::span<const float> gauss_curvatures() const;
  std::span<const float> mean_curvatures() const;
  std::span<const glm::vec2> principal_curvatures() const;  // k1 >= k2
  std::span<const glm::vec3> first_principal_directions() const;
  std::span<const glm::vec3> second_principal_directions() const;
  Column<float> normal_curvatures(std::span<const glm::vec3> directions) const;  // one direction per hit
  std::span<const std::uint32_t> point_status() const;                           // PointStatus bits
  const PointProperties& properties(std::uint32_t wanted) const;                 // several at once

  // From each hit in its direction, over a distance for all (smurf/walk.hpp). Throws Error (usage) where the number of
  // directions is not that of hits, and for distances that are not positive.
  Neighbors neighbors(std::span<const glm::vec3> directions, float distance, const WalkOptions& options = {}) const;

 private:
  friend class Interrogator;
  friend struct HitColumns;  // internal: host/surfaces/hit_columns.hpp
  std::shared_ptr<SurfaceQueries> queries_;
  float diagonal_ = 0;  // of the surface's bounds
  Values<std::uint64_t> offsets_;
  Values<RayStatus> ray_status_;
  Values<std::uint32_t> counts_, flagged_;
#define HIT_COLUMN(name, type, names, place) Values<type> name##_;
#include "smurf/hit_columns.def"
  mutable PointProperties properties_;
  mutable Values<glm::vec2> principal_;
};

struct ProbeOptions {
  std::size_t tile = 0;
  std::span<const glm::vec3> directions = {};  // for normal_curvature, one per point
  std::function<void(std::size_t done, std::size_t total)> progress = {};
};

struct PrepareOptions {
  // Called while the surface is made ready, where that takes long: while the hierarchy of a mesh is built. Calls come
  // one at a time, but from any thread. What it throws ends the work and leaves the Interrogator's constructor.
  std::function<void(std::size_t done, std::size_t total)> progress = {};
};

class Interrogator {
 public:
  // Uploads the surface and compiles its kernels. Throws Error (memory) that says how much was needed.
  Interrogator(const Device& device, const Surface& surface, const PrepareOptions& options = {});

  HitList cast(const RayBatch& rays, const CastOptions& options = {}) const;

  // Properties of the level set through each point; on kinds that are no level sets those of the surface's nearest
  // point. Throws Error (usage) where `inside` is asked of what encloses nothing: open meshes, surfaces s(u, v), stream
  // surfaces.
  PointProperties probe(std::span<const glm::vec3> points, std::uint32_t properties,
                        const ProbeOptions& options = {}) const;

  // Properties at places given by surface coordinates, of kinds that have them: of a mesh the face and barycentric
  // coordinates, of a surface s(u, v) the patch and its parameters. Places beyond the range of u or v are
  // `undefined`. Throws Error (usage) for kinds without coordinates, and where there is no such part.
  PointProperties properties_at(std::span<const SurfaceCoordinates> places, std::uint32_t properties,
                                const ProbeOptions& options = {}) const;

  // From each point in its direction, over one distance for all, or one for each point (smurf/walk.hpp). Throws Error
  // (usage) where numbers of points, directions and distances do not go together, for a distance for all that is not
  // positive, and for kinds that the device cannot walk on.
  Neighbors neighbors(std::span<const glm::vec3> points, std::span<const glm::vec3> directions,
                      std::span<const float> distances, const WalkOptions& options = {}) const;
  Neighbors neighbors(std::span<const glm::vec3> points, std::span<const glm::vec3> directions, float distance,
                      const WalkOptions& options = {}) const;

  // As many steps from each point, each over the same distance, with the direction carried along. The same errors;
  // there must be a step at least.
  Paths walk(std::span<const glm::vec3> points, std::span<const glm::vec3> directions, float distance,
             std::uint32_t steps, const WalkOptions& options = {}) const;

  // Another surface over the same field: only what depends on the isovalue is rebuilt. Hit lists made
  // before keep answering for the surface that they were cast on only as to what they already hold.
  void update(const Surface& surface);

  // Bytes that the surface takes on the device, rays and results not counted.
  std::size_t device_bytes() const;

 private:
  std::shared_ptr<SurfaceQueries> queries_;
  std::shared_ptr<SpaceQueries> space_;
  std::size_t parts_ = 0;  // of kinds with surface coordinates
  float diagonal_ = 0;     // of the surface's bounds
};

// Properties at all vertices of a mesh, one after the other, made anew by each call: normals weighted by the triangles'
// angles, and curvature in their planes, as hits with MeshNormals::interpolated have them. The mesh alone is needed, no
// surface that rays can be cast on.
// `properties`: normal, gauss, mean, principal and directions. Vertices of no triangle, and where normals cancel, have
// no normal and the status `undefined`; non-manifold ones and those with too few neighbours have no curvature.
// Throws Error (memory) that says how much was needed.
PointProperties vertex_properties(const Device& device, const Mesh& mesh, std::uint32_t properties);

}  // namespace smurf
