// The verb `lines`: from points on a surface to lines of curvature.
#include "smurf/curvature_lines.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/session.hpp"
#include "io/ray_table.hpp"
#include "io/result_table.hpp"
#include "io/writers/vtk_xml.hpp"
#include "smurf/error.hpp"
#include "smurf/surface.hpp"

namespace smurf {
namespace {

// The number of each row's line, and of the row in it.
struct Numbers {
  std::vector<std::uint32_t> line, step;
  explicit Numbers(const CurvatureLines& lines) {
    for (std::size_t i = 0; i < lines.size(); i++) {
      for (std::size_t row = lines.offsets[i]; row < lines.offsets[i + 1]; row++) {
        line.push_back(std::uint32_t(i));
        step.push_back(std::uint32_t(row - lines.offsets[i]));
      }
    }
  }
};

void write_csv_lines(const CurvatureLines& lines, const std::filesystem::path& file) {
  const Numbers numbers(lines);
  std::vector<std::string_view> status;
  for (const CurvatureLineStatus s : lines.status) status.push_back(name_of(s));
  Table table;
  table.add("line", numbers.line);
  table.add("step", numbers.step);
  table.add("status", status);
  table.add({"x", "y", "z"}, lines.positions);
  table.add("k1", lines.k1);
  table.add("k2", lines.k2);
  table.add("arc", lines.arcs);
  write_csv(table, file);
}

// Lines begin .. end - 1 of `order` as cells.
void put_cells(VtkXmlWriter& xml, const char* tag, const CurvatureLines& lines, std::span<const std::uint32_t> order) {
  std::vector<std::size_t> rows, ends;
  for (const std::uint32_t line : order) {
    for (std::size_t row = lines.offsets[line]; row < lines.offsets[line + 1]; row++) rows.push_back(row);
    ends.push_back(rows.size());
  }
  xml.open(tag);
  xml.array<std::int64_t>("connectivity", 1, rows.size(), [&](std::size_t i) { return rows[i]; });
  xml.array<std::int64_t>("offsets", 1, ends.size(), [&](std::size_t i) { return ends[i]; });
  xml.close();
}

void write_vtp_lines(const CurvatureLines& lines, const std::filesystem::path& file) {
  // VTK counts vertices, which lines of one row are, before lines.
  std::vector<std::uint32_t> order;
  std::size_t vertices = 0;
  for (const bool single : {true, false}) {
    for (std::size_t i = 0; i < lines.size(); i++) {
      if ((lines.offsets[i + 1] - lines.offsets[i] == 1) == single) order.push_back(std::uint32_t(i));
    }
    if (single) vertices = order.size();
  }
  const std::size_t rows = lines.positions.size();
  VtkXmlWriter xml(file, "PolyData");
  xml.open("Piece",
           {{"NumberOfPoints", rows}, {"NumberOfVerts", vertices}, {"NumberOfLines", lines.size() - vertices}});
  xml.open("PointData");
  xml.array<float>("arc", 1, rows, [&](std::size_t i) { return lines.arcs[i]; });
  xml.array<float>("k1", 1, rows, [&](std::size_t i) { return lines.k1[i]; });
  xml.array<float>("k2", 1, rows, [&](std::size_t i) { return lines.k2[i]; });
  xml.words("status", rows, [&](std::size_t i) { return name_of(lines.status[i]); });
  xml.close();
  xml.open("CellData");
  xml.array<std::uint32_t>("line", 1, order.size(), [&](std::size_t i) { return order[i]; });
  xml.close();
  xml.open("Points");
  xml.array<float>("Points", 3, 3 * rows, [&](std::size_t i) { return lines.positions[i / 3][int(i % 3)]; });
  xml.close();
  put_cells(xml, "Verts", lines, std::span(order).first(vertices));
  put_cells(xml, "Lines", lines, std::span(order).subspan(vertices));
  xml.commit();
}

// What became of the lines: how many end by what.
std::string ends_of(const CurvatureLines& lines) {
  std::array<std::size_t, std::size_t(CurvatureLineStatus::steps) + 1> counts{};
  for (std::size_t i = 0; i < lines.size(); i++) counts[std::size_t(lines.status[lines.offsets[i + 1] - 1])]++;
  std::string text;
  for (std::size_t s = 0; s < counts.size(); s++) {
    if (counts[s] > 0)
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name_of(CurvatureLineStatus(s)), counts[s]);
  }
  return text;
}

}  // namespace

void run_lines(const LinesCommand& command, const CommonOptions& common) {
  check_output(command.output, {".csv", ".vtp"});
  const Surface surface = load_surface(command.surface);
  const PointTable points = read_points(command.points);
  const Device device = open(command.device, common);
  const Interrogator query = prepare(device, surface, command.surface, common);

  const Stopwatch watch;
  CurvatureLines lines;
  {
    Progress progress("following lines of curvature", common.quiet);
    CurvatureLineOptions options;
    options.principal = command.principal;
    options.length = command.length;
    options.both = command.both;
    if (command.step) options.step = *command.step;
    options.progress = progress.callback();
    lines = curvature_lines(query, surface.bounds(), points.points, options);
  }
  const double seconds = watch.seconds();
  if (command.output.extension() == ".vtp") write_vtp_lines(lines, command.output);
  else write_csv_lines(lines, command.output);
  if (common.verbose)
    fmt::print(stderr, "lines: {}, of {} rows; they end by {}\n", lines.size(), lines.positions.size(), ends_of(lines));
  report(device, common, "rows", lines.positions.size(), seconds);
}

}  // namespace smurf
