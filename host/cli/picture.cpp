// The verb `render`: surfaces, and lines of vector fields.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/commands.hpp"
#include "cli/lines.hpp"
#include "cli/numbers.hpp"
#include "cli/progress.hpp"
#include "cli/session.hpp"
#include "flows/seeds/seed_curve.hpp"
#include "smurf/error.hpp"
#include "smurf/lines.hpp"
#include "smurf/render.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

namespace {

// `count` finite numbers with commas between them; none if it is anything else.
std::optional<std::vector<double>> finite_numbers_in(std::string_view text, std::size_t count) {
  auto numbers = numbers_in<double>(text);
  const auto is_finite = [](double number) { return std::isfinite(number); };
  if (!numbers || numbers->size() != count || !std::ranges::all_of(*numbers, is_finite)) return std::nullopt;
  return numbers;
}

void set_vector(glm::dvec3& vector, const std::optional<std::string>& text, std::string_view option) {
  if (!text) return;
  const auto numbers = finite_numbers_in(*text, 3);
  if (!numbers)
    throw Error(ErrorCode::usage, fmt::format("{} takes three finite numbers as x,y,z, not \"{}\"", option, *text));
  vector = {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
}

std::string shown(const glm::dvec3& v) { return fmt::format("{:g},{:g},{:g}", v.x, v.y, v.z); }

// As far as the command tells it; where it leaves the eye open the bounds are seen.
Camera camera_of(const RenderCommand& command, const Bounds& bounds) {
  constexpr int longest = 16384;
  const std::string_view size = command.size;
  const std::size_t cross = std::min(size.find_first_of("xX"), size.size());
  const int width = number_in<int>(size.substr(0, cross)).value_or(0);
  const int height = cross == size.size() ? 0 : number_in<int>(size.substr(cross + 1)).value_or(0);
  if (width < 1 || height < 1 || width > longest || height > longest) {
    throw Error(ErrorCode::usage,
                fmt::format("--size takes WIDTHxHEIGHT, each from 1 to {}, not \"{}\"", longest, command.size));
  }
  glm::dvec3 up(0, 0, 1);
  set_vector(up, command.up, "--up");
  Camera camera = camera_from(view_named(command.view.value_or("usual")), up, bounds, width, height);
  const glm::dvec3 offset = camera.eye - camera.look_at;
  set_vector(camera.look_at, command.look_at, "--look-at");
  camera.eye = camera.look_at + offset;
  set_vector(camera.eye, command.eye, "--eye");
  if (command.field_of_view) camera.field_of_view = *command.field_of_view;
  if (const auto other = replacement_of_up(camera)) {
    fmt::print(stderr, "smurf: warning: up {} is parallel to the view; {} is up in its place\n", shown(camera.up),
               shown(*other));
    camera.up = *other;
  }
  if (!command.eye) camera = fitted_to(camera, corners_of(bounds), Fit::eye);
  return camera;
}

// Where the command leaves the eye open: what there is to see fills the picture.
Fit fit_of(const RenderCommand& command) { return command.look_at ? Fit::eye : Fit::eye_and_target; }

std::optional<ValueRange> range_in(const std::optional<std::string>& text) {
  if (!text) return std::nullopt;
  const auto numbers = finite_numbers_in(*text, 2);
  if (!numbers || !((*numbers)[0] < (*numbers)[1])) {
    throw Error(ErrorCode::usage, fmt::format("--range takes two finite numbers as lower,upper, not \"{}\"", *text));
  }
  return ValueRange{(*numbers)[0], (*numbers)[1]};
}

// Why no ray hits the surface.
std::string why_nothing(const Surface& surface, const Camera& camera) {
  if (std::string reason = surface.model().why_empty(); !reason.empty()) return reason;
  const Projection projection(camera);
  bool behind = true;
  glm::bvec4 beyond(true);  // the left, the right, the upper, the lower border of the picture
  for (const glm::vec3& corner : corners_of(surface.bounds())) {
    const glm::dvec3 seen = projection.in_view(glm::dvec3(corner));
    behind &= seen.z <= 0;
    if (seen.z <= 0 && !projection.is_parallel()) continue;
    const glm::dvec2 pixel = projection.pixel(seen);
    const glm::bvec4 here(pixel.x<0, pixel.x> camera.width, pixel.y<0, pixel.y> camera.height);
    for (int side = 0; side < 4; side++) beyond[side] = beyond[side] && here[side];
  }
  if (behind) return "the surface is behind the camera";
  if (glm::any(beyond)) return "the surface is beyond the borders of the picture";
  return "no ray hits the surface";
}

void render_surface(const RenderCommand& command, const CommonOptions& common, const std::optional<Device>& opened) {
  RenderOptions options;
  options.shades = shades_named(command.shades.value_or("phong"));
  options.samples = command.samples.value_or(2);
  options.range = range_in(command.range);
  const Surface surface = load_surface(command.surface);
  options.camera = camera_of(command, naming(command.surface, [&] { return surface.bounds(); }));
  const Device device = opened ? *opened : open(command.device, common);
  const Interrogator query = prepare(device, surface, command.surface, common);
  if (!command.eye) options.camera = fitted_camera(query, options.camera, fit_of(command));

  std::string reason;
  options.nothing = [&] { return reason = why_nothing(surface, options.camera); };

  const Stopwatch watch;
  Image image;
  {
    Progress progress("rendering", common.quiet);
    options.progress = progress.callback();
    image = render(query, options);
  }
  const double seconds = watch.seconds();
  save_png(image, command.output);
  if (!reason.empty()) fmt::print(stderr, "smurf: nothing to see in {}: {}\n", command.output.string(), reason);
  const std::size_t rays = std::size_t(image.width) * std::size_t(image.height);
  const auto samples = std::size_t(options.samples);
  report(device, common, "rays", rays * samples * samples, seconds);
}

// As long as a line needs to cross the domain at the mean speed of the seeds.
double usual_time(const Tracer& tracer, const FlowSeeds& seeds, const Bounds& bounds) {
  const std::vector<glm::vec3> places(seeds.positions.begin(), seeds.positions.end());
  double sum = 0;
  std::size_t count = 0;
  for (const glm::vec3& value : tracer.sample(places).value) {
    const double speed = glm::length(glm::dvec3(value));
    if (!std::isfinite(speed)) continue;
    sum += speed;
    count++;
  }
  // Where nothing flows tracing says so.
  return sum > 0 ? glm::length(bounds.upper - bounds.lower) * double(count) / sum : 1;
}

void render_lines(const RenderCommand& command, const CommonOptions& common) {
  constexpr int rows = 300;  // across the domain at the mean speed; between them a line is drawn as cubics
  LineRenderOptions options;
  options.shade = line_shade_named(command.shades.value_or("speed"));
  options.samples = command.samples.value_or(3);
  options.range = range_in(command.range);
  options.radius = command.radius.value_or(0);
  const VectorField field = load_vector_field(command.surface);
  options.box = field.bounds();
  options.camera = camera_of(command, field.bounds());
  FlowSeeds seeds = load_seeds(*command.seeds);
  seeds.tangents.clear();
  seeds.second_tangents.clear();
  const Device device = open(command.device, common);
  const Tracer tracer = prepare(device, field, command.surface, common);

  const Stopwatch watch;
  const double usual = usual_time(tracer, seeds, field.bounds());
  TraceOptions trace;
  trace.time = command.time.value_or(usual);
  trace.both = command.both;
  trace.interval = std::min(std::abs(trace.time), usual) / rows;
  const Streamlines lines = trace_lines(tracer, seeds, trace, common);
  const double seconds = watch.seconds();
  save_png(render(lines, tracer.sample(lines.positions).value, options), command.output);
  report(device, common, "steps", lines.steps, seconds);
}

}  // namespace

void run_render(const RenderCommand& command, const CommonOptions& common, const std::optional<Device>& opened) {
  check_output(command.output, {".png"});
  if (command.seeds) return render_lines(command, common);
  if (is_vector_field(command.surface))
    throw Error(ErrorCode::usage, fmt::format("{}: a vector field is drawn by lines: --seeds tells where they begin",
                                              command.surface.string()));
  render_surface(command, common, opened);
}

}  // namespace smurf
