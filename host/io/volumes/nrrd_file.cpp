// NRRD files. Teem's library interprets the header; what it is handed, and the data, are read here,
// because its own readers are not safe on damaged files: header lines of some kinds and ASCII samples overflow its
// buffers, text after numbers and digits that do not fit are ignored, and compressed data is neither checked
// against its checksum nor for being longer than stated.
//
// One data file, attached or detached; encodings raw, gzip and ascii.
#include "io/volumes/nrrd_file.hpp"

#include <fmt/format.h>
#include <locale.h>
#include <teem/nrrd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "io/volumes/nrrd_data.hpp"
#include "io/volumes/samples.hpp"
#include "numerics/text_file.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

using std::filesystem::path;

constexpr std::size_t longest_header = 1 << 20, longest_line = 1 << 16;
constexpr std::size_t longest_shown = 400;  // teem composes its messages, which quote lines, in 1024 bytes

[[noreturn]] void fail(const path& file, const std::string& message) {
  throw Error(ErrorCode::input, fmt::format("\"{}\": {}", file.string(), message));
}

struct HeaderText {
  std::string interpreted;  // the lines that teem is to see
  std::string data_file;    // as the header names it; empty when the data follows the header
  std::size_t end = 0;      // bytes of the file that the header takes, with the blank line
  std::array<bool, NRRD_FIELD_MAX + 1> seen{};
};

// ---- Lines

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  return first == text.npos ? std::string_view() : text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::vector<std::string_view> words(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> out;
  while (true) {
    const auto first = text.find_first_not_of(separators);
    if (first == text.npos) return out;
    const auto end = std::min(text.find_first_of(separators, first), text.size());
    out.push_back(text.substr(first, end - first));
    text.remove_prefix(end);
  }
}

// Teem stops reading a number at the first character that does not fit, and lets integers wrap around.
void check_numbers(const path& file, int field, std::string_view name, std::string_view value) {
  const bool integers = field == nrrdField_sizes || field == nrrdField_dimension ||
                        field == nrrdField_space_dimension || field == nrrdField_line_skip ||
                        field == nrrdField_byte_skip;
  const std::vector<std::string_view> numbers = words(value, " \t(),");
  if (integers && field != nrrdField_sizes && numbers.size() != 1)
    fail(file, fmt::format("\"{}: {}\" must hold one integer", name, value));
  for (const std::string_view word : numbers) {
    std::int32_t integer = 0;
    double real = 0;
    if (!integers && (word == "none" || word == "???")) continue;
    const NumberParse parse = integers ? parse_number(word, integer) : parse_number(word, real);
    if (parse == NumberParse::out_of_range) fail(file, fmt::format("{} in \"{}: {}\" is too great", word, name, value));
    if (parse != NumberParse::ok)
      fail(file, fmt::format("\"{}\" in \"{}: {}\" is no {}", word, name, value, integers ? "integer" : "number"));
    if (field == nrrdField_sizes && integer < 1)
      fail(file, fmt::format("sizes are \"{}\"; each must be at least 1", value));
    if (field == nrrdField_dimension && integer != 3 && integer != 4)
      fail(file, fmt::format("dimension is {}; a volume must have 3, and vectors on a grid 4", integer));
  }
}

bool holds_numbers(int field) {
  static constexpr int fields[] = {
      nrrdField_dimension,        nrrdField_sizes,        nrrdField_spacings,         nrrdField_axis_mins,
      nrrdField_axis_maxs,        nrrdField_line_skip,    nrrdField_byte_skip,        nrrdField_space_dimension,
      nrrdField_space_directions, nrrdField_space_origin, nrrdField_measurement_frame};
  return std::ranges::find(fields, field) != std::end(fields);
}

bool is_interpreted(int field) {
  return holds_numbers(field) || field == nrrdField_type || field == nrrdField_space || field == nrrdField_centers ||
         field == nrrdField_endian || field == nrrdField_encoding;
}

