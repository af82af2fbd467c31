#include "io/writers/line_file.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include "io/writers/csv_writer.hpp"
#include "io/writers/vtk_xml.hpp"

namespace smurf {

FlowStatus row_status(const Streamlines& lines, std::size_t line, std::size_t row) {
  const std::size_t first = lines.offsets[line], last = lines.offsets[line + 1] - 1;
  const bool both = lines.beginning[line] != FlowStatus::inside;
  const bool ends_first = !both && std::abs(lines.times[first]) > std::abs(lines.times[last]);
  if (row == (ends_first ? first : last)) return lines.end[line];
  return both && row == first ? lines.beginning[line] : FlowStatus::inside;
}

namespace {

// The k-th row of a line in order of t. Lines that were traced back are stored from the seed on.
class Rows {
 public:
  Rows(const Streamlines& lines, std::size_t line)
      : first_(lines.offsets[line]),
        last_(lines.offsets[line + 1] - 1),
        reversed_(lines.times[last_] < lines.times[first_]) {}
  std::size_t size() const { return last_ - first_ + 1; }
  std::size_t operator[](std::size_t k) const { return reversed_ ? last_ - k : first_ + k; }

 private:
  std::size_t first_, last_;
  bool reversed_;
};

void put_vector(CsvWriter& out, const glm::vec3& v) {
  for (int c = 0; c < 3; c++) {
    out.put(',');
    out.cell(v[c]);
  }
}

void write_csv(const Streamlines& lines, const std::filesystem::path& file) {
  CsvWriter out(file);
  out.put("line,t,status,x,y,z");
  if (!lines.first.empty()) out.put(",ux,uy,uz");
  if (!lines.second.empty()) out.put(",uux,uuy,uuz");
  out.end_line();
  for (std::size_t line = 0; line < lines.size(); line++) {
    const Rows rows(lines, line);
    for (std::size_t k = 0; k < rows.size(); k++) {
      const std::size_t row = rows[k];
      out.cell(std::uint64_t(line));
      out.put(',');
      out.cell(lines.times[row]);
      out.put(',');
      out.put(name_of(row_status(lines, line, row)));
      put_vector(out, lines.positions[row]);
      if (!lines.first.empty()) put_vector(out, lines.first[row]);
      if (!lines.second.empty()) put_vector(out, lines.second[row]);
      out.end_line();
    }
  }
  out.commit();
}

// Lines of one position, then the others: VTK counts vertices before lines.
struct Cells {
  std::vector<std::uint32_t> lines;  // in the order of cells
  std::size_t vertices = 0;

  explicit Cells(const Streamlines& from) {
    for (const bool single : {true, false}) {
      for (std::size_t i = 0; i < from.size(); i++) {
        if ((from.offsets[i + 1] - from.offsets[i] == 1) == single) lines.push_back(std::uint32_t(i));
      }
      if (single) vertices = lines.size();
    }
  }
};

// Cells begin .. end - 1.
void put_cells(VtkXmlWriter& xml, const char* tag, const Streamlines& lines, const Cells& cells, std::size_t begin,
               std::size_t end) {
  const auto size = [&](std::size_t cell) { return Rows(lines, cells.lines[cell]).size(); };
  std::size_t total = 0;
  for (std::size_t cell = begin; cell < end; cell++) total += size(cell);
  xml.open(tag);
  std::size_t cell = begin, k = 0;
  xml.array<std::int64_t>("connectivity", 1, total, [&](std::size_t) {
    if (k == size(cell)) {
      cell++;
      k = 0;
    }
    return Rows(lines, cells.lines[cell])[k++];
  });
  std::size_t offset = 0;
  xml.array<std::int64_t>("offsets", 1, end - begin, [&](std::size_t i) { return offset += size(begin + i); });
  xml.close();
}

void put_vectors(VtkXmlWriter& xml, const char* name, const Values<glm::vec3>& vectors) {
  xml.array<float>(name, 3, 3 * vectors.size(), [&](std::size_t i) { return vectors[i / 3][int(i % 3)]; });
}

void write_vtp(const Streamlines& lines, const std::filesystem::path& file) {
  VtkXmlWriter xml(file, "PolyData");
  const Cells cells(lines);
  xml.open("Piece", {{"NumberOfPoints", lines.positions.size()},
                     {"NumberOfVerts", cells.vertices},
                     {"NumberOfLines", lines.size() - cells.vertices}});
  xml.open("PointData");
  xml.array<float>("t", 1, lines.times.size(), [&](std::size_t i) { return lines.times[i]; });
  // The words are asked for twice, each time in order.
  std::size_t line = 0;
  xml.words("status", lines.times.size(), [&](std::size_t row) {
    if (row == 0) line = 0;
    while (row >= lines.offsets[line + 1]) line++;
    return name_of(row_status(lines, line, row));
  });
  if (!lines.first.empty()) put_vectors(xml, "u", lines.first);
  if (!lines.second.empty()) put_vectors(xml, "uu", lines.second);
  xml.close();
  xml.open("CellData");
  xml.array<std::uint32_t>("line", 1, lines.size(), [&](std::size_t i) { return cells.lines[i]; });
  xml.words("end", lines.size(), [&](std::size_t i) { return name_of(lines.end[cells.lines[i]]); });
  xml.words("beginning", lines.size(), [&](std::size_t i) { return name_of(lines.beginning[cells.lines[i]]); });
  xml.close();
  xml.open("Points");
  put_vectors(xml, "Points", lines.positions);
  xml.close();
  put_cells(xml, "Verts", lines, cells, 0, cells.vertices);
  put_cells(xml, "Lines", lines, cells, cells.vertices, lines.size());
  xml.commit();
}

}  // namespace

void write_lines(const Streamlines& lines, const std::filesystem::path& file) {
  if (file.extension() == ".vtp") write_vtp(lines, file);
  else write_csv(lines, file);
}

}  // namespace smurf
