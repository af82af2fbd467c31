#include "io/result_table.hpp"

#include <stdexcept>

#include "io/writers/csv_writer.hpp"

namespace smurf {

template <class T>
void Table::append(std::string_view name, const T* first, std::size_t stride, std::size_t count) {
  if (!columns_.empty() && count != rows_)
    throw std::logic_error("table column \"" + std::string(name) + "\" has another length than those before");
  for (const TableColumn& column : columns_)
    if (column.name == name) throw std::logic_error("table column \"" + std::string(name) + "\" stands twice");
  rows_ = count;
  columns_.push_back({std::string(name), Strided<T>{first, stride}});
}

void Table::add(std::string_view name, std::span<const float> values) { append(name, values.data(), 1, values.size()); }
void Table::add(std::string_view name, std::span<const std::uint32_t> values) {
  append(name, values.data(), 1, values.size());
}
void Table::add(std::string_view name, std::span<const std::uint64_t> values) {
  append(name, values.data(), 1, values.size());
}
void Table::add(std::string_view name, std::span<const std::string_view> values) {
  append(name, values.data(), 1, values.size());
}

void Table::add(const std::array<std::string_view, 2>& names, std::span<const glm::vec2> values) {
  static_assert(sizeof(glm::vec2) == 2 * sizeof(float));
  const float* first = reinterpret_cast<const float*>(values.data());
  for (std::size_t c = 0; c < 2; c++) append(names[c], values.empty() ? nullptr : first + c, 2, values.size());
}

void Table::add(const std::array<std::string_view, 3>& names, std::span<const glm::vec3> values) {
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
  const float* first = reinterpret_cast<const float*>(values.data());
  for (std::size_t c = 0; c < 3; c++) append(names[c], values.empty() ? nullptr : first + c, 3, values.size());
}

void Table::add(std::span<const std::string_view> names, std::span<const SurfaceCoordinates> values) {
  static_assert(sizeof(SurfaceCoordinates) == 3 * sizeof(float));
  if (names.size() != 3) throw std::logic_error("surface coordinates have three columns: part, u, v");
  const SurfaceCoordinates* first = values.data();
  if (!names[0].empty()) append(names[0], values.empty() ? nullptr : &first->part, 3, values.size());
  append(names[1], values.empty() ? nullptr : &first->u, 3, values.size());
  append(names[2], values.empty() ? nullptr : &first->v, 3, values.size());
}

void write_csv(const Table& table, const std::filesystem::path& file) {
  CsvWriter out(file);
  for (const TableColumn& column : table.columns()) {
    if (&column != &table.columns().front()) out.put(',');
    out.cell(std::string_view(column.name));
  }
  out.end_line();
  for (std::size_t row = 0; row < table.rows(); row++) {
    for (const TableColumn& column : table.columns()) {
      if (&column != &table.columns().front()) out.put(',');
      std::visit([&](const auto& values) { out.cell(values[row]); }, column.values);
    }
    out.end_line();
  }
  out.commit();
}

void write_table(const Table& table, const std::filesystem::path& file) {
  if (file.extension() == ".vtp") write_vtp(table, file);
  else write_csv(table, file);
}

}  // namespace smurf