// Sorts one line: to be interpreted, the data file's name, or of no consequence for a volume (comments, keys and
// values, labels, units and the like).
void take_line(const path& file, std::string_view line, HeaderText& header) {
  if (line.starts_with('#')) return;
  const auto colon = line.find(": ");
  const int field = colon == line.npos ? 0 : airEnumVal(nrrdField, std::string(line.substr(0, colon)).c_str());
  if (field == nrrdField_unknown) {
    if (line.find(":=") != line.npos) return;
    fail(file, fmt::format("header line \"{}\" is no NRRD field", line.substr(0, 60)));
  }
  const std::string_view value = trimmed(line.substr(colon + 2));
  header.seen[std::size_t(field)] = true;
  if (field == nrrdField_data_file) {
    if (!header.data_file.empty()) fail(file, "header names its data file twice");
    if (value.empty()) fail(file, "header names no data file after \"data file:\"");
    if (value.starts_with("LIST") || value.starts_with("SKIPLIST") || value.find('%') != value.npos)
      fail(file, fmt::format("data in several files (\"data file: {}\") cannot be read; join them into one",
                             value.substr(0, 60)));
    header.data_file = value;
  }
  if (!is_interpreted(field)) return;
  if (line.size() > longest_shown) fail(file, fmt::format("header line \"{}...\" is too long", line.substr(0, 60)));
  if (holds_numbers(field)) check_numbers(file, field, line.substr(0, colon), value);
  header.interpreted.append(line.substr(0, colon)).append(": ").append(value) += '\n';
}

HeaderText split_lines(const path& file, std::string_view text) {
  if (!text.starts_with("NRRD0")) fail(file, "this is no NRRD file: it does not begin with \"NRRD0\"");
  HeaderText header;
  bool first = true;
  while (header.end < text.size()) {
    const auto end = text.find('\n', header.end);
    std::string_view line = text.substr(header.end, end - header.end);
    header.end = end == text.npos ? text.size() : end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty()) return header;
    if (line.size() > longest_line || line.find('\0') != line.npos)
      fail(file, "the header is damaged, or does not end with a blank line");
    if (first) header.interpreted.append(line.substr(0, 20)) += '\n';
    else take_line(file, line, header);
    first = false;
  }
  if (header.data_file.empty()) fail(file, "the file ends within its header");
  return header;
}

HeaderText split_header(const path& file, std::string_view text) {
  HeaderText header = split_lines(file, text);
  for (const int field : {nrrdField_type, nrrdField_dimension, nrrdField_sizes, nrrdField_encoding})
    if (!header.seen[std::size_t(field)])
      fail(file, fmt::format("the header lacks the field \"{}\"", airEnumStr(nrrdField, field)));
  return header;
}

// ---- Teem

struct NrrdDeleter {
  void operator()(Nrrd* nrrd) const { nrrdNuke(nrrd); }
  void operator()(NrrdIoState* state) const { nrrdIoStateNix(state); }
};

// Teem reads numbers by sscanf, which minds the locale.
class PlainLocale {
 public:
  PlainLocale() : plain_(newlocale(LC_ALL_MASK, "C", locale_t())), before_(uselocale(plain_)) {}
  ~PlainLocale() {
    uselocale(before_);
    if (plain_ != locale_t()) freelocale(plain_);
  }
  PlainLocale(const PlainLocale&) = delete;
  PlainLocale& operator=(const PlainLocale&) = delete;

 private:
  locale_t plain_, before_;
};

// Teem lists what went wrong from the outermost function to the cause, each on a line "[nrrd] function: message". The
// message: the cause, after the field that it is about where a line "trouble parsing spacings info |1 1|" tells it.
std::string cause_of_failure() {
  char* raw = biffGetDone(NRRD);
  const std::string all(raw != nullptr ? raw : "");
  free(raw);
  std::string cause = "unknown reason", field;
  for (std::string_view line : words(all, "\n")) {
    const auto function = line.find(": ");
    if (function != line.npos) line.remove_prefix(function + 2);
    cause = line;
    static constexpr std::string_view context = "trouble parsing ", middle = " info |";
    const auto info = line.find(middle);
    if (line.starts_with(context) && line.ends_with('|') && info != line.npos) {
      const auto text = info + middle.size();
      field = fmt::format("\"{}: {}\": ", line.substr(context.size(), info - context.size()),
                          line.substr(text, line.size() - text - 1));
    }
  }
  return field + cause;
}

