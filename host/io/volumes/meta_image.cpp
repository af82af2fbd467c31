// MetaImage files (ITK): lines "key = value" up to ElementDataFile, then samples, here or in another file.
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "io/volumes/nrrd_data.hpp"
#include "io/volumes/samples.hpp"
#include "io/volumes/volume_files.hpp"
#include "numerics/input_file.hpp"
#include "numerics/text_file.hpp"
#include "smurf/error.hpp"
#include "smurf/values.hpp"

namespace smurf {
namespace {

using std::filesystem::path;

constexpr std::size_t longest_header = 1 << 16;

struct Header {
  path file;
  std::map<std::string, std::string> values;
  std::size_t end = 0;  // bytes that it takes

  [[noreturn]] void fail(const std::string& message) const {
    throw Error(ErrorCode::input, fmt::format("\"{}\": {}", file.string(), message));
  }
  // Empty where there is no such key.
  std::string text(const std::string& key) const {
    const auto found = values.find(key);
    return found == values.end() ? "" : found->second;
  }
  bool flag(const std::string& key) const { return text(key).starts_with('T') || text(key).starts_with('t'); }
  // `count` numbers; none where there is no such key.
  std::vector<double> numbers(const std::string& key, std::size_t count) const {
    std::vector<double> out;
    std::string_view rest = text_view(key);
    while (true) {
      const auto first = rest.find_first_not_of(" \t");
      if (first == rest.npos) break;
      const auto end = std::min(rest.find_first_of(" \t", first), rest.size());
      double value = 0;
      if (parse_number(rest.substr(first, end - first), value) != NumberParse::ok)
        fail(fmt::format("\"{}\" in \"{}\" is no number", rest.substr(first, std::min<std::size_t>(end - first, 40)),
                         key));
      out.push_back(value);
      rest.remove_prefix(end);
    }
    if (values.contains(key) && out.size() != count)
      fail(fmt::format("\"{}\" holds {} numbers; it must hold {}", key, out.size(), count));
    return out;
  }
  // By the first of the keys that is there; the format has several names for one thing.
  std::vector<double> numbers(std::initializer_list<const char*> keys, std::size_t count) const {
    for (const char* key : keys) {
      if (values.contains(key)) return numbers(key, count);
    }
    return {};
  }

 private:
  std::string_view text_view(const std::string& key) const {
    const auto found = values.find(key);
    return found == values.end() ? std::string_view() : std::string_view(found->second);
  }
};

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == text.npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(" \t\r") - first + 1));
}

Header read_header(const InputFile& input) {
  Header header;
  header.file = input.path();
  std::string text(std::min(input.size(), longest_header), '\0');
  input.read_at(0, text.data(), text.size());
  while (header.end < text.size()) {
    const auto end = std::min(text.find('\n', header.end), text.size());
    const std::string_view line = std::string_view(text).substr(header.end, end - header.end);
    const auto equals = line.find('=');
    if (line.find('\0') != line.npos || (equals == line.npos && !trimmed(line).empty()))
      header.fail("this is no MetaImage file: its header holds a line that is no \"key = value\"");
    header.end = std::min(end + 1, text.size());
    if (equals == line.npos) continue;
    const std::string key = trimmed(line.substr(0, equals));
    header.values[key] = trimmed(line.substr(equals + 1));
    if (key == "ElementDataFile") return header;
  }
  header.fail("this is no MetaImage file, or it ends within its header: \"ElementDataFile\" is missing");
}

SampleType type_of(const Header& header) {
  static const std::map<std::string, SampleType> types{
      {"MET_CHAR", SampleType::int8},       {"MET_UCHAR", SampleType::uint8},       {"MET_SHORT", SampleType::int16},
      {"MET_USHORT", SampleType::uint16},   {"MET_INT", SampleType::int32},         {"MET_UINT", SampleType::uint32},
      {"MET_LONG", SampleType::int32},      {"MET_ULONG", SampleType::uint32},  // four bytes, whatever the machine
      {"MET_LONG_LONG", SampleType::int64}, {"MET_ULONG_LONG", SampleType::uint64}, {"MET_FLOAT", SampleType::float32},
      {"MET_DOUBLE", SampleType::float64},
  };
  const auto found = types.find(header.text("ElementType"));
  if (found != types.end()) return found->second;
  header.fail(
      fmt::format("\"ElementType\" is \"{}\", which is no type of scalars", header.text("ElementType").substr(0, 40)));
}

glm::ivec3 size_of(const Header& header) {
  const std::vector<double> dimensions = header.numbers("NDims", 1);
  if (dimensions.empty() || dimensions[0] != 3)
    header.fail(fmt::format("\"NDims\" is {}; a volume has 3", dimensions.empty() ? "missing" : header.text("NDims")));
  const std::vector<double> channels = header.numbers("ElementNumberOfChannels", 1);
  if (!channels.empty() && channels[0] != 1)
    header.fail(fmt::format("{} components a sample; a volume of scalars has 1", channels[0]));
  const std::vector<double> size = header.numbers("DimSize", 3);
  if (size.empty()) header.fail("\"DimSize\" is missing");
  return checked_size(header.file, size[0], size[1], size[2]);
}

