// The verb `render`.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/commands.hpp"
#include "cli/numbers.hpp"
#include "cli/progress.hpp"
#include "cli/session.hpp"
#include "smurf/error.hpp"
#include "smurf/render.hpp"

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
  Camera camera = fitted_camera(bounds, width, height);
  set_vector(camera.eye, command.eye, "--eye");
  set_vector(camera.look_at, command.look_at, "--look-at");
  set_vector(camera.up, command.up, "--up");
  if (command.field_of_view) camera.field_of_view = *command.field_of_view;
  return camera;
}

std::optional<ValueRange> range_in(const std::optional<std::string>& text) {
  if (!text) return std::nullopt;
  const auto numbers = finite_numbers_in(*text, 2);
  if (!numbers || !((*numbers)[0] < (*numbers)[1])) {
    throw Error(ErrorCode::usage, fmt::format("--range takes two finite numbers as lower,upper, not \"{}\"", *text));
  }
  return ValueRange{(*numbers)[0], (*numbers)[1]};
}

}  // namespace

void run_render(const RenderCommand& command, const CommonOptions& common) {
  check_output(command.output, {".png"});
  RenderOptions options;
  options.shades = shades_named(command.shades);
  options.samples = command.samples;
  options.range = range_in(command.range);
  const Surface surface = load_surface(command.surface);
  options.camera = camera_of(command, surface.bounds());
  const Device device = open(command.device, common);
  const Interrogator query = prepare(device, surface, common);

  const Stopwatch watch;
  Image image;
  {
    Progress progress("rendering", common.quiet);
    options.progress = progress.callback();
    image = render(query, options);
  }
  const double seconds = watch.seconds();
  save_png(image, command.output);
  const std::size_t samples = std::size_t(command.samples) * std::size_t(command.samples);
  report(device, common, "rays", std::size_t(image.width) * std::size_t(image.height) * samples, seconds);
}

}  // namespace smurf
