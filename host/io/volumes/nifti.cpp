// NIfTI files: a binary header of 348 bytes (version 1) or 540 (version 2), and samples in one file.
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "io/description.hpp"
#include "io/volumes/nrrd_data.hpp"
#include "io/volumes/samples.hpp"
#include "io/volumes/volume_files.hpp"
#include "numerics/input_file.hpp"
#include "smurf/error.hpp"
#include "smurf/values.hpp"

namespace smurf {
namespace {

using std::filesystem::path;

constexpr std::size_t bytes_of_version_1 = 348, bytes_of_version_2 = 540;

[[noreturn]] void fail(const path& file, const std::string& message) {
  throw Error(ErrorCode::input, fmt::format("\"{}\": {}", file.string(), message));
}

struct Header {
  std::string bytes;
  bool swaps = false;
  bool second = false;  // version 2

  template <class T>
  T at(std::size_t offset) const {
    char raw[sizeof(T)];
    std::memcpy(raw, bytes.data() + offset, sizeof raw);
    if (swaps) std::reverse(raw, raw + sizeof raw);
    return std::bit_cast<T>(raw);
  }
  // Of fields that are wider in version 2. Offsets are those of nifti1.h and nifti2.h.
  double real(std::size_t first, std::size_t other, std::size_t index = 0) const {
    return second ? at<double>(other + 8 * index) : double(at<float>(first + 4 * index));
  }
  double dimension(std::size_t index) const {
    return second ? double(at<std::int64_t>(16 + 8 * index)) : double(at<std::int16_t>(40 + 2 * index));
  }
  int type() const { return second ? at<std::int16_t>(12) : at<std::int16_t>(70); }
  double data_offset() const { return second ? double(at<std::int64_t>(168)) : double(at<float>(108)); }
  double step(std::size_t index) const { return real(76, 104, index); }
  double slope() const { return real(112, 176); }
  double intercept() const { return real(116, 184); }
  int qform_code() const { return second ? at<std::int32_t>(344) : at<std::int16_t>(252); }
  int sform_code() const { return second ? at<std::int32_t>(348) : at<std::int16_t>(254); }
  double quaternion(std::size_t index) const { return real(256, 352, index); }
  double q_offset(std::size_t index) const { return real(268, 376, index); }
  double s_row(std::size_t row, std::size_t column) const { return real(280, 400, 4 * row + column); }
};

bool is_compressed(const path& file) { return description::ending_of(file) == ".gz"; }

std::string beginning_of(const path& file) {
  const InputFile input(file);
  std::string bytes(bytes_of_version_2, '\0');
  std::size_t filled = std::min(bytes.size(), input.size());
  if (!is_compressed(file)) {
    input.read_at(0, bytes.data(), filled);
  } else {
    const gzFile stream = gzopen(file.c_str(), "rb");
    if (stream == nullptr) fail(file, "cannot be read");
    const int got = gzread(stream, bytes.data(), unsigned(bytes.size()));
    gzclose_r(stream);
    if (got < 0) fail(file, "the compressed data is damaged");
    filled = std::size_t(got);
  }
  bytes.resize(filled);
  return bytes;
}

Header read_header(const path& file) {
  Header header;
  header.bytes = beginning_of(file);
  if (header.bytes.size() < bytes_of_version_1)
    fail(file, fmt::format("{} bytes; the header of NIfTI takes {}", header.bytes.size(), bytes_of_version_1));
  for (const bool swaps : {false, true}) {
    header.swaps = swaps;
    const auto size = header.at<std::int32_t>(0);
    header.second = size == std::int32_t(bytes_of_version_2);
    if (size == std::int32_t(bytes_of_version_1) || header.second) {
      const std::string_view magic = std::string_view(header.bytes).substr(header.second ? 4 : 344, 3);
      if (header.second && header.bytes.size() < bytes_of_version_2)
        fail(file, fmt::format("{} bytes; the header of NIfTI-2 takes {}", header.bytes.size(), bytes_of_version_2));
      if (magic == (header.second ? "n+2" : "n+1")) return header;
      if (magic.starts_with("ni")) fail(file, "header and samples in two files cannot be read; one .nii file can");
      break;
    }
  }
  fail(file, "this is no NIfTI file: size of the header and \"n+1\" or \"n+2\" are missing");
}

glm::ivec3 size_of(const path& file, const Header& header) {
  const double axes = header.dimension(0);
  bool single = axes >= 3 && axes <= 7;
  for (std::size_t axis = 4; single && double(axis) <= axes; axis++) single = header.dimension(axis) <= 1;
  if (!single) {
    std::string sizes;
    for (std::size_t axis = 1; axis <= 7 && double(axis) <= axes; axis++)
      sizes += fmt::format("{}{}", axis > 1 ? "x" : "", header.dimension(axis));
    fail(file, fmt::format("{} axes{}; a volume of scalars has 3, and one sample along others", axes,
                           sizes.empty() ? "" : " of " + sizes));
  }
  return checked_size(file, header.dimension(1), header.dimension(2), header.dimension(3));
}

SampleType type_of(const path& file, const Header& header) {
  switch (header.type()) {
    case 2:
      return SampleType::uint8;
    case 4:
      return SampleType::int16;
    case 8:
      return SampleType::int32;
    case 16:
      return SampleType::float32;
    case 64:
      return SampleType::float64;
    case 256:
      return SampleType::int8;
    case 512:
      return SampleType::uint16;
    case 768:
      return SampleType::uint32;
    case 1024:
      return SampleType::int64;
    case 1280:
      return SampleType::uint64;
    default:
      fail(file, fmt::format("samples of NIfTI's type {} are no scalars", header.type()));
  }
}

GridPlacement placement_of(const path& file, const Header& header) {
  GridPlacement placement;
  if (header.sform_code() > 0) {
    for (int row = 0; row < 3; row++) {
      for (int axis = 0; axis < 3; axis++)
        placement.axes[axis][row] = header.s_row(std::size_t(row), std::size_t(axis));
      placement.origin[row] = header.s_row(std::size_t(row), 3);
    }
    return placement;
  }
  glm::dmat3 turn(1.0);
  if (header.qform_code() > 0) {
    const double b = header.quaternion(0), c = header.quaternion(1), d = header.quaternion(2);
    const double a = std::sqrt(std::max(0.0, 1 - b * b - c * c - d * d));
    turn = glm::dmat3(glm::dvec3(a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)),
                      glm::dvec3(2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)),
                      glm::dvec3(2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c));
    if (header.step(0) < 0) turn[2] = -turn[2];  // qfac: the grid is left-handed
    placement.origin = {header.q_offset(0), header.q_offset(1), header.q_offset(2)};
  }
  for (int axis = 0; axis < 3; axis++) {
    const double step = header.step(std::size_t(axis) + 1);
    if (!(step > 0)) fail(file, fmt::format("the spacing along axis {} is {}; it must be positive", axis, step));
    placement.axes[axis] = turn[axis] * step;
  }
  return placement;
}

}  // namespace

