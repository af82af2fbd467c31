// The verbs of the program `smurf` and what they take. Each writes its results to standard output or to
// the file named, and throws Error; main.cpp turns errors into a line and an exit code.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "smurf/device.hpp"
#include "smurf/flow.hpp"

namespace smurf {

struct CommonOptions {
  bool verbose = false;
  bool quiet = false;
};

struct DeviceChoice {
  std::string name = "opencl";
  int lanes = 0;
  bool validation = false;
};

struct InfoOptions {
  std::filesystem::path surface;
  DeviceChoice device;
  bool device_asked_for = false;  // then a missing device is an error
};

struct CastCommand {
  std::filesystem::path surface, rays, output;
  std::string hits = "all";
  std::string properties;
  DeviceChoice device;
};

struct ProbeCommand {
  std::filesystem::path surface, points, output;
  std::optional<std::string>
      properties;  // by default normal, gauss and mean, and what tells where on the surface the point is
  DeviceChoice device;
};

struct WalkCommand {
  std::filesystem::path surface, points, output;
  double distance = 0;
  std::int64_t steps = 1;
  std::optional<double> tolerance;
  DeviceChoice device;
};

struct TraceCommand {
  std::filesystem::path field, seeds, output;
  std::string integrator = "dormand-prince";
  std::optional<double> step, tolerance;
  TraceOptions options;
  DeviceChoice device;
};

struct LinesCommand {
  std::filesystem::path surface, points, output;
  int principal = 1;
  double length = 0;
  bool both = false;
  std::optional<double> step;
  DeviceChoice device;
};

struct ExportCommand {
  std::filesystem::path surface, output;
  DeviceChoice device;
};

struct RenderCommand {
  std::filesystem::path surface, output;
  std::optional<std::filesystem::path> seeds;  // then `surface` is a vector field, and lines are drawn
  std::optional<std::string> shades;           // by default phong, of lines speed
  std::string size = "512x512";
  std::optional<std::string> eye, look_at, up, view, range;
  std::optional<double> field_of_view;
  std::optional<double> time, radius;  // of lines
  bool both = false;
  std::optional<int> samples;  // by default 2, of lines 3
  DeviceChoice device;
};

struct GalleryCommand {
  std::filesystem::path output, data;  // data empty: where the program's own is
  std::optional<std::filesystem::path> lobster;
  std::optional<std::string> only;
  int size = 512;
  DeviceChoice device;
};

struct CompareCommand {
  std::filesystem::path surface, output;  // no output: only printed
  std::string resolutions = "16,32,64,128";
  std::size_t rays = 2000;
  std::uint64_t seed = 1;
  int apron = 12;
  std::optional<double> margin;
  bool asks_for_samples = false;  // resolutions, apron or margin, which a stream surface has no use for
  DeviceChoice device;
};

void run_devices();
void run_info(const InfoOptions& options, const CommonOptions& common);
void run_cast(const CastCommand& command, const CommonOptions& common);
void run_probe(const ProbeCommand& command, const CommonOptions& common);
void run_walk(const WalkCommand& command, const CommonOptions& common);
void run_trace(const TraceCommand& command, const CommonOptions& common);
void run_lines(const LinesCommand& command, const CommonOptions& common);
void run_export(const ExportCommand& command, const CommonOptions& common);
// `opened`: a device to use in place of the one that the command names.
void run_render(const RenderCommand& command, const CommonOptions& common,
                const std::optional<Device>& opened = std::nullopt);
void run_gallery(const GalleryCommand& command, const CommonOptions& common);
void run_compare(const CompareCommand& command, const CommonOptions& common);

}  // namespace smurf
