// Surfaces: immutable host descriptions that know nothing of devices.
#pragma once

#include <array>
#include <filesystem>
#include <glm/glm.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "smurf/mesh.hpp"
#include "smurf/patch.hpp"
#include "smurf/volume.hpp"

namespace smurf {

class SurfaceDefinition;  // internal: one class per kind, see host/surfaces/surface_definition.hpp

// How a continuous field is made from samples.
//   trilinear    interpolates; derivatives are central differences over one cell (one-sided at the boundary nodes),
//                interpolated
//   tricubic     interpolating cubic B-spline (prefiltered, Unser 1999), C², with its own derivatives
//   catmull_rom  interpolating cubic convolution, C¹, with its own derivatives
// Cubic reconstructions continue the data beyond the boundary mirrored about the outer nodes.
enum class Reconstruction { trilinear, tricubic, catmull_rom };

std::string_view name_of(Reconstruction reconstruction);     // as in descriptions: "catmull-rom"
Reconstruction reconstruction_named(std::string_view name);  // throws Error (input)

struct GridOptions {
  Reconstruction reconstruction = Reconstruction::tricubic;
};

struct Bounds {
  glm::dvec3 lower{0.0};
  glm::dvec3 upper{0.0};
};

// Copies share the description.
class Surface {
 public:
  explicit Surface(std::shared_ptr<const SurfaceDefinition> model) : model_(std::move(model)) {}
  std::string_view kind() const;
  Bounds bounds() const;  // of the domain, in world coordinates
  const SurfaceDefinition& model() const { return *model_; }
  const std::shared_ptr<const SurfaceDefinition>& share() const { return model_; }

 private:
  std::shared_ptr<const SurfaceDefinition> model_;
};

// The surface f = isovalue of a sampled field. Normals point to smaller values: n = -∇f/|∇f|.
// Throws Error (input) when the isovalue is not finite.
Surface isosurface(const Volume& volume, double isovalue, const GridOptions& options = {});

// Where an expression is looked at: a box, and with a radius only what lies of it within that distance of the origin.
struct Domain {
  glm::dvec3 lower{0.0}, upper{0.0};
  double radius = 0;

  bool operator==(const Domain&) const = default;
};

using Parameters = std::map<std::string, double>;  // named constants of an expression

// The surface f = 0 of an equation in x, y, z: + - * / ^, numbers, pi, e, sin cos tan asin acos atan atan2 sinh cosh
// tanh exp log sqrt abs min max floor mod pow. Normals point to greater values: n = ∇f/|∇f|. Every root on a ray is
// found or enclosed, with proof, by Taylor models and interval arithmetic in float; where the function is undefined
// there is no surface. Throws Error (input) that says where the text is wrong.
Surface implicit(std::string_view equation, const Domain& domain, const Parameters& parameters = {});

// The surface f = isovalue of an expression. Normals point to smaller values: n = -∇f/|∇f|.
Surface isosurface(std::string_view expression, double isovalue, const Domain& domain,
                   const Parameters& parameters = {});

// An equation from a file: .jsurf (algebraic surfaces; the domain is a ball of radius 5 unless given) or .vm (tapes of
// operations; the domain is [-1, 1]³ unless given).
Surface load_implicit(const std::filesystem::path& file, const std::optional<Domain>& domain = std::nullopt);

// Which normal, and so which tangent plane, a mesh has at a point: that of the triangle, or one that runs smoothly
// between normals of the vertices (Phong 1975).
enum class MeshNormals { face, interpolated };

// A polygon mesh. Normals point to where corners run counter-clockwise. A ray crosses an edge or a vertex that
// triangles share once where the surface passes from one side of it to the other, and twice or not at all at a
// silhouette; a triangle that lies along a ray is not hit.
// With `spatial_splits` the hierarchy over the triangles may keep one in several leaves, for as much of it as lies
// there (Stich, Friedrich, Dietrich 2009). Hits are the same; rays meet fewer triangles that are long, thin and aslant
// (of 20,000 such strips a third of the time was left), building takes 20 to 80 times as long, there are up to four
// times as many leaves, and rays of hundreds of hits take longer.
Surface mesh_surface(const Mesh& mesh, MeshNormals normals = MeshNormals::face, bool spatial_splits = false);

// The surface of the points position(u, v): three expressions in u and v, in the words of implicit(), for u and v in
// [u.x, u.y] and [v.x, v.y]. Normals point along x_u × x_v. `closed` says of u and of v that the surface goes on at the
// other end of the range; where both ends agree within 1e-6 of the extent it is closed without that. A seam is one line
// of the surface, a side that is collapsed to a pole one point. Where an expression is undefined there is no surface.
// Hits are counted by parameter: a place that the surface passes twice gives two.
// Throws Error (input), one line that says which of them is wrong and how: a text that is no expression, a range that
// is reversed, empty or not finite, positions that are undefined in all of the range or go to infinity in it, and what
// is a curve or a point.
Surface parametric(const std::array<std::string, 3>& position, const glm::dvec2& u, const glm::dvec2& v,
                   const Parameters& parameters = {}, const std::array<bool, 2>& closed = {});

// Bézier, B-spline and NURBS patches, one or more (smurf/patch.hpp). Normals point along x_u × x_v. SurfaceCoordinates
// are the number of the patch, and u and v in the units of its knots. Sides of patches that lie within 1e-6 of the
// extent of each other are one edge, which a ray crosses once. Throws Error (input) that names the patch, when one is
// not valid, goes to infinity, or is a curve or a point.
Surface nurbs(std::vector<Patch> patches);

// Patches from a file: .bpt (the teapot's format), .bez (Geomview's BBP and BEZ), or .json: {"patches": [{"degree",
// "size", "knots", "points", "weights"}]}, where weights are optional and points Euclidean, or with "homogeneous": true
// points of four numbers (wx, wy, wz, w). Throws Error (input) that names the file, the line or patch, and what is
// wrong.
Surface load_nurbs(const std::filesystem::path& file);

// What samples keep of a surface that is given by an expression: isosurface(volume, isovalue) stands where that surface
// stands, as nearly as its reconstruction allows, and its normals point to the same side.
struct SampledField {
  Volume volume;  // float; not finite at nodes where the expression is undefined
  double isovalue =
      0;          // field and isovalue are negated where the surface's own normals point to greater values (implicit)
  Domain domain;  // where the surface is looked at
};

// Evaluates in double, and rounds to float, at `size` nodes over the box of the domain; `apron` more nodes beyond each
// of its faces keep the border of the volume, where the data is continued by mirroring, away from it. Throws Error
// (input) when the surface is not given by an expression, when there are fewer than two nodes along an axis, and when
// the domain has no extent.
SampledField sample_field(const Surface& surface, const glm::ivec3& size, int apron = 0);

// Reads a surface description (JSON); file names in it are relative to the description. A file of data may stand in
// place of a description: .off, .obj, .ply, .stl (meshes), .bpt, .bez, and JSON with "patches".
// Throws Error (input) that names the file and the member that is wrong.
Surface load_surface(const std::filesystem::path& description);

}  // namespace smurf
