// The program `smurf`: options to commands, errors to one line and an exit code.
//
// Exit codes: 0 done, 1 failure (device, memory, writing), 2 wrong usage or input.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <exception>
#include <functional>
#include <new>
#include <string>
#include <vector>

#include "cli/bench.hpp"
#include "cli/commands.hpp"
#include "smurf/error.hpp"
#include "smurf/render.hpp"

namespace smurf {

namespace {

constexpr int exit_failure = 1, exit_usage = 2;

// Whatever a message quotes, it stays one line.
int fail(int code, std::string message) {
  std::replace_if(
      message.begin(), message.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  fmt::print(stderr, "smurf: {}\n", message);
  return code;
}

int exit_code_of(const Error& error) {
  return error.code() == ErrorCode::usage || error.code() == ErrorCode::input ? exit_usage : exit_failure;
}

// Everything that the options are read into, and what to do with it once they are.
struct CommandLine {
  CommonOptions common;
  InfoOptions info;
  CastCommand cast;
  ProbeCommand probe;
  WalkCommand walk;
  TraceCommand trace;
  LinesCommand lines;
  ExportCommand export_mesh;
  RenderCommand render;
  GalleryCommand gallery;
  CompareCommand compare;
  BenchOptions bench;
  std::function<int()> run;

  void declare(CLI::App& app);
  void declare_inform(CLI::App& app);
  void declare_query(CLI::App& app);
  void declare_walk(CLI::App& app);
  void declare_trace(CLI::App& app);
  void declare_lines(CLI::App& app);
  void declare_export(CLI::App& app);
  void declare_render(CLI::App& app);
  void declare_gallery(CLI::App& app);
  void declare_compare(CLI::App& app);
  void declare_bench(CLI::App& app);

  // A verb's work, as what to do after parsing.
  void chosen(CLI::App* verb, std::function<void()> work) {
    verb->final_callback([this, work = std::move(work)] {
      run = [work] {
        work();
        return 0;
      };
    });
  }
};

void add_surface(CLI::App* verb, std::filesystem::path& surface) {
  verb->add_option("surface", surface, "Surface description (JSON)")->type_name("SURFACE.json")->required();
}

CLI::Option* add_device(CLI::App* verb, DeviceChoice& device) {
  verb->add_option("--lanes", device.lanes, "Rays per work item on OpenCL; chosen from the device by default")
      ->check(CLI::IsMember({1, 4, 8, 16}));
  verb->add_flag("--validation", device.validation, "Vulkan validation layers; any message is an error");
  return verb
      ->add_option("--device", device.name, "opencl, vulkan or reference, each with an optional :number or :name")
      ->capture_default_str();
}

template <class T>
CLI::Option* add_seeds(CLI::App* verb, T& seeds) {
  return verb
      ->add_option("--seeds", seeds,
                   "Where lines begin: columns x,y,z and optionally the tangents dx,dy,dz; or a curve (JSON)")
      ->type_name("SEEDS.csv|.json");
}

template <class T>
void add_output(CLI::App* verb, T& file, const char* type, const char* help) {
  verb->add_option("-o,--output", file, help)->type_name(type)->required();
}

void CommandLine::declare(CLI::App& app) {
  app.require_subcommand(1);
  app.fallthrough();
  app.set_version_flag("--version", "smurf " SMURF_VERSION);
  app.add_flag("-v,--verbose", common.verbose,
               "Tell the device, compile time, kernel times and rays/s, on standard error");
  app.add_flag("--quiet", common.quiet, "No progress");
  declare_inform(app);
  declare_query(app);
  declare_walk(app);
  declare_trace(app);
  declare_lines(app);
  declare_export(app);
  declare_render(app);
  declare_gallery(app);
  declare_compare(app);
  declare_bench(app);
}

void CommandLine::declare_inform(CLI::App& app) {
  chosen(app.add_subcommand("devices", "What can run here"), run_devices);

  CLI::App* verb = app.add_subcommand("info", "Kind, bounds, sizes, memory on the device; also of vector fields");
  add_surface(verb, info.surface);
  CLI::Option* device = add_device(verb, info.device);
  chosen(verb, [this, device] {
    info.device_asked_for = device->count() > 0;
    run_info(info, common);
  });
}

void CommandLine::declare_query(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("cast", "Hits of rays, sorted along each ray");
  add_surface(verb, cast.surface);
  verb->add_option("--rays", cast.rays, "Rays: columns ox,oy,oz,dx,dy,dz and optionally tmin,tmax")
      ->type_name("RAYS.csv")
      ->required();
  verb->add_option(
          "--hits", cast.hits,
          "all or first; any: of each ray whether it has a hit; count: how many (ray,hit or ray,count, and how "
          "many of them are tangent or unresolved)")
      ->check(CLI::IsMember({"all", "first", "any", "count"}))
      ->capture_default_str();
  verb->add_option("--properties", cast.properties, "Of value,normal,gauss,mean,principal,directions,parameters")
      ->type_name("LIST");
  add_device(verb, cast.device);
  add_output(verb, cast.output, "HITS.csv", "One row per hit; .vtp in place of .csv writes VTK XML");
  chosen(verb, [this] { run_cast(cast, common); });

  verb = app.add_subcommand("probe", "Properties of the level sets through points, or of a surface's nearest points");
  add_surface(verb, probe.surface);
  verb->add_option("--points", probe.points, "Points: columns x,y,z, or surface coordinates: u,v (patch,u,v; face,u,v)")
      ->type_name("POINTS.csv")
      ->required();
  verb->add_option("--properties", probe.properties,
                   "Of value,normal,gauss,mean,principal,directions,parameters,location,distance,inside; by default "
                   "normal,gauss,mean, of level sets value, of others parameters")
      ->type_name("LIST");
  add_device(verb, probe.device);
  add_output(verb, probe.output, "OUT.csv", "One row per point; .vtp in place of .csv writes VTK XML");
  chosen(verb, [this] { run_probe(probe, common); });
}

void CommandLine::declare_walk(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("walk", "Paths on a surface: points at a distance, step by step");
  add_surface(verb, walk.surface);
  verb->add_option("--points", walk.points, "Where paths begin, and which way: columns x,y,z,dx,dy,dz")
      ->type_name("POINTS.csv")
      ->required();
  verb->add_option("--distance", walk.distance, "The chord of each step, in the data's units")
      ->type_name("R")
      ->required();
  verb->add_option("--steps", walk.steps, "Steps of each path")->type_name("N")->capture_default_str();
  verb->add_option("--tolerance", walk.tolerance,
                   "How far points may be from the surface, which they are moved onto; by default a thousandth of the "
                   "surface's extent")
      ->type_name("E");
  add_device(verb, walk.device);
  add_output(verb, walk.output, "PATHS.csv", "One row per step; .vtp in place of .csv writes polylines as VTK XML");
  chosen(verb, [this] { run_walk(walk, common); });
}

void CommandLine::declare_trace(CLI::App& app) {
  TraceOptions& options = trace.options;
  CLI::App* verb = app.add_subcommand("trace", "Streamlines of a vector field");
  verb->add_option("field", trace.field, "Description of a vector field, or of a stream surface, whose field is taken")
      ->type_name("FIELD.json")
      ->required();
  add_seeds(verb, trace.seeds)->required();
  verb->add_option("--time", options.time, "How long to follow the flow; negative: back")->type_name("T")->required();
  verb->add_flag("--both", options.both, "From -T to T, in one line");
  verb->add_option("--integrator", trace.integrator, "dormand-prince (5th order, error control) or rk4 (fixed step)")
      ->check(CLI::IsMember({"dormand-prince", "rk4"}))
      ->capture_default_str();
  verb->add_option("--step", trace.step, "rk4: time of a step; by default a 200th of the time")->type_name("H");
  verb->add_option("--tolerance", trace.tolerance,
                   "dormand-prince: error of a step, in units of space; by default 1e-6 of the domain's extent")
      ->type_name("E");
  verb->add_option("--interval", options.interval, "Time between rows; by default every step has one")->type_name("DT");
  verb->add_flag("--ends", options.ends_only, "Only the first and the last row of each line");
  verb->add_option("--length", options.length, "Arc length to end at")->type_name("L");
  verb->add_option("--steps", options.most_steps, "Steps to end at")->type_name("N")->capture_default_str();
  verb->add_option("--stagnation", options.stagnation,
                   "Speed to end at; by default 1e-6 of the greatest speed of the samples, or of the seeds")
      ->type_name("V");
  verb->add_option("--variation", options.variation,
                   "1: also how rows vary with the seed along its tangent; 2: also the second derivative")
      ->check(CLI::IsMember({1, 2}));
  add_device(verb, trace.device);
  add_output(verb, trace.output, "LINES.csv",
             "One row per position; .vtp in place of .csv writes polylines as VTK XML");
  chosen(verb, [this] { run_trace(trace, common); });
}

void CommandLine::declare_lines(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("lines", "Lines of curvature on a surface");
  add_surface(verb, lines.surface);
  verb->add_option("--points", lines.points, "Where lines begin: columns x,y,z, next to the surface")
      ->type_name("POINTS.csv")
      ->required();
  verb->add_option("--principal", lines.principal, "1: along the direction of k1, 2: of k2")
      ->check(CLI::IsMember({1, 2}))
      ->capture_default_str();
  verb->add_option("--length", lines.length, "Of a line; with --both to each side")->type_name("L")->required();
  verb->add_flag("--both", lines.both, "To both sides, in one line");
  verb->add_option("--step", lines.step, "The longest step; by default a 400th of the diagonal of the bounds")
      ->type_name("H");
  add_device(verb, lines.device);
  add_output(verb, lines.output, "LINES.csv",
             "One row per step: line,step,status,x,y,z,k1,k2,arc; .vtp in place of .csv writes polylines as VTK XML");
  chosen(verb, [this] { run_lines(lines, common); });
}

void CommandLine::declare_export(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("export", "A stream surface as polygons, with u and tau, normals and curvature");
  add_surface(verb, export_mesh.surface);
  add_device(verb, export_mesh.device);
  add_output(verb, export_mesh.output, "MESH.vtp|.ply", "VTK XML, or PLY (binary)");
  chosen(verb, [this] { run_export(export_mesh, common); });
}

void CommandLine::declare_render(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("render", "A picture of the surface, or with --seeds of lines of a vector field");
  add_surface(verb, render.surface);
  verb->add_option("--shade", render.shades,
                   "One or several, but at most one colour: " + shades_help() +
                       "; by default phong. Of lines: speed (the default), time or none")
      ->type_name("LIST");
  CLI::Option* seeds = add_seeds(verb, render.seeds);
  verb->add_option("--time", render.time,
                   "How long lines are; by default they cross the domain at the mean speed of the seeds")
      ->type_name("T")
      ->needs(seeds);
  verb->add_flag("--both", render.both, "Lines go both ways from their seeds")->needs(seeds);
  verb->add_option("--radius", render.radius, "Of lines, in units of space; by default a 500th of the extent")
      ->type_name("R")
      ->needs(seeds);
  verb->add_option("--size", render.size, "Pixels")->type_name("WxH")->capture_default_str();
  CLI::Option* eye =
      verb->add_option("--eye", render.eye, "Where the camera stands; by default what is seen fills the picture")
          ->type_name("x,y,z");
  verb->add_option("--look-at", render.look_at, "By default the middle of what is seen; with --eye that of the bounds")
      ->type_name("x,y,z");
  verb->add_option("--up", render.up, "By default 0,0,1; the view turns with it")->type_name("x,y,z");
  verb->add_option("--view", render.view, "front, back, left, right, top, bottom or iso")
      ->type_name("SIDE")
      ->excludes(eye);
  verb->add_option("--fov", render.field_of_view, "Vertical field of view in degrees, by default 45")
      ->type_name("DEGREES");
  verb->add_option("--range", render.range, "Numbers at the ends of the colour map; by default from what is seen")
      ->type_name("lower,upper");
  verb->add_option("--samples", render.samples, "Per pixel and axis, 1 to 16; by default 2, of lines 3")
      ->check(CLI::Range(1, 16));
  add_device(verb, render.device);
  add_output(verb, render.output, "IMAGE.png", "The picture");
  chosen(verb, [this] { run_render(render, common); });
}

void CommandLine::declare_gallery(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("gallery", "The paper's figures, from bundled data, and a page that shows them");
  verb->add_option("--size", gallery.size, "Of a picture's side, in pixels")
      ->type_name("N")
      ->check(CLI::Range(16, 4096))
      ->capture_default_str();
  verb->add_option("--only", gallery.only, "Of the figures 5a, 5b, 7, kinds, techniques")->type_name("LIST");
  verb->add_option("--lobster", gallery.lobster, "CT of the lobster, for figure 5b; without it the head is drawn")
      ->type_name("VOLUME");
  verb->add_option("--data", gallery.data, "Where smurf's data is; by default found beside the program")
      ->type_name("DIR");
  add_device(verb, gallery.device);
  add_output(verb, gallery.output, "DIR", "Folder for pictures and index.html; made where it is not there");
  chosen(verb, [this] { run_gallery(gallery, common); });
}

void CommandLine::declare_compare(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("compare",
                                      "Trilinear, Catmull-Rom and tricubic reconstruction of an equation's samples "
                                      "against the exact surface: errors and their order. Of a stream surface: the "
                                      "ways to normals and curvature against integrated ones");
  verb->add_option("surface", compare.surface,
                   "An implicit surface, an isosurface whose field is an expression, or a stream surface (JSON)")
      ->type_name("SURFACE.json")
      ->required();
  std::vector<CLI::Option*> of_samples;
  of_samples.push_back(
      verb->add_option("--resolutions", compare.resolutions, "Nodes along each axis of the domain, ascending")
          ->type_name("N,N,...")
          ->capture_default_str());
  verb->add_option("--rays", compare.rays,
                   "Random chords of the domain, or of a stream surface's bounds: isotropic lines, so that their hits "
                   "spread evenly")
      ->type_name("N")
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  verb->add_option("--seed", compare.seed, "Of the chords")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  of_samples.push_back(verb->add_option("--apron", compare.apron,
                                        "Nodes more beyond each face of the domain: the border of a grid, where "
                                        "samples are continued by mirroring, "
                                        "spoils the order of a B-spline over a dozen nodes")
                           ->type_name("N")
                           ->capture_default_str());
  of_samples.push_back(
      verb->add_option(
              "--margin", compare.margin,
              "Hits nearer than this to the border of the domain, in world units, are left out at every resolution; by "
              "default the edge of a cell of the coarsest grid, or an eighth of the domain's shortest edge if that is "
              "less")
          ->type_name("LENGTH"));
  add_device(verb, compare.device);
  verb->add_option("-o,--output", compare.output, "Write the table to this file, too")->type_name("TABLE.csv");
  chosen(verb, [this, of_samples] {
    for (const CLI::Option* option : of_samples) compare.asks_for_samples |= option->count() > 0;
    run_compare(compare, common);
  });
}

void CommandLine::declare_bench(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("bench", "Throughput on every device found");
  verb->add_option("--filter", bench.filter, "Only workloads whose name contains this")->type_name("NAME");
  verb->add_option("--json", bench.json, "Write the results to this file, too")->type_name("FILE");
  verb->add_option("--device", bench.devices, "Only these devices")->type_name("D");
  verb->final_callback([this] {
    bench.quiet = common.quiet;
    run = [this] { return run_bench(bench); };
  });
}

int run(int argc, char** argv) {
  CLI::App app("Batched ray, normal and curvature queries on surfaces", "smurf");
  CommandLine command_line;
  command_line.declare(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    return fail(exit_usage, fmt::format("{} (smurf --help tells more)", error.what()));
  }
  return command_line.run();
}

}  // namespace

}  // namespace smurf

int main(int argc, char** argv) {
  using namespace smurf;
  try {
    return run(argc, argv);
  } catch (const Error& error) {
    return fail(exit_code_of(error), error.what());
  } catch (const std::bad_alloc&) {
    return fail(exit_failure, "not enough memory on the host");
  } catch (const std::exception& error) {
    return fail(exit_failure, fmt::format("unexpected failure: {}", error.what()));
  }
}
