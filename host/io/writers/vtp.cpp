// Tables as VTK XML PolyData: a vertex a row.
#include <array>
#include <stdexcept>
#include <type_traits>

#include "io/result_table.hpp"
#include "io/writers/vtk_xml.hpp"

namespace smurf {
namespace {

void add_column(VtkXmlWriter& xml, const TableColumn& column, std::size_t rows) {
  std::visit(
      [&]<class T>(const Strided<T>& values) {
        const auto value = [&](std::size_t i) { return values[i]; };
        if constexpr (std::is_same_v<T, std::string_view>) xml.words(column.name, rows, value);
        else xml.array<T>(column.name, 1, rows, value);
      },
      column.values);
}

using FloatTriple = std::array<const Strided<float>*, 3>;

// The three columns from `first` on, when they are the x, y and z of one vector.
bool is_triple(const std::vector<TableColumn>& columns, std::size_t first, FloatTriple& triple) {
  if (first + 3 > columns.size()) return false;
  const std::string stem = columns[first].name.substr(0, columns[first].name.size() - 1);
  for (std::size_t c = 0; c < 3; c++) {
    triple[c] = std::get_if<Strided<float>>(&columns[first + c].values);
    if (triple[c] == nullptr || columns[first + c].name != stem + "xyz"[c]) return false;
  }
  return true;
}

// Where the points of a table are: the columns x, y, z.
FloatTriple points_of(const std::vector<TableColumn>& columns) {
  FloatTriple triple;
  for (std::size_t i = 0; i < columns.size(); i++)
    if (columns[i].name == "x" && is_triple(columns, i, triple)) return triple;
  throw std::logic_error("a table without float columns x, y, z cannot be written as points");
}

void add_triple(VtkXmlWriter& xml, const std::string& name, const FloatTriple& triple, std::size_t rows) {
  xml.array<float>(name, 3, 3 * rows, [&](std::size_t i) { return (*triple[i % 3])[i / 3]; });
}

}  // namespace

void write_vtp(const Table& table, const std::filesystem::path& file) {
  const std::vector<TableColumn>& columns = table.columns();
  const std::size_t rows = table.rows();
  const FloatTriple points = points_of(columns);
  VtkXmlWriter xml(file, "PolyData");
  xml.open("Piece", {{"NumberOfPoints", rows}, {"NumberOfVerts", rows}});
  xml.open("PointData");
  for (std::size_t i = 0; i < columns.size(); i++) {
    FloatTriple triple;
    if (!is_triple(columns, i, triple)) {
      add_column(xml, columns[i], rows);
      continue;
    }
    const std::string stem = columns[i].name.substr(0, columns[i].name.size() - 1);
    if (!stem.empty()) add_triple(xml, stem, triple, rows);
    i += 2;
  }
  xml.close();
  xml.open("Points");
  add_triple(xml, "Points", points, rows);
  xml.close();
  xml.open("Verts");
  xml.array<std::int64_t>("connectivity", 1, rows, [](std::size_t i) { return i; });
  xml.array<std::int64_t>("offsets", 1, rows, [](std::size_t i) { return i + 1; });
  xml.close();
  xml.commit();
}

}  // namespace smurf