Volume read_nifti(const path& file) {
  const Header header = read_header(file);
  const SampleType type = type_of(file, header);
  const glm::ivec3 size = size_of(file, header);
  const GridPlacement placement = placement_of(file, header);
  const double offset = header.data_offset();
  if (!(offset >= double(header.second ? bytes_of_version_2 : bytes_of_version_1) && offset <= 1e15))
    fail(file, fmt::format("the samples begin at byte {}, within the header", offset));
  const std::size_t count = std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z);
  const auto encoding = is_compressed(file) ? NrrdData::Encoding::gzip : NrrdData::Encoding::raw;
  const std::shared_ptr<void> samples =
      own_samples(read_nrrd_data({.file = file, .encoding = encoding, .byte_skip = long(offset)}, type, count));
  if (header.swaps) swap_bytes(samples.get(), type, count);
  Volume stored(samples, type, size, placement);
  const double slope = header.slope(), intercept = header.intercept();
  if (slope == 0 || !std::isfinite(slope) || !std::isfinite(intercept) || (slope == 1 && intercept == 0)) return stored;

  const auto scaled = std::make_shared<Values<float>>(count);
  for (std::size_t i = 0; i < count; i++) (*scaled)[i] = float(slope * stored.at(i) + intercept);
  return {std::shared_ptr<const void>(scaled, scaled->data()), SampleType::float32, size, placement};
}

}  // namespace smurf