struct Header {
  std::shared_ptr<Nrrd> nrrd;
  std::unique_ptr<NrrdIoState, NrrdDeleter> state;
};

Header interpret(const path& file, const HeaderText& text) {
  static std::mutex mutex;  // teem keeps its messages in a global list
  const std::lock_guard lock(mutex);
  const PlainLocale locale;
  Header header{std::shared_ptr<Nrrd>(nrrdNew(), NrrdDeleter()), nullptr};
  header.state.reset(nrrdIoStateNew());
  nrrdIoStateSet(header.state.get(), nrrdIoStateSkipData, AIR_TRUE);
  if (nrrdStringRead(header.nrrd.get(), text.interpreted.c_str(), header.state.get()) != 0)
    fail(file, "bad header: " + cause_of_failure());
  return header;
}

// ---- Meaning

std::optional<SampleType> sample_type(int type) {
  switch (type) {
    case nrrdTypeChar:
      return SampleType::int8;
    case nrrdTypeUChar:
      return SampleType::uint8;
    case nrrdTypeShort:
      return SampleType::int16;
    case nrrdTypeUShort:
      return SampleType::uint16;
    case nrrdTypeInt:
      return SampleType::int32;
    case nrrdTypeUInt:
      return SampleType::uint32;
    case nrrdTypeLLong:
      return SampleType::int64;
    case nrrdTypeULLong:
      return SampleType::uint64;
    case nrrdTypeFloat:
      return SampleType::float32;
    case nrrdTypeDouble:
      return SampleType::float64;
    default:
      return std::nullopt;
  }
}

// Number of the first spatial axis: 1 when samples have components.
unsigned first_axis(const Nrrd& nrrd) { return nrrd.dim == 3 ? 0 : 1; }

glm::ivec3 size_of(const path& file, const Nrrd& nrrd) {
  glm::ivec3 size;
  double count = 1;
  for (unsigned a = 0; a < 3; a++) {
    const std::size_t samples = nrrd.axis[first_axis(nrrd) + a].size;  // checked to be a positive int
    size[int(a)] = int(samples);
    count *= double(samples);
  }
  if (count > double(std::numeric_limits<std::int32_t>::max()))
    fail(file,
         fmt::format("sizes {} {} {} are {:.0f} samples; at most 2^31-1 are possible", size.x, size.y, size.z, count));
  return size;
}

glm::dvec3 space_vector(const double* values) { return {values[0], values[1], values[2]}; }

// Spacing and position of the first node along an axis without a direction vector.
struct AxisRange {
  double step = 1, first = 0;
};

AxisRange range_of(const path& file, const Header& header, unsigned axis, unsigned number) {
  const NrrdAxisInfo& info = header.nrrd->axis[axis];
  const bool cells = info.center == nrrdCenterCell;  // min and max are those of cells around the samples
  AxisRange range;
  if (header.state->seen[nrrdField_spacings]) {
    range.step = info.spacing;
  } else if (AIR_EXISTS(info.min) && AIR_EXISTS(info.max)) {
    const double steps = double(info.size) - (cells ? 0 : 1);
    range.step = steps > 0 ? (info.max - info.min) / steps : 1;
  }
  if (!(range.step > 0) || !std::isfinite(range.step))
    fail(file, fmt::format("the spacing along axis {} is {}; it must be positive", number, range.step));
  if (AIR_EXISTS(info.min)) range.first = info.min + (cells ? 0.5 * range.step : 0);
  return range;
}

GridPlacement placement_of(const path& file, const Header& header) {
  const Nrrd& nrrd = *header.nrrd;
  const unsigned first = first_axis(nrrd);
  GridPlacement placement;
  const bool directed = header.state->seen[nrrdField_space_directions] != 0;
  const bool shifted = header.state->seen[nrrdField_space_origin] && AIR_EXISTS(nrrd.spaceOrigin[0]);
  if ((directed || shifted) && nrrd.spaceDim != 3)
    fail(file, fmt::format("space dimension is {}; it must be 3", nrrd.spaceDim));
  for (unsigned a = 0; a < 3; a++) {
    if (directed) {
      placement.axes[int(a)] = space_vector(nrrd.axis[first + a].spaceDirection);
      if (!AIR_EXISTS(placement.axes[int(a)].x)) fail(file, fmt::format("axis {} has no space direction", a));
    } else {
      const AxisRange range = range_of(file, header, first + a, a);
      placement.axes[int(a)] = glm::dvec3(0.0);
      placement.axes[int(a)][int(a)] = range.step;
      placement.origin[int(a)] = range.first;
    }
  }
  if (shifted) placement.origin = space_vector(nrrd.spaceOrigin);
  return placement;
}

