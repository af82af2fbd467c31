// Result tables: named columns of equal length, written as CSV or as VTK XML PolyData.
//
//   Table table;
//   table.add("ray", hits.rays());
//   table.add("status", words);                               // std::vector<std::string_view>
//   table.add({"x", "y", "z"}, hits.locations());             // three columns
//   write_table(table, "hits.csv");                           // .vtp: VTK XML
//
// Columns are views: what they show must outlive the table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "smurf/interrogator.hpp"

namespace smurf {

// Every stride-th element of an array.
template <class T>
struct Strided {
  const T* first = nullptr;
  std::size_t stride = 1;
  const T& operator[](std::size_t index) const { return first[index * stride]; }
};

struct TableColumn {
  std::string name;
  std::variant<Strided<float>, Strided<std::uint32_t>, Strided<std::uint64_t>, Strided<std::string_view>> values;
};

class Table {
 public:
  // Throws std::logic_error when the length differs from that of the columns before, or the name is taken.
  void add(std::string_view name, std::span<const float> values);
  void add(std::string_view name, std::span<const std::uint32_t> values);
  void add(std::string_view name, std::span<const std::uint64_t> values);
  void add(std::string_view name, std::span<const std::string_view> values);
  void add(const std::array<std::string_view, 2>& names, std::span<const glm::vec2> values);
  void add(const std::array<std::string_view, 3>& names, std::span<const glm::vec3> values);
  // Of part, u and v, as the kind calls them (SurfaceDefinition::coordinate_names); a part without a name is left out.
  void add(std::span<const std::string_view> names, std::span<const SurfaceCoordinates> values);

  std::size_t rows() const { return rows_; }
  const std::vector<TableColumn>& columns() const { return columns_; }

 private:
  template <class T>
  void append(std::string_view name, const T* first, std::size_t stride, std::size_t count);

  std::size_t rows_ = 0;
  std::vector<TableColumn> columns_;
};

// Each is written whole or not at all, and throws Error (io) when that fails.

// A header line, then one line a row. Floats have the fewest digits that read back to the same float.
void write_csv(const Table& table, const std::filesystem::path& file);

// Points from columns x, y, z, one vertex cell each; every other column as point data, where three float columns
// in a row whose names differ by a final x, y, z become one array of three components named by what they share.
void write_vtp(const Table& table, const std::filesystem::path& file);

// VTK XML when the name ends in .vtp, CSV otherwise.
void write_table(const Table& table, const std::filesystem::path& file);

}  // namespace smurf
