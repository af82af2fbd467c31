// Stream surfaces: what a flow makes of a seed curve, x(u, τ) = φ_τ(c(u)), where φ is the flow of a vector field.
//
//   auto field   = smurf::expression_flow({"-y", "x", "0.3"}, {.lower = glm::dvec3(-3), .upper = glm::dvec3(3)});
//   auto surface = smurf::stream_surface(field, smurf::seed_expression({"u", "0", "0"}, {0.2, 1.2}), {.time = {0, 6}});
//   auto hits    = smurf::Interrogator(smurf::open_device("opencl"), surface).cast(rays);
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "smurf/flow.hpp"
#include "smurf/surface.hpp"

namespace smurf {

class SeedCurve;  // internal: host/flows/seeds/seed_curve.hpp

// A seed curve c(u). Copies share it.
class SeedLine {
 public:
  explicit SeedLine(std::shared_ptr<const SeedCurve> curve) : curve_(std::move(curve)) {}
  const std::shared_ptr<const SeedCurve>& share() const { return curve_; }

 private:
  std::shared_ptr<const SeedCurve> curve_;
};

// u = 0, 1, 2, ... at the points; a polyline, or with `spline` the natural cubic spline through them. Throws Error
// (input) on fewer than two points, points that are not finite, and neighbours that are equal.
SeedLine seed_points(std::vector<glm::dvec3> points, bool spline = false);
// Three expressions in u, in the words of implicit(), for u in [range.x, range.y]. Throws Error (input) that names the
// expression, and when the curve is a single point.
SeedLine seed_expression(const std::array<std::string, 3>& position, const glm::dvec2& range,
                         const Parameters& parameters = {});

// How rays meet a stream surface.
//   mesh         streamlines are traced, cells between them are bicubic Hermite patches (in descriptions "explicit")
//   back_stream  no mesh: points of the ray are traced back to the seed curve
enum class StreamMethod { mesh, back_stream };

// Where normals and curvature come from.
//   interpolated  the variational equations at the nodes of the mesh, interpolated in its cells; with back_stream
//                 integrated
//   integrated    the variational equations, from the seed to each point
//   mesh          the flat quadrilaterals of the mesh: normals only
//   neighbours    differences to streamlines next to the point
// The last two are those of Löffelmann et al. (1999), and are there to be compared with.
enum class StreamDerivatives { interpolated, integrated, mesh, neighbours };
std::string_view name_of(StreamDerivatives derivatives);  // as in descriptions

struct StreamOptions {
  glm::dvec2 time{0.0, 1.0};  // of τ, from the seed on; negative before it
  StreamMethod method = StreamMethod::mesh;
  // How far the surface that rays meet may be from the true one, in units of space; 0: 1e-5 of the extent of the field.
  double tolerance = 0;
  StreamDerivatives derivatives = StreamDerivatives::interpolated;
  bool polish = false;  // mesh: hits are moved to the true surface by Newton's method on the flow's map
};

// SurfaceCoordinates are u and v = τ. Normals point along x_u × x_τ. Curvature needs a field with two continuous
// derivatives; of a trilinear one it is `undefined`. A streamline ends at its first exit from the domain.
// Throws Error (input), one line: times that are not finite, reversed or empty, a tolerance below 0. What can only be
// told by tracing is thrown by what traces first, an Interrogator or the first question about bounds: a seed curve that
// is outside throughout, along the flow throughout, or where nothing moves; Error (memory), which says what was
// reached, where the tolerance cannot be met.
Surface stream_surface(const VectorField& field, const SeedLine& seed, const StreamOptions& options = {});
// The options of a stream surface, with the default tolerance put in; and the surface of the same field and seed by
// other options, which shares what was traced where times and tolerance are the same. Both throw Error (usage) on
// surfaces of another kind.
const StreamOptions& options_of(const Surface& surface);
Surface with_options(const Surface& surface, const StreamOptions& options);
// The range of u of its seed curve. Throws Error (usage) likewise.
glm::dvec2 seed_range(const Surface& surface);

// The cells of the mesh of a stream surface as polygons in (u, τ): counter-clockwise corners, with those of smaller
// neighbours on their sides, so that polygons fit. Traces the surface where that has not been done. With back_stream an
// even lattice. Throws Error (usage) on surfaces of another kind.
struct StreamPolygons {
  std::vector<glm::dvec2> places;      // u, τ
  std::vector<std::uint32_t> offsets;  // polygon i has corners offsets[i] .. offsets[i + 1] - 1
  std::vector<std::uint32_t> corners;  // numbers of places
};
StreamPolygons stream_polygons(const Surface& surface);

}  // namespace smurf