// Column c is the world direction of component c. None where the header has no frame, or says "none".
std::optional<glm::dmat3> frame_of(const path& file, const Header& header) {
  const Nrrd& nrrd = *header.nrrd;
  if (!header.state->seen[nrrdField_measurement_frame] || !AIR_EXISTS(nrrd.measurementFrame[0][0])) return std::nullopt;
  if (nrrd.spaceDim != 3)
    fail(file, fmt::format("space dimension is {}; it must be 3 for the measurement frame", nrrd.spaceDim));
  glm::dmat3 frame;
  for (int c = 0; c < 3; c++) frame[c] = space_vector(nrrd.measurementFrame[c]);
  return frame;
}

// ---- Data

NrrdData data_source(const path& file, const HeaderText& text, const Header& header) {
  const NrrdEncoding* encoding = header.state->encoding;
  NrrdData data;
  data.file = text.data_file.empty() ? file : file.parent_path() / text.data_file;  // an absolute name stands alone
  data.header_bytes = text.data_file.empty() ? text.end : 0;
  data.line_skip = header.state->lineSkip;
  data.byte_skip = header.state->byteSkip;
  if (encoding == nrrdEncodingRaw) data.encoding = NrrdData::Encoding::raw;
  else if (encoding == nrrdEncodingGzip) data.encoding = NrrdData::Encoding::gzip;
  else if (encoding == nrrdEncodingAscii) data.encoding = NrrdData::Encoding::ascii;
  else fail(file, fmt::format("encoding {} cannot be read; raw, gzip and ascii can", encoding->name));
  return data;
}

bool swaps_bytes(const Nrrd& nrrd, const NrrdIoState& state) {
  return state.encoding->endianMatters && nrrdElementSize(&nrrd) > 1 && state.endian != airMyEndian();
}

std::string read_beginning(const path& file) {
  InputFile input(file);
  std::string text(std::min(input.size(), longest_header), '\0');
  input.read_at(0, text.data(), text.size());
  return text;
}

}  // namespace

NrrdFile read_nrrd(const path& file) {
  const HeaderText text = split_header(file, read_beginning(file));
  const Header header = interpret(file, text);
  Nrrd& nrrd = *header.nrrd;
  const std::optional<SampleType> type = sample_type(nrrd.type);
  if (!type) fail(file, fmt::format("samples of type {} are no scalars", airEnumStr(nrrdType, nrrd.type)));
  NrrdFile result;
  result.type = *type;
  result.size = size_of(file, nrrd);
  if (nrrd.dim == 4) result.components = nrrd.axis[0].size;
  result.components_have_direction = nrrd.dim == 4 && header.state->seen[nrrdField_space_directions] != 0 &&
                                     AIR_EXISTS(nrrd.axis[0].spaceDirection[0]);
  result.placement = placement_of(file, header);
  result.measurement_frame = frame_of(file, header);
  const NrrdData data = data_source(file, text, header);
  const std::size_t nodes = std::size_t(result.size.x) * std::size_t(result.size.y) * std::size_t(result.size.z);
  if (result.components > std::numeric_limits<std::size_t>::max() / 16 / nodes)
    fail(file, fmt::format("{} values a sample are too many", result.components));
  result.read = [data, type = *type, count = nodes * result.components,
                 swaps = swaps_bytes(nrrd, *header.state)]() -> std::shared_ptr<const void> {
    std::shared_ptr<void> samples = own_samples(read_nrrd_data(data, type, count));
    if (swaps) swap_bytes(samples.get(), type, count);
    return samples;
  };
  return result;
}

}  // namespace smurf
