// The verb `gallery`: figures of the paper (Loeffelmann and others 1999) from bundled data, and a page that shows them.
// Pictures of one surface are made by the verb `render`, so that the command that the page tells is what was done.
#include "cli/gallery.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "cli/commands.hpp"
#include "cli/session.hpp"
#include "io/atomic_file.hpp"
#include "smurf/compare.hpp"
#include "smurf/curvature_lines.hpp"
#include "smurf/error.hpp"
#include "smurf/render.hpp"
#include "techniques/canvas.hpp"
#include "techniques/curvature/draw_lines.hpp"
#include "techniques/gallery/kinds.hpp"

namespace smurf {

namespace {

struct Gallery {
  const GalleryCommand& command;
  const CommonOptions& common;
  Device device;
  std::filesystem::path data;

  std::filesystem::path file(const std::string& name) const { return command.output / name; }
  std::string program(const std::string& rest) const {
    const std::string device_option = command.device.name == "opencl" ? "" : " --device " + command.device.name;
    return "smurf " + rest + device_option;
  }
};

std::string quoted(const std::filesystem::path& path) {
  const std::string text = path.string();
  return text.find_first_of(" '\"$&;()<>|*?#~`\\") == std::string::npos ? text : "'" + text + "'";
}

// A picture by the verb `render`, and the command that makes it.
void add_render(const Gallery& gallery, GalleryFigure& figure, RenderCommand command, const std::string& name,
                const std::string& caption) {
  command.output = gallery.file(name);
  command.size = fmt::format("{0}x{0}", gallery.command.size);
  command.device = gallery.command.device;
  run_render(command, gallery.common, gallery.device);
  std::string text = fmt::format("render {} --shade {} --size {}", quoted(command.surface),
                                 command.shades.value_or("phong"), command.size);
  const auto add = [&](const char* option, const std::optional<std::string>& value) {
    if (value) text += fmt::format(" {} {}", option, *value);
  };
  add("--up", command.up);
  add("--view", command.view);
  add("--range", command.range);
  figure.pictures.push_back(name);
  figure.captions.push_back(caption);
  figure.commands.push_back(gallery.program(text + " -o " + quoted(command.output)));
}

RenderCommand of_head(const Gallery& gallery) {
  RenderCommand command;
  command.surface = gallery.data / "headsq.json";
  command.up = "0,0,-1";  // the scan's slices run from the crown down
  return command;
}

GalleryFigure make_crosses(const Gallery& gallery) {
  GalleryFigure figure;
  figure.title = "Figure 5a: crosses aligned to the principal directions";
  figure.text =
      "Skin of a CT head (isovalue 500, tricubic). Red along the greater principal curvature, blue along the "
      "lesser one; none where the directions are arbitrary.";
  RenderCommand command = of_head(gallery);
  command.shades = "phong,crosses";
  add_render(gallery, figure, command, "figure-5a.png", "crosses");
  return figure;
}

GalleryFigure make_contours(const Gallery& gallery) {
  GalleryFigure figure;
  figure.title = "Figure 5b: contours";
  std::filesystem::path lobster = gallery.command.lobster.value_or("");
  std::error_code failed;
  for (const char* name : {"lobster.nhdr", "lobster.nrrd"}) {
    if (lobster.empty() && std::filesystem::is_regular_file(gallery.data / name, failed)) lobster = gallery.data / name;
  }
  RenderCommand command = of_head(gallery);
  figure.text = "The code of Figure 6: 1 - (-d.n) where -d.n < 0.6, else 0. ";
  if (lobster.empty()) {
    figure.text += "Drawn of the head, as no lobster.nhdr was found or given (--lobster).";
  } else {
    figure.text += "CT of a lobster, isovalue 40.5, tricubic.";
    const std::string name = "lobster.json";
    write_file(gallery.file(name),
               fmt::format("{{\"kind\": \"isosurface\", \"isovalue\": 40.5,\n \"field\": {{\"kind\": "
                           "\"grid\", \"file\": \"{}\", \"reconstruction\": \"tricubic\"}}}}\n",
                           std::filesystem::absolute(lobster).string()));
    command = {};
    command.surface = gallery.file(name);
    command.view = "top";
  }
  command.shades = "contour";
  add_render(gallery, figure, command, "figure-5b.png", "contours");
  return figure;
}

// Samples as a NRRD file, and descriptions of the isosurface of them, by linear and by cubic reconstruction:
// NAME-linear.json and NAME-cubic.json.
void write_sampled(const Gallery& gallery, const SampledField& samples, const std::string& figure) {
  const Volume& volume = samples.volume;
  const GridPlacement& placement = volume.placement();
  const auto vector = [](const glm::dvec3& v) { return fmt::format("({},{},{})", v.x, v.y, v.z); };
  std::string bytes = fmt::format(
      "NRRD0004\ntype: float\ndimension: 3\nspace dimension: 3\nsizes: {} {} {}\nspace directions: {} {} {}\n"
      "space origin: {}\nendian: little\nencoding: raw\n\n",
      volume.size().x, volume.size().y, volume.size().z, vector(placement.axes[0]), vector(placement.axes[1]),
      vector(placement.axes[2]), vector(placement.origin));
  bytes.append(static_cast<const char*>(volume.samples()), volume.bytes());
  write_file(gallery.file(figure + ".nrrd"), bytes);
  for (const auto& [name, reconstruction] : {std::pair("linear", "trilinear"), {"cubic", "tricubic"}}) {
    write_file(gallery.file(fmt::format("{}-{}.json", figure, name)),
               fmt::format("{{\"kind\": \"isosurface\", \"isovalue\": {},\n \"field\": {{\"kind\": \"grid\", \"file\": "
                           "\"{}.nrrd\", \"reconstruction\": \"{}\"}}}}\n",
                           samples.isovalue, figure, reconstruction));
  }
}

GalleryFigure make_curvature_plots(const Gallery& gallery) {
  constexpr int nodes = 96;
  GalleryFigure figure;
  figure.title = "Figure 7: Gauss curvature, linear and cubic reconstruction against the function";
  figure.text = fmt::format(
      "The test signal of Marschner and Lobb (1994) with f = 3, isovalue 0.5: {0} x {0} x {0} samples of "
      "it, and the function itself.",
      nodes);
  const std::filesystem::path analytic = gallery.file("figure-7-analytic.json");
  write_file(analytic,
             "{\"kind\": \"isosurface\", \"isovalue\": 0.5, \"field\": {\"kind\": \"expression\",\n"
             " \"value\": \"(1-sin(pi*z/2)+a*(1+cos(2*pi*f*cos(pi*sqrt(x^2+y^2)/2))))/(2*(1+a))\",\n"
             " \"parameters\": {\"f\": 3, \"a\": 0.25}, \"domain\": [[-1, -1, -1], [1, 1, 1]]}}\n");
  const Surface surface = load_surface(analytic);
  write_sampled(gallery, sample_field(surface, glm::ivec3(nodes)), "figure-7");

  CompareOptions options;
  options.resolutions = {nodes};
  options.reconstructions = {Reconstruction::trilinear, Reconstruction::tricubic};
  options.rays = 400;
  const Comparison comparison = compare(gallery.device, surface, options);
  figure.head = {"reconstruction", "location, rms", "normal, rad, rms", "mean curvature, rms", "Gauss curvature, rms"};
  for (const ComparisonRow& row : comparison.rows) {
    const auto number = [](const ErrorMeasure& measure) { return fmt::format("{:.2e}", measure.rms); };
    figure.rows.push_back({std::string(name_of(row.reconstruction)), number(row.location), number(row.normal),
                           number(row.mean), number(row.gauss)});
  }
  figure.rows.push_back({"size of the exact one, rms", "", "", fmt::format("{:.3g}", comparison.mean_rms),
                         fmt::format("{:.3g}", comparison.gauss_rms)});

  const double bound = std::max(1.0, std::round(comparison.gauss_rms));
  for (const char* name : {"linear", "cubic", "analytic"}) {
    RenderCommand command;
    command.surface = gallery.file(fmt::format("figure-7-{}.json", name));
    command.shades = "gauss,phong";
    command.view = "iso";
    command.range = fmt::format("{:g},{:g}", -bound, bound);
    add_render(gallery, figure, command, fmt::format("figure-7-{}.png", name), name);
  }
  figure.commands.push_back(
      gallery.program(fmt::format("compare {} --resolutions {} --rays {}", quoted(analytic), nodes, options.rays)));
  return figure;
}

// Lines of the cylinder's greater curvature are circles: how far they leave the plane of their seed and the cylinder.
double off_circles(const CurvatureLines& lines) {
  double greatest = 0;
  for (std::size_t line = 0; line < lines.size(); line++) {
    const glm::dvec3 seed(lines.positions[lines.offsets[line]]);
    for (std::size_t row = lines.offsets[line]; row < lines.offsets[line + 1]; row++) {
      const glm::dvec3 p(lines.positions[row]);
      greatest = std::max({greatest, std::abs(p.z - seed.z), std::abs(std::hypot(p.x, p.y) - 1)});
    }
  }
  return greatest;
}

GalleryFigure make_curvature_lines(const Gallery& gallery) {
  constexpr int nodes = 24, lines = 9;
  const double length = 2 * std::numbers::pi;
  GalleryFigure figure;
  figure.title = "Figure 8: lines of curvature on a sampled cylinder, linear and cubic reconstruction";
  figure.text = fmt::format(
      "The distance to an axis at {0} x {0} x {0} nodes, radius 1 in a box of 3. The lines should be circles.", nodes);
  const Surface exact = implicit("sqrt(x^2+y^2)-1", {glm::dvec3(-1.5), glm::dvec3(1.5)});
  write_sampled(gallery, sample_field(exact, glm::ivec3(nodes)), "figure-8");
  std::string seeds = "x,y,z\n";
  std::vector<glm::vec3> places;
  for (int i = 0; i < lines; i++) {
    places.emplace_back(0.6f, -0.8f, -1.2f + 0.3f * float(i));
    seeds += fmt::format("{},{},{}\n", places.back().x, places.back().y, places.back().z);
  }
  const std::filesystem::path points = gallery.file("figure-8-seeds.csv");
  write_file(points, seeds);
  figure.head = {"reconstruction", "lines are off circles by at most"};
  for (const char* name : {"linear", "cubic"}) {
    LinesCommand command;
    command.surface = gallery.file(fmt::format("figure-8-{}.json", name));
    command.points = points;
    command.output = gallery.file(fmt::format("figure-8-{}.vtp", name));
    command.length = length;
    command.device = gallery.command.device;
    run_lines(command, gallery.common);
    figure.commands.push_back(
        gallery.program(fmt::format("lines {} --points {} --length {:.7g} -o {}", quoted(command.surface),
                                    quoted(points), length, quoted(command.output))));

    const Surface surface = load_surface(command.surface);
    const Interrogator query(gallery.device, surface);
    RenderOptions options;
    options.camera = camera_from(View::usual, {0, 0, 1}, {glm::dvec3(-1, -1, -1.5), glm::dvec3(1, 1, 1.5)},
                                 gallery.command.size, gallery.command.size);
    Image picture = render(query, options);
    const CurvatureLines found = curvature_lines(query, surface.bounds(), places, {.length = length});
    draw_curvature_lines(query, options.camera, found, {0.45f, 0.05f, 0.08f}, picture);
    const std::string file = fmt::format("figure-8-{}.png", name);
    save_png(picture, gallery.file(file));
    figure.pictures.push_back(file);
    figure.captions.emplace_back(name);
    figure.rows.push_back({name, fmt::format("{:.2e}", off_circles(found))});
  }
  return figure;
}

void paste(Image& sheet, const Image& tile, int left, int top) {
  for (int y = 0; y < tile.height; y++) {
    const std::uint8_t* row = &tile.rgba[std::size_t(y) * std::size_t(tile.width) * 4];
    const std::size_t place = std::size_t(top + y) * std::size_t(sheet.width) + std::size_t(left);
    std::copy(row, row + std::ptrdiff_t(tile.width) * 4, sheet.rgba.begin() + std::ptrdiff_t(place * 4));
  }
}

double mean_difference(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgba.size(); i++) sum += std::abs(int(a.rgba[i]) - int(b.rgba[i]));
  return sum / (255.0 * 0.75 * double(a.rgba.size()));  // alpha does not differ
}

GalleryFigure make_kinds(const Gallery& gallery) {
  constexpr int columns = 4;
  GalleryFigure figure;
  figure.title = "One technique on every kind of surface";
  figure.text =
      "A torus as samples on a grid, an equation, a black box, expressions in u and v, a NURBS patch, a stream "
      "surface and a mesh: Gauss curvature, light and crosses by the same code.";
  const std::vector<SurfaceOfKind> kinds = surfaces_of_every_kind(1, 0.4);
  const int tile = std::max(32, gallery.command.size / 2), rows = (int(kinds.size()) + columns - 1) / columns;
  RenderOptions options;
  options.camera = camera_from(View::iso, {0, 0, 1}, {{-1.4, -1.4, -0.4}, {1.4, 1.4, 0.4}}, tile, tile);
  options.shades = shades_named("gauss,phong,crosses");
  options.range = ValueRange{-4, 4};
  options.legend = false;
  Image sheet{columns * tile, rows * tile, {}};
  sheet.rgba.assign(std::size_t(sheet.width) * std::size_t(sheet.height) * 4, 255);
  std::vector<Image> pictures;
  std::vector<double> times;
  for (const SurfaceOfKind& kind : kinds) {
    const Interrogator query(gallery.device, kind.surface);
    const Stopwatch watch;
    pictures.push_back(render(query, options));
    times.push_back(watch.seconds());
  }
  figure.head = {"kind", "mean difference from the equation's picture", "seconds"};
  Canvas canvas(sheet);
  const int dot = std::max(1, tile / 200);
  for (std::size_t i = 0; i < kinds.size(); i++) {
    const int left = int(i) % columns * tile, top = int(i) / columns * tile;
    paste(sheet, pictures[i], left, top);
    canvas.text(left + 4 * dot, top + 4 * dot, kinds[i].name, dot);
    figure.rows.push_back({kinds[i].name, fmt::format("{:.3f} %", 100 * mean_difference(pictures[i], pictures[1])),
                           fmt::format("{:.2f}", times[i])});
  }
  save_png(sheet, gallery.file("kinds.png"));
  figure.pictures = {"kinds.png"};
  figure.captions = {"gauss,phong,crosses"};
  figure.commands = {gallery.program(
      fmt::format("gallery --only kinds --size {} -o {}", gallery.command.size, quoted(gallery.command.output)))};
  return figure;
}

GalleryFigure make_techniques(const Gallery& gallery) {
  GalleryFigure figure;
  figure.title = "Techniques on one surface";
  figure.text =
      "The head by what else there is: strokes along the stronger curvature, ridges and valleys, outlines, "
      "opacity by curvature.";
  for (const char* shades : {"strokes", "ridges", "silhouette", "curvature-opacity"}) {
    RenderCommand command = of_head(gallery);
    command.shades = shades;
    add_render(gallery, figure, command, fmt::format("head-{}.png", shades), shades);
  }
  return figure;
}

struct NamedFigure {
  std::string_view name;
  GalleryFigure (*make)(const Gallery& gallery);
};

// In the order of the page. A figure more is a line more.
constexpr NamedFigure figures[] = {
    {"5a", make_crosses},        {"5b", make_contours}, {"7", make_curvature_plots},
    {"8", make_curvature_lines}, {"kinds", make_kinds}, {"techniques", make_techniques},
};

std::vector<NamedFigure> chosen(const std::optional<std::string>& only) {
  if (!only) return {std::begin(figures), std::end(figures)};
  std::vector<std::string> names;
  for (std::size_t start = 0; start <= only->size();) {
    const std::size_t end = std::min(only->find(',', start), only->size());
    names.push_back(only->substr(start, end - start));
    if (std::ranges::find(figures, names.back(), &NamedFigure::name) == std::end(figures)) {
      std::string known;
      for (const NamedFigure& figure : figures) known += fmt::format("{}{}", known.empty() ? "" : ", ", figure.name);
      throw Error(ErrorCode::usage, fmt::format("unknown figure \"{}\"; known are {}", names.back(), known));
    }
    start = end + 1;
  }
  std::vector<NamedFigure> wanted;
  for (const NamedFigure& figure : figures) {
    if (std::ranges::find(names, figure.name) != names.end()) wanted.push_back(figure);
  }
  return wanted;
}

}  // namespace

