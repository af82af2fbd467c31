#include "io/writers/path_file.hpp"

#include <cstdint>
#include <vector>

#include "io/writers/csv_writer.hpp"
#include "io/writers/vtk_xml.hpp"

namespace smurf {
namespace {

void write_csv(const Paths& paths, std::span<const std::string_view> names, const std::filesystem::path& file) {
  CsvWriter out(file);
  const bool located = names.size() == 3 && paths.coordinates.size() == paths.status.size();
  out.put("path,step,status,x,y,z");
  for (const std::string_view name : names) {
    if (!located || name.empty()) continue;
    out.put(',');
    out.put(name);
  }
  out.end_line();
  for (std::size_t path = 0; path < paths.size(); path++) {
    for (std::size_t row = paths.offsets[path]; row < paths.offsets[path + 1]; row++) {
      out.cell(std::uint64_t(path));
      out.put(',');
      out.cell(paths.steps[row]);
      out.put(',');
      out.put(name_of(paths.status[row]));
      for (int axis = 0; axis < 3; axis++) {
        out.put(',');
        out.cell(paths.locations[row][axis]);
      }
      if (located) {
        const SurfaceCoordinates& at = paths.coordinates[row];
        if (!names[0].empty()) {
          out.put(',');
          out.cell(at.part);
        }
        out.put(',');
        out.cell(at.u);
        out.put(',');
        out.cell(at.v);
      }
      out.end_line();
    }
  }
  out.commit();
}

// Paths of one row, then the others: VTK counts vertices before lines.
struct Cells {
  std::vector<std::uint32_t> paths;  // in the order of cells
  std::size_t vertices = 0;

  explicit Cells(const Paths& from) {
    for (const bool single : {true, false}) {
      for (std::size_t i = 0; i < from.size(); i++) {
        if ((from.offsets[i + 1] - from.offsets[i] == 1) == single) paths.push_back(std::uint32_t(i));
      }
      if (single) vertices = paths.size();
    }
  }
};

// Cells begin .. end - 1.
void put_cells(VtkXmlWriter& xml, const char* tag, const Paths& paths, const Cells& cells, std::size_t begin,
               std::size_t end) {
  std::vector<std::int64_t> rows, ends;
  for (std::size_t cell = begin; cell < end; cell++) {
    const std::size_t path = cells.paths[cell];
    for (std::uint64_t row = paths.offsets[path]; row < paths.offsets[path + 1]; row++)
      rows.push_back(std::int64_t(row));
    ends.push_back(std::int64_t(rows.size()));
  }
  xml.open(tag);
  xml.array<std::int64_t>("connectivity", 1, rows.size(), [&](std::size_t i) { return rows[i]; });
  xml.array<std::int64_t>("offsets", 1, ends.size(), [&](std::size_t i) { return ends[i]; });
  xml.close();
}

void write_vtp(const Paths& paths, const std::filesystem::path& file) {
  VtkXmlWriter xml(file, "PolyData");
  const Cells cells(paths);
  const std::size_t rows = paths.status.size();
  xml.open(
      "Piece",
      {{"NumberOfPoints", rows}, {"NumberOfVerts", cells.vertices}, {"NumberOfLines", paths.size() - cells.vertices}});
  xml.open("PointData");
  xml.array<std::uint32_t>("step", 1, rows, [&](std::size_t i) { return paths.steps[i]; });
  xml.words("status", rows, [&](std::size_t i) { return name_of(paths.status[i]); });
  xml.close();
  xml.open("CellData");
  xml.array<std::uint32_t>("path", 1, paths.size(), [&](std::size_t i) { return cells.paths[i]; });
  xml.words("end", paths.size(),
            [&](std::size_t i) { return name_of(paths.status[paths.offsets[cells.paths[i] + 1] - 1]); });
  xml.close();
  xml.open("Points");
  xml.array<float>("Points", 3, 3 * rows, [&](std::size_t i) { return paths.locations[i / 3][int(i % 3)]; });
  xml.close();
  put_cells(xml, "Verts", paths, cells, 0, cells.vertices);
  put_cells(xml, "Lines", paths, cells, cells.vertices, paths.size());
  xml.commit();
}

}  // namespace

void write_paths(const Paths& paths, std::span<const std::string_view> coordinate_names,
                 const std::filesystem::path& file) {
  if (file.extension() == ".vtp") write_vtp(paths, file);
  else write_csv(paths, coordinate_names, file);
}

}  // namespace smurf
