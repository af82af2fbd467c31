// Numbers from CSV files with a header line: the columns that are asked for, by name, in any order.
//
// Cells are separated by commas and may stand in double quotes; spaces around them, blank lines, CRLF and a
// UTF-8 byte order mark are passed over; columns that nobody asked for are not looked at. Numbers are read
// independently of the locale and rounded to the nearest float, beyond the range of float to infinity; "inf" and
// "nan" are numbers, too.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string_view>
#include <vector>

namespace smurf {

template <class T>
struct CsvTable {
  std::vector<std::vector<T>> columns;  // the required ones, then the optional ones; empty if the file has it not
  std::vector<bool> present;            // per column
  std::size_t rows = 0;
};
using CsvColumns = CsvTable<float>;
using CsvDoubles = CsvTable<double>;

// Throws Error (input) that names the file, the line and the column: missing file or column, a cell that is
// no number, a row with too few or too many cells.
CsvColumns read_csv(const std::filesystem::path& file, std::initializer_list<std::string_view> required,
                    std::initializer_list<std::string_view> optional = {});
// The same in double precision.
CsvDoubles read_csv_doubles(const std::filesystem::path& file, std::initializer_list<std::string_view> required,
                            std::initializer_list<std::string_view> optional = {});

}  // namespace smurf