void run_gallery(const GalleryCommand& command, const CommonOptions& common) {
  const std::vector<NamedFigure> wanted = chosen(command.only);
  const std::filesystem::path data = data_folder(command.data);
  if (command.lobster && !std::filesystem::is_regular_file(*command.lobster))
    throw Error(ErrorCode::usage, fmt::format("--lobster: there is no file {}", command.lobster->string()));
  std::error_code failed;
  std::filesystem::create_directories(command.output, failed);
  if (!std::filesystem::is_directory(command.output)) {
    throw Error(ErrorCode::usage, fmt::format("cannot write to {}: {}", command.output.string(),
                                              failed ? failed.message() : "it is no folder"));
  }
  const Gallery gallery{command, common, open(command.device, common), data};
  const Stopwatch total;
  std::vector<GalleryFigure> made(wanted.size());
  for (std::size_t i = 0; i < wanted.size(); i++) {
    const Stopwatch watch;
    GalleryFigure& figure = made[i];
    figure = wanted[i].make(gallery);
    figure.seconds = watch.seconds();
    fmt::print("{} ({:.2f} s)\n", figure.title, figure.seconds);
    if (!figure.head.empty()) {
      std::vector<std::vector<std::string>> rows = figure.rows;
      rows.insert(rows.begin(), figure.head);
      for (const auto& row : rows) {
        std::string line;
        for (const std::string& cell : row) line += fmt::format("  {:<26}", cell);
        fmt::print("{}\n", line.substr(0, line.find_last_not_of(' ') + 1));
      }
    }
  }
  const DeviceInfo& info = gallery.device.info();
  const std::string page = "index.html";
  write_file(gallery.file(page), gallery_page(made, fmt::format("{}, {}", info.executor, info.name)));
  fmt::print("{} in {:.1f} s\n", gallery.file(page).string(), total.seconds());
}

}  // namespace smurf
