#include "io/writers/vtk_xml.hpp"

#include <fmt/format.h>

#include <bit>
#include <iterator>

namespace smurf {

namespace {

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '"') out += "&quot;";
    else out += c;
  }
  return out;
}

}  // namespace

VtkXmlWriter::VtkXmlWriter(const std::filesystem::path& file, std::string_view type) : file_(file) {
  text_.reserve(capacity + 4096);
  text_ = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"{}\" version=\"1.0\" byte_order=\"{}\" header_type=\"UInt64\">\n", type,
      std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian");
  tags_.emplace_back("VTKFile");
  open(type);
}

void VtkXmlWriter::start_line() {
  if (text_.size() >= capacity) flush();
  text_.append(tags_.size(), ' ');
}

void VtkXmlWriter::open(std::string_view tag,
                        std::initializer_list<std::pair<std::string_view, std::uint64_t>> attributes) {
  start_line();
  text_ += fmt::format("<{}", tag);
  for (const auto& [name, value] : attributes) text_ += fmt::format(" {}=\"{}\"", name, value);
  text_ += ">\n";
  tags_.emplace_back(tag);
}

void VtkXmlWriter::close() {
  const std::string tag = std::move(tags_.back());
  tags_.pop_back();
  start_line();
  text_ += fmt::format("</{}>\n", tag);
}

void VtkXmlWriter::begin_array(std::string_view type, std::string_view name, int components, std::uint64_t bytes) {
  start_line();
  text_ += fmt::format("<DataArray type=\"{}\" Name=\"{}\"", type, escaped(name));
  if (components > 1) text_ += fmt::format(" NumberOfComponents=\"{}\"", components);
  text_ += " format=\"binary\">";
  put(bytes);
}

void VtkXmlWriter::put_group() {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (int shift = 18; shift >= 0; shift -= 6) text_ += digits[group_ >> shift & 63];
  group_ = 0;
  grouped_ = 0;
  if (text_.size() >= capacity) flush();
}

void VtkXmlWriter::end_array() {
  if (grouped_ > 0) {
    const std::size_t padding = std::size_t(3 - grouped_);
    group_ <<= 8 * padding;
    put_group();
    text_.replace(text_.size() - padding, padding, padding, '=');
  }
  text_ += "</DataArray>\n";
}

void VtkXmlWriter::flush() {
  file_.write(text_);
  text_.clear();
}

void VtkXmlWriter::commit() {
  while (!tags_.empty()) close();
  flush();
  file_.commit();
}

}  // namespace smurf
