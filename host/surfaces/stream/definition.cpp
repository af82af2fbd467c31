#include "surfaces/stream/definition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

#include "flows/queries.hpp"
#include "patches/leaves.hpp"
#include "patches/ray_boxes.hpp"
#include "patches/ray_roots.hpp"
#include "smurf/error.hpp"
#include "surfaces/stream/mesh.hpp"

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

std::string gaps_text(const std::vector<glm::dvec2>& gaps) {
  constexpr std::size_t most_shown = 4;
  if (gaps.empty()) return "none";
  std::string text = "torn for u in";
  for (std::size_t i = 0; i < std::min(gaps.size(), most_shown); i++)
    text += fmt::format("{} [{:.9g}, {:.9g}]", i == 0 ? "" : ",", gaps[i].x, gaps[i].y);
  if (gaps.size() > most_shown) text += fmt::format(", and {} more", gaps.size() - most_shown);
  return text;
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
         Property::principal | Property::directions | Property::normal_curvature | Property::distance;
}

std::vector<Fact> StreamSurface::facts() const {
  const StreamMesh& of = mesh();
  const glm::dvec2 u = seed().range();
  std::vector<Fact> facts{{"method", options_.method == StreamMethod::mesh ? "explicit" : "back-stream"},
                          {"field", std::string(field().kind())},
                          {"u", fmt::format("{:g} to {:g}", u.x, u.y)},
                          {"time", fmt::format("{:g} to {:g}", options_.time.x, options_.time.y)},
                          {"derivatives", std::string(name_of(options_.derivatives))}};
  for (const Fact& note : field().notes()) facts.push_back(note);
  std::string lines = fmt::format("{}, {} steps", of.streamlines, of.steps);
  if (of.short_lines > 0) lines += fmt::format("; {} leave the field before the time has passed", of.short_lines);
  facts.push_back({"streamlines", lines});
  facts.push_back({"cells", fmt::format("{}, traced in {:.3g} s", of.cells.size(), of.seconds)});
  std::string deviation =
      fmt::format("{:.3g} at most where it was measured; asked for: {:.3g}", of.deviation, options_.tolerance);
  if (of.deviation > options_.tolerance) deviation += "; floats do no better where the flow stretches so much";
  facts.push_back({"deviation", deviation});
  facts.push_back({"proved", fmt::format("{:.1f} % of the cells", 100 * double(of.proved) / double(of.cells.size()))});
  facts.push_back({"gaps", gaps_text(of.gaps)});
  if (!of.borders.empty())
    facts.push_back(
        {"borders", fmt::format("{} boxes where streamlines end; hits there are unresolved", of.borders.size())});
  if (of.is_smooth)
    facts.push_back({"curvature", fmt::format("interpolated, off by {:.2g} of its size at most where it was measured",
                                              of.curvature_error)});
  else facts.push_back({"curvature", "undefined: it needs a field with two continuous derivatives, such as tricubic"});
  return facts;
}

StreamPolygons stream_polygons(const Surface& surface) {
  const auto* stream = dynamic_cast<const StreamSurface*>(&surface.model());
  if (!stream)
    throw Error(ErrorCode::usage,
                fmt::format("polygons are those of stream surfaces, not of kind \"{}\"", surface.kind()));
  return stream->mesh().polygons;
}

RootResolver StreamSurface::root_resolver() const {
  if (options_.method != StreamMethod::mesh) return {};
  return [this](const Ray& ray, double low, double high, std::vector<ResolvedRoot>& resolved) {
    const StreamMesh& of = mesh();
    std::call_once(kept_->roots_made, [&] {
      const glm::dvec3 size = of.bounds.upper - of.bounds.lower;
      kept_->rays.emplace(*of.pieces, of.topology, of.leaves, std::max({size.x, size.y, size.z}));
    });
    const glm::dvec3 origin(ray.origin), direction(ray.direction);
    std::vector<PatchRoot> found;
    kept_->rays->find(origin, direction, low, high, found);
    const double off = std::max(options_.tolerance, of.deviation) / glm::length(direction);
    for (PatchRoot& root : found) {
      const StreamCell& cell = of.cells[root.piece];
      const glm::dvec2 at = cell.lower + glm::dvec2(root.u, root.v) * (cell.upper - cell.lower);
      root.root.low -= off;
      root.root.high += off;
      resolved.push_back({root.root, {0, float(at.x), float(at.y)}, HitStatus::sampled});
    }
    // Where streamlines end nothing more is known.
    for (const StreamBorder& border : of.borders) {
      double from = low, to = high;
      if (!clip_to_box(border.space, origin, direction, from, to)) continue;
      const glm::dvec2 at = 0.5 * (border.lower + border.upper);
      resolved.push_back(
          {{from, to, expression::LineRoot::Kind::undecided}, {0, float(at.x), float(at.y)}, HitStatus::sampled});
    }
    std::ranges::sort(resolved, {}, [](const ResolvedRoot& r) { return r.root.low + r.root.high; });
  };
}

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
