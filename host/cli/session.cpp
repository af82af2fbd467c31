#include "cli/session.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <fstream>
#include <string>
#include <system_error>

#include "cli/progress.hpp"
#include "smurf/error.hpp"

namespace smurf {

Device open(const DeviceChoice& choice, const CommonOptions& common) {
  DeviceOptions options;
  options.lanes = choice.lanes;
  options.validation = choice.validation;
  options.timing = common.verbose;
  return open_device(choice.name, options);
}

Interrogator prepare(const Device& device, const Surface& surface, const std::filesystem::path& file,
                     const CommonOptions& common) {
  Progress progress(fmt::format("preparing the {}", surface.kind()), common.quiet);
  return naming(file, [&] { return Interrogator(device, surface, {.progress = progress.callback()}); });
}

Tracer prepare(const Device& device, const VectorField& field, const std::filesystem::path& file,
               const CommonOptions& common) {
  Progress progress(fmt::format("preparing the field ({})", field.kind()), common.quiet);
  return naming(file, [&] { return Tracer(device, field, {.progress = progress.callback()}); });
}

std::string extension_of(const std::filesystem::path& file) {
  std::string text = file.extension().string();
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

void check_output(const std::filesystem::path& file, std::initializer_list<std::string_view> extensions) {
  if (std::find(extensions.begin(), extensions.end(), extension_of(file)) == extensions.end()) {
    throw Error(ErrorCode::usage,
                fmt::format("cannot write {}: the name must end in {}", file.string(), fmt::join(extensions, " or ")));
  }
  std::error_code failed;
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  if (!std::filesystem::is_directory(folder, failed)) {
    throw Error(ErrorCode::usage,
                fmt::format("cannot write {}: there is no folder {}", file.string(), folder.string()));
  }
  if (std::filesystem::is_directory(file, failed)) {
    throw Error(ErrorCode::usage, fmt::format("cannot write {}: it is a folder", file.string()));
  }
}

void report(const Device& device, const CommonOptions& common, std::string_view what, std::size_t count,
            double seconds) {
  if (!common.verbose) return;
  const DeviceInfo& info = device.info();
  fmt::print(stderr, "device: {}:{} {} ({}), {} precision, {} {}\n", info.executor, info.index, info.name,
             info.platform, info.precision, info.lanes, info.lanes == 1 ? "lane" : "lanes");
  if (!device.is_reference()) {
    fmt::print(stderr, "programs: {} compiled in {:.3f} s, {} from the cache\n", device.programs_compiled(),
               device.compile_seconds(), device.programs_from_cache());
  }
  for (const KernelTime& time : device.kernel_times()) {
    fmt::print(stderr, "kernel {:<20} {:>6} {:<8} {:>10.3f} ms\n", time.kernel, time.launches,
               time.launches == 1 ? "launch" : "launches", 1e3 * time.seconds);
  }
  fmt::print(stderr, "{} {} in {:.3f} s: {:.4g} M{}/s\n", count, what, seconds,
             seconds > 0 ? 1e-6 * double(count) / seconds : 0.0, what);
}

std::string bytes_text(std::size_t bytes) {
  constexpr std::string_view units[] = {"bytes", "KiB", "MiB", "GiB", "TiB"};
  double amount = double(bytes);
  std::size_t unit = 0;
  while (amount >= 1024 && unit + 1 < std::size(units)) {
    amount /= 1024;
    unit++;
  }
  return unit == 0 ? fmt::format("{} bytes", bytes) : fmt::format("{:.1f} {}", amount, units[unit]);
}

std::size_t line_of_row(const std::filesystem::path& file, std::size_t row) {
  std::ifstream stream(file);
  std::string text;
  std::size_t line = 0;
  for (std::size_t seen = 0; std::getline(stream, text);) {
    line++;
    if (text.find_first_not_of(" \t\r") == std::string::npos) continue;
    if (seen++ == row + 1) break;
  }
  return line;
}

}  // namespace smurf
