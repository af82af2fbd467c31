#include "io/result_table.hpp"

#include <charconv>
#include <cmath>
#include <stdexcept>

#include "io/atomic_file.hpp"

namespace smurf {
namespace {

// Gathers text and hands it to the file in large pieces.
class CsvWriter {
 public:
  explicit CsvWriter(const std::filesystem::path& file) : file_(file) { buffer_.reserve(capacity + 4096); }

  void put(char c) { buffer_.push_back(c); }
  void cell(std::uint64_t value) { number(value); }
  void cell(std::uint32_t value) { number(value); }
  void cell(float value) {
    if (std::isnan(value)) buffer_ += "nan";  // without a sign that means nothing
    else number(value);
  }
  void cell(std::string_view text) {
    if (text.find_first_of(",\"\r\n") == text.npos) {
      buffer_ += text;
      return;
    }
    buffer_ += '"';
    for (const char c : text) buffer_.append(c == '"' ? 2 : 1, c);
    buffer_ += '"';
  }
  void end_line() {
    buffer_ += '\n';
    if (buffer_.size() >= capacity) flush();
  }
  void commit() {
    flush();
    file_.commit();
  }

 private:
  static constexpr std::size_t capacity = std::size_t(1) << 20;

  template <class T>
  void number(T value) {
    char digits[32];
    buffer_.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
  }
  void flush() {
    file_.write(buffer_);
    buffer_.clear();
  }

  AtomicFile file_;
  std::string buffer_;
};

}  // namespace

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
