#include "surfaces/stream/definition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

#include "flows/queries.hpp"
#include "patches/leaves.hpp"
#include "patches/ray_roots.hpp"
#include "smurf/error.hpp"
#include "surfaces/stream/mesh.hpp"
#include "surfaces/stream/tubes.hpp"

namespace smurf {
namespace {

constexpr double default_tolerance = 1e-5;  // of the field's extent

[[noreturn]] void fail(const std::string& message) { throw Error(ErrorCode::input, message); }

void require_time(const glm::dvec2& time) {
  if (!std::isfinite(time.x) || !std::isfinite(time.y) || !(time.x < time.y))
    fail(fmt::format("time: the range must be two finite numbers, the lesser first, not [{}, {}]", time.x, time.y));
  // Parameters of hits are floats.
  if (!std::isfinite(float(time.x)) || !std::isfinite(float(time.y)) || !(float(time.x) < float(time.y)))
    fail(fmt::format("time: in floats nothing is left of the range [{}, {}]", time.x, time.y));
}

// The first device there is; the reference where there is none.
std::optional<Device> any_device() {
  for (const DeviceInfo& info : list_devices()) {
    if (info.executor == "reference") continue;
    return open_device(fmt::format("{}:{}", info.executor, info.index));
  }
  return std::nullopt;
}

}  // namespace

std::string_view name_of(StreamDerivatives derivatives) {
  switch (derivatives) {
    case StreamDerivatives::interpolated:
      return "interpolated";
    case StreamDerivatives::integrated:
      return "integrated";
    case StreamDerivatives::mesh:
      return "mesh";
    case StreamDerivatives::neighbours:
      return "neighbours";
  }
  return "unknown";
}

struct StreamSurface::Kept {
  std::mutex mutex{};
  std::optional<StreamMesh> mesh{};
  std::once_flag roots_made{};
  std::optional<RayRoots> rays{};
};

StreamSurface::StreamSurface(VectorField field, SeedLine seed, const StreamOptions& options)
    : SurfaceDefinition(SurfaceKind::stream),
      field_(std::move(field)),
      seed_(std::move(seed)),
      options_(options),
      kept_(std::make_shared<Kept>()) {
  require_time(options_.time);
  if (!(options_.tolerance >= 0) || !std::isfinite(options_.tolerance))
    fail(fmt::format("tolerance: it must be positive, or 0 for the default, not {}", options_.tolerance));
  if (options_.tolerance == 0) options_.tolerance = default_tolerance * field_extent();
}

double StreamSurface::field_extent() const {
  const Bounds bounds = field().bounds();
  const glm::dvec3 size = bounds.upper - bounds.lower;
  return std::max({size.x, size.y, size.z});
}

const StreamMesh& StreamSurface::mesh(Executor* executor) const {
  const std::lock_guard lock(kept_->mutex);
  if (kept_->mesh) return *kept_->mesh;
  std::optional<Device> device;
  if (!executor) device = any_device();
  if (device) executor = &device->executor();
  const std::unique_ptr<FlowQueries> flow =
      executor ? trace_on_device(*executor, share_field(), {}) : trace_by_reference(field());
  kept_->mesh = make_stream_mesh(*flow, field(), seed(), options_.time, options_.tolerance);
  return *kept_->mesh;
}

std::vector<PatchLeaf> StreamSurface::leaves() const {
  const StreamMesh& of = mesh();
  const double off = std::max(options_.tolerance, of.deviation);
  std::vector<PatchLeaf> leaves = of.leaves;
  for (PatchLeaf& leaf : leaves) {
    const StreamCell& cell = of.cells[leaf.piece];
    if (cell.proved) leaf.e = stream_remainder(cell, leaf);
    leaf.error += off;
    leaf.lower -= off;
    leaf.upper += off;
  }
  for (std::size_t i = 0; i < of.borders.size(); i++) {
    PatchLeaf leaf;
    leaf.kind = LeafKind::open;
    leaf.piece = std::uint32_t(of.cells.size() + i);
    leaf.centre = leaf.half = glm::dvec2(0.5);
    leaf.lower = of.borders[i].space.lower;
    leaf.upper = of.borders[i].space.upper;
    leaves.push_back(leaf);
  }
  return leaves;
}

Bounds StreamSurface::bounds() const { return mesh().bounds; }

std::uint32_t StreamSurface::properties() const {
  return Property::parameters | Property::location | Property::normal | Property::gauss | Property::mean |
         Property::principal | Property::directions | Property::normal_curvature;
}

std::vector<Fact> StreamSurface::facts() const { return {}; }

StreamPolygons stream_polygons(const Surface& surface) {
  const auto* stream = dynamic_cast<const StreamSurface*>(&surface.model());
  if (!stream)
    throw Error(ErrorCode::usage,
                fmt::format("polygons are those of stream surfaces, not of kind \"{}\"", surface.kind()));
  return stream->mesh().polygons;
}

RootResolver StreamSurface::root_resolver() const { return {}; }

Surface stream_surface(const VectorField& field, const SeedLine& seed, const StreamOptions& options) {
  return Surface(std::make_shared<const StreamSurface>(field, seed, options));
}

SeedLine seed_points(std::vector<glm::dvec3> points, bool spline) {
  return SeedLine(spline ? spline_seeds(points) : polyline_seeds(std::move(points)));
}

SeedLine seed_expression(const std::array<std::string, 3>& position, const glm::dvec2& range,
                         const Parameters& parameters) {
  return SeedLine(expression_seeds(position, range, parameters));
}

}  // namespace smurf