GridPlacement placement_of(const Header& header) {
  GridPlacement placement;
  // A row of the matrix is the direction of an axis.
  if (const auto matrix = header.numbers({"TransformMatrix", "Rotation", "Orientation"}, 9); !matrix.empty()) {
    for (int i = 0; i < 9; i++) placement.axes[i / 3][i % 3] = matrix[std::size_t(i)];
  }
  if (const auto step = header.numbers({"ElementSpacing", "ElementSize"}, 3); !step.empty()) {
    for (int a = 0; a < 3; a++) {
      if (!(step[std::size_t(a)] > 0))
        header.fail(fmt::format("the spacing along axis {} is {}; it must be positive", a, step[std::size_t(a)]));
      placement.axes[a] *= step[std::size_t(a)];
    }
  }
  if (const auto offset = header.numbers({"Offset", "Position", "Origin"}, 3); !offset.empty())
    placement.origin = {offset[0], offset[1], offset[2]};
  return placement;
}

// A zlib stream that begins at an offset of a file.
std::shared_ptr<void> inflated(const Header& header, const path& file, std::size_t start, std::size_t bytes) {
  const InputFile input(file);
  std::string packed(input.size() - std::min(start, input.size()), '\0');
  input.read_at(start, packed.data(), packed.size());
  constexpr std::size_t greatest_ratio = 1032;  // zlib's technical notes
  const auto refuse_length = [&](const std::string& there) {
    header.fail(fmt::format("the header asks for {} bytes of data, but there are {}", bytes, there));
  };
  if (bytes / greatest_ratio > packed.size()) refuse_length(fmt::format("only {}, compressed", packed.size()));
  std::shared_ptr<void> out = own_samples(allocate_results(bytes));

  z_stream stream{};
  if (inflateInit2(&stream, 15 + 32) != Z_OK) throw Error(ErrorCode::memory, "no memory for decompression");
  std::size_t taken = 0, filled = 0;
  int state = Z_OK;
  constexpr std::size_t most = 1 << 30;  // zlib counts in 32 bits
  while (state == Z_OK) {
    stream.next_in = reinterpret_cast<unsigned char*>(packed.data()) + taken;
    stream.avail_in = uInt(std::min(most, packed.size() - taken));
    stream.next_out = static_cast<unsigned char*>(out.get()) + filled;
    stream.avail_out = uInt(std::min(most, bytes - filled));
    const uInt in_before = stream.avail_in, out_before = stream.avail_out;
    state = inflate(&stream, Z_NO_FLUSH);
    taken += in_before - stream.avail_in;
    filled += out_before - stream.avail_out;
  }
  inflateEnd(&stream);
  if (state != Z_STREAM_END && state != Z_BUF_ERROR) header.fail("the compressed data is damaged");
  if (filled < bytes) refuse_length(fmt::format("{}", filled));
  if (state != Z_STREAM_END) refuse_length("more, or the end of the compressed data is missing");
  return out;
}

}  // namespace

Volume read_meta_image(const path& file) {
  const InputFile input(file);
  const Header header = read_header(input);
  const SampleType type = type_of(header);
  const glm::ivec3 size = size_of(header);
  const GridPlacement placement = placement_of(header);
  const std::string data_name = header.text("ElementDataFile");
  const bool here = data_name == "LOCAL" || data_name == "Local" || data_name == "local";
  if (data_name.empty() || data_name.starts_with("LIST") || data_name.find('%') != data_name.npos)
    header.fail(
        fmt::format("data in several files (\"{}\") cannot be read; join them into one", data_name.substr(0, 60)));
  if (header.values.contains("BinaryData") && !header.flag("BinaryData"))
    header.fail("samples written as text cannot be read; binary ones can");
  // -1: the data ends where the file does.
  const std::vector<double> skipped = header.numbers("HeaderSize", 1);
  if (!skipped.empty() && !(skipped[0] >= -1 && skipped[0] <= 1e15))
    header.fail(fmt::format("\"HeaderSize\" is {}; it must be a number of bytes, or -1", skipped[0]));

  const std::size_t count = std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z);
  const path data_file = here ? file : file.parent_path() / data_name;
  const std::shared_ptr<void> samples =
      header.flag("CompressedData") ? inflated(header, data_file, here ? header.end : 0, count * size_of(type))
                                    : own_samples(read_nrrd_data({.file = data_file,
                                                                  .header_bytes = here ? header.end : 0,
                                                                  .byte_skip = skipped.empty() ? 0 : long(skipped[0])},
                                                                 type, count));
  const bool big = header.flag("BinaryDataByteOrderMSB") || header.flag("ElementByteOrderMSB");
  if (big != (std::endian::native == std::endian::big)) swap_bytes(samples.get(), type, count);
  return {samples, type, size, placement};
}

}  // namespace smurf
