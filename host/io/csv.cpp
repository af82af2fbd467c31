// A reader of its own: Debian's C++ parser (fast-cpp-csv-parser) parses numbers inexactly and reads past the end
// of a file without a final line break; libcsv calls back per cell and is no faster.
#include "io/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "numerics/text_file.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  return first == text.npos ? std::string_view() : text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

// For messages: printable and not too long.
std::string shown(std::string_view text) {
  std::string out(text.substr(0, 40));
  for (char& c : out)
    if (static_cast<unsigned char>(c) < 32) c = '?';
  return text.size() > 40 ? out + "..." : out;
}

// Hands out the lines of a text, and the cells of a line.
class CsvText {
 public:
  CsvText(const std::filesystem::path& file) : file_(file), text_(read_file(file)), rest_(text_) {
    if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
  }

  // The next line that is not blank; false at the end.
  bool next_line() {
    while (!rest_.empty()) {
      const auto end = rest_.find('\n');
      line_ = rest_.substr(0, end);
      rest_ = end == rest_.npos ? std::string_view() : rest_.substr(end + 1);
      if (line_.ends_with('\r')) line_.remove_suffix(1);
      number_++;
      if (!trimmed(line_).empty()) return true;
    }
    return false;
  }

  // The cells of the line; quotes are taken off.
  void cells(std::vector<std::string_view>& out) const {
    out.clear();
    std::string_view line = line_;
    while (true) {
      const auto start = line.find_first_not_of(" \t");
      const bool quoted = start != line.npos && line[start] == '"';
      const auto closing = quoted ? line.find('"', start + 1) : 0;
      if (closing == line.npos) fail("a quote is not closed");
      const auto comma = line.find(',', closing);
      std::string_view cell = trimmed(line.substr(0, comma));
      if (quoted && cell.size() >= 2 && cell.ends_with('"')) cell = trimmed(cell.substr(1, cell.size() - 2));
      out.push_back(cell);
      if (comma == line.npos) return;
      line.remove_prefix(comma + 1);
    }
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw Error(ErrorCode::input, fmt::format("\"{}\", line {}: {}", file_.string(), number_, message));
  }
  [[noreturn]] void fail_whole(const std::string& message) const {
    throw Error(ErrorCode::input, fmt::format("\"{}\": {}", file_.string(), message));
  }

  std::size_t lines_at_most() const { return std::size_t(std::count(rest_.begin(), rest_.end(), '\n')) + 1; }

 private:
  std::filesystem::path file_;
  std::string text_;
  std::string_view rest_, line_;
  std::size_t number_ = 0;
};

// Where each wanted column stands in the rows; npos if absent.
std::vector<std::size_t> find_columns(const CsvText& text, const std::vector<std::string_view>& header,
                                      const std::vector<std::string_view>& wanted, std::size_t required) {
  std::vector<std::size_t> places;
  std::vector<std::string_view> missing;
  for (std::size_t i = 0; i < wanted.size(); i++) {
    const auto found = std::find(header.begin(), header.end(), wanted[i]);
    if (found == header.end() && i < required) missing.push_back(wanted[i]);
    if (found != header.end() && std::find(found + 1, header.end(), wanted[i]) != header.end())
      text.fail(fmt::format("column \"{}\" stands twice in the header", wanted[i]));
    places.push_back(found == header.end() ? std::string_view::npos : std::size_t(found - header.begin()));
  }
  if (!missing.empty())
    text.fail(fmt::format("no column \"{}\" in the header \"{}\"; needed are {}", fmt::join(missing, "\", \""),
                          shown(fmt::format("{}", fmt::join(header, ","))),
                          fmt::join(wanted.begin(), wanted.begin() + std::ptrdiff_t(required), ",")));
  return places;
}

template <class T>
T number_in(const CsvText& text, std::string_view cell, std::string_view column) {
  T value = 0;
  if (parse_number(cell, value) != NumberParse::ok)
    text.fail(fmt::format("column \"{}\" holds \"{}\", which is no number", column, shown(cell)));
  return value;
}

template <class T>
CsvTable<T> read_table(const std::filesystem::path& file, std::initializer_list<std::string_view> required,
                       std::initializer_list<std::string_view> optional) {
  std::vector<std::string_view> wanted(required);
  wanted.insert(wanted.end(), optional);
  CsvText text(file);
  if (!text.next_line())
    text.fail_whole(
        fmt::format("the file is empty; expected a header line with the columns {}", fmt::join(required, ",")));
  std::vector<std::string_view> cells;
  text.cells(cells);
  const std::size_t width = cells.size();
  const std::vector<std::size_t> places = find_columns(text, cells, wanted, required.size());

  CsvTable<T> result;
  result.columns.resize(wanted.size());
  const std::size_t lines = text.lines_at_most();
  for (std::size_t i = 0; i < wanted.size(); i++) {
    result.present.push_back(places[i] != std::string_view::npos);
    if (result.present[i]) result.columns[i].reserve(lines);
  }
  while (text.next_line()) {
    text.cells(cells);
    if (cells.size() != width) text.fail(fmt::format("{} cells, but the header has {}", cells.size(), width));
    for (std::size_t i = 0; i < wanted.size(); i++)
      if (result.present[i]) result.columns[i].push_back(number_in<T>(text, cells[places[i]], wanted[i]));
    result.rows++;
  }
  return result;
}

}  // namespace

CsvColumns read_csv(const std::filesystem::path& file, std::initializer_list<std::string_view> required,
                    std::initializer_list<std::string_view> optional) {
  return read_table<float>(file, required, optional);
}

CsvDoubles read_csv_doubles(const std::filesystem::path& file, std::initializer_list<std::string_view> required,
                            std::initializer_list<std::string_view> optional) {
  return read_table<double>(file, required, optional);
}

}  // namespace smurf
