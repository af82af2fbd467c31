// MetaImage and NIfTI files, written here byte by byte: read back, cut short, and what must be refused.
#include "io/volumes/volume_files.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <type_traits>

#include "harness/files/test_files.hpp"
#include "harness/refusal.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;
using test::packed;
using test::put;
using test::test_folder;
using test::wbits_gzip;
using test::wbits_zlib;

constexpr glm::ivec3 size(5, 4, 3);
constexpr std::size_t nodes = 60;

template <class T>
void append(std::string& bytes, T value, bool big_endian) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  if (big_endian != (std::endian::native == std::endian::big)) std::reverse(raw, raw + sizeof raw);
  bytes.append(raw, sizeof raw);
}

template <class T>
T sample(std::size_t i) {
  if constexpr (std::is_floating_point_v<T>) return T(double(i) / 3 - 7);
  return T(i * 37);  // wraps around in small types
}

template <class T>
std::string samples(bool big_endian) {
  std::string bytes;
  for (std::size_t i = 0; i < nodes; i++) append(bytes, sample<T>(i), big_endian);
  return bytes;
}

template <class T>
void expect_samples(const Volume& volume) {
  ASSERT_EQ(volume.size(), size);
  ASSERT_EQ(volume.type(), sample_type_of<T>());
  for (std::size_t i = 0; i < nodes; i++) ASSERT_EQ(volume.at(i), double(sample<T>(i)));
}

// ---- MetaImage

std::string meta_header(const std::string& type, bool big_endian, const std::string& lines, const std::string& file) {
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = " +
         std::string(big_endian ? "True" : "False") + "\n" + lines + "DimSize = 5 4 3\nElementType = " + type +
         "\nElementDataFile = " + file + "\n";
}

template <class T>
void check_meta(const std::string& type) {
  for (const bool big_endian : {false, true}) {
    const std::string bytes = samples<T>(big_endian), zipped = packed(bytes, wbits_zlib);
    const std::string compressed =
        "CompressedData = True\nCompressedDataSize = " + std::to_string(zipped.size()) + "\n";
    expect_samples<T>(load_volume(put("v.mha", meta_header(type, big_endian, "", "LOCAL") + bytes)));
    expect_samples<T>(load_volume(put("v.mha", meta_header(type, big_endian, compressed, "LOCAL") + zipped)));
    put("v.raw", bytes);
    put("v.zraw", zipped);
    expect_samples<T>(load_volume(put("v.mhd", meta_header(type, big_endian, "", "v.raw"))));
    expect_samples<T>(load_volume(put("v.mhd", meta_header(type, big_endian, compressed, "v.zraw"))));
  }
}

TEST(MetaImage, every_type_encoding_and_byte_order) {
  check_meta<std::uint8_t>("MET_UCHAR");
  check_meta<std::int8_t>("MET_CHAR");
  check_meta<std::uint16_t>("MET_USHORT");
  check_meta<std::int16_t>("MET_SHORT");
  check_meta<std::uint32_t>("MET_UINT");
  check_meta<std::int32_t>("MET_INT");
  check_meta<std::uint64_t>("MET_ULONG_LONG");
  check_meta<std::int64_t>("MET_LONG_LONG");
  check_meta<float>("MET_FLOAT");
  check_meta<double>("MET_DOUBLE");
}

TEST(MetaImage, placement) {
  const auto placed = [](const std::string& lines) {
    return load_volume(put("v.mha", meta_header("MET_UCHAR", false, lines, "LOCAL") + samples<std::uint8_t>(false)))
        .placement();
  };
  EXPECT_EQ(placed("").axes, glm::dmat3(1.0));
  // Rows of the matrix are the axes.
  const GridPlacement turned =
      placed("TransformMatrix = 0 1 0 -1 0 0 0 0 1\nOffset = 10 20.5 -3\nElementSpacing = 0.5 2 3\n");
  EXPECT_EQ(turned.axes, glm::dmat3(0, 0.5, 0, -2, 0, 0, 0, 0, 3));
  EXPECT_EQ(turned.origin, glm::dvec3(10, 20.5, -3));
  EXPECT_EQ(placed("Position = 1 2 3\nElementSize = 4 5 6\n").axes, spacing(4, 5, 6).axes);
}

TEST(MetaImage, data_at_the_end_of_a_file) {
  put("v.raw", "anything" + samples<float>(false));
  expect_samples<float>(load_volume(put("v.mhd", meta_header("MET_FLOAT", false, "HeaderSize = -1\n", "v.raw"))));
  expect_samples<float>(load_volume(put("v.mhd", meta_header("MET_FLOAT", false, "HeaderSize = 8\n", "v.raw"))));
}

TEST(MetaImage, refuses) {
  const auto load = [](const std::string& bytes) { load_volume(put("v.mha", bytes)); };
  const std::string bytes = samples<std::uint8_t>(false);
  const auto with = [&](const std::string& lines) { return meta_header("MET_UCHAR", false, lines, "LOCAL") + bytes; };
  EXPECT_REFUSED(load(""), "\"ElementDataFile\" is missing");
  EXPECT_REFUSED(load("P5\n3 3\n"), "no MetaImage file");
  EXPECT_REFUSED(load(meta_header("MET_STRING", false, "", "LOCAL") + bytes), "MET_STRING");
  EXPECT_REFUSED(load(with("ElementNumberOfChannels = 3\n")), "3 components a sample");
  EXPECT_REFUSED(load(with("NDims = 2\n")), "\"NDims\" is 2");
  EXPECT_REFUSED(load(with("ElementSpacing = 1 0 1\n")), "spacing along axis 1 is 0");
  EXPECT_REFUSED(load(with("ElementSpacing = 1 1\n")), "2 numbers");
  EXPECT_REFUSED(load(with("Offset = 1 1 east\n")), "\"east\"");
  EXPECT_REFUSED(load(with("TransformMatrix = 1 0 0 1 0 0 0 0 1\n")), "v.mha");
  EXPECT_REFUSED(load(with("BinaryData = False\n")), "text");
  EXPECT_REFUSED(load(meta_header("MET_UCHAR", false, "", "LIST") + "a.raw\n"), "several files");
  EXPECT_REFUSED(load(meta_header("MET_UCHAR", false, "", "gone.raw")), "gone.raw");
  EXPECT_REFUSED(load(with("CompressedData = True\n")), "damaged");
  EXPECT_REFUSED(load_volume(put("v.mha", with("")), "density"), "array \"density\"");
  const std::string huge = "NDims = 3\nDimSize = 2000 1000 1000\nElementType = MET_UCHAR\nCompressedData = True\n";
  EXPECT_REFUSED(load(huge + "ElementDataFile = LOCAL\n" + packed(bytes, wbits_zlib)), "asks for 2000000000 bytes");
}

TEST(MetaImage, refuses_files_that_are_cut_short) {
  const std::string raw = samples<double>(false), zipped = packed(raw, wbits_zlib);
  for (const bool compressed : {false, true}) {
    const std::string whole = meta_header("MET_DOUBLE", false, compressed ? "CompressedData = True\n" : "", "LOCAL") +
                              (compressed ? zipped : raw);
    for (std::size_t bytes = 0; bytes < whole.size(); bytes += 97)
      EXPECT_REFUSED(load_volume(put("v.mha", whole.substr(0, bytes))), "v.mha\"");
    EXPECT_REFUSED(load_volume(put("v.mha", whole.substr(0, whole.size() - 1))), "v.mha\"");
  }
  EXPECT_REFUSED(load_volume(put("v.mha", meta_header("MET_DOUBLE", false, "", "LOCAL") + raw.substr(0, 400))),
                 "asks for 480 bytes of data, but there are 400");
}

// ---- NIfTI

struct Nifti {
  bool second = false, big_endian = false;
  std::int16_t type = 2;
  std::vector<int> sizes{3, 5, 4, 3};  // their number first
  std::vector<double> steps{1, 1, 1, 1};
  double slope = 0, intercept = 0;
  int qform = 0, sform = 0;
  double quaternion[6] = {0, 0, 0, 0, 0, 0};
  double rows[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

  std::string header() const {
    std::string bytes(second ? 544 : 352, '\0');
    const auto set = [&](std::size_t offset, auto value) {
      std::string raw;
      append(raw, value, big_endian);
      bytes.replace(offset, raw.size(), raw);
    };
    const auto real = [&](std::size_t first, std::size_t other, std::size_t index, double value) {
      if (second) set(other + 8 * index, value);
      else set(first + 4 * index, float(value));
    };
    set(0, std::int32_t(second ? 540 : 348));
    bytes.replace(second ? 4 : 344, 4, second ? std::string("n+2\0", 4) : std::string("n+1\0", 4));
    if (second) bytes.replace(8, 4, "\r\n\x1a\n");
    set(second ? 12 : 70, type);
    for (std::size_t i = 0; i < 8; i++) {
      const int dimension = i < sizes.size() ? sizes[i] : 1;
      if (second) set(16 + 8 * i, std::int64_t(dimension));
      else set(40 + 2 * i, std::int16_t(dimension));
    }
    for (std::size_t i = 0; i < 4; i++) real(76, 104, i, steps[i]);
    if (second) set(168, std::int64_t(544));
    else set(108, 352.0f);
    real(112, 176, 0, slope);
    real(116, 184, 0, intercept);
    if (second) {
      set(344, std::int32_t(qform));
      set(348, std::int32_t(sform));
    } else {
      set(252, std::int16_t(qform));
      set(254, std::int16_t(sform));
    }
    for (std::size_t i = 0; i < 6; i++) real(256, 352, i, quaternion[i]);
    for (std::size_t i = 0; i < 12; i++) real(280, 400, i, rows[i]);
    return bytes;
  }
};

template <class T>
void check_nifti(std::int16_t type) {
  for (const bool second : {false, true}) {
    for (const bool big_endian : {false, true}) {
      const Nifti nifti{.second = second, .big_endian = big_endian, .type = type};
      const std::string bytes = nifti.header() + samples<T>(big_endian);
      expect_samples<T>(load_volume(put("v.nii", bytes)));
      expect_samples<T>(load_volume(put("v.nii.gz", packed(bytes, wbits_gzip))));
    }
  }
}

TEST(NiftiFiles, every_type_version_and_byte_order) {
  check_nifti<std::uint8_t>(2);
  check_nifti<std::int16_t>(4);
  check_nifti<std::int32_t>(8);
  check_nifti<float>(16);
  check_nifti<double>(64);
  check_nifti<std::int8_t>(256);
  check_nifti<std::uint16_t>(512);
  check_nifti<std::uint32_t>(768);
  check_nifti<std::int64_t>(1024);
  check_nifti<std::uint64_t>(1280);
}

TEST(NiftiFiles, placement) {
  const auto placed = [](const Nifti& nifti) {
    return load_volume(put("v.nii", nifti.header() + samples<std::uint8_t>(false))).placement();
  };
  for (const bool second : {false, true}) {
    Nifti nifti{.second = second, .steps = {1, 0.5, 2, 3}};
    EXPECT_EQ(placed(nifti).axes, spacing(0.5, 2, 3).axes);
    EXPECT_EQ(placed(nifti).origin, glm::dvec3(0.0));
    // A turn by 120 degrees about (1, 1, 1): x to y, y to z, z to x. b = c = d = 1/2, exact in floats.
    nifti.qform = 1;
    const double turn[] = {0.5, 0.5, 0.5, 10, -20, 30.5};
    std::copy(std::begin(turn), std::end(turn), nifti.quaternion);
    EXPECT_EQ(placed(nifti).axes, glm::dmat3(0, 0.5, 0, 0, 0, 2, 3, 0, 0));
    EXPECT_EQ(placed(nifti).origin, glm::dvec3(10, -20, 30.5));
    nifti.steps[0] = -1;  // the third axis runs the other way
    EXPECT_EQ(placed(nifti).axes, glm::dmat3(0, 0.5, 0, 0, 0, 2, -3, 0, 0));
    nifti.sform = 2;
    const double rows[] = {1, 2, 0, 5, 0, 4, 0, 6, 0.5, 0, 8, 7};
    std::copy(std::begin(rows), std::end(rows), nifti.rows);
    EXPECT_EQ(placed(nifti).axes, glm::dmat3(1, 0, 0.5, 2, 4, 0, 0, 0, 8));
    EXPECT_EQ(placed(nifti).origin, glm::dvec3(5, 6, 7));
  }
}

TEST(NiftiFiles, slope_and_intercept) {
  const Nifti nifti{.type = 4, .slope = 0.25, .intercept = -10};
  const Volume volume = load_volume(put("v.nii", nifti.header() + samples<std::int16_t>(false)));
  EXPECT_EQ(volume.type(), SampleType::float32);
  for (std::size_t i = 0; i < nodes; i++) ASSERT_EQ(volume.at(i), 0.25 * double(37 * i) - 10);
  const Nifti plain{.type = 4, .slope = 1, .intercept = 0};
  expect_samples<std::int16_t>(load_volume(put("v.nii", plain.header() + samples<std::int16_t>(false))));
}

TEST(NiftiFiles, refuses) {
  const std::string bytes = samples<std::uint8_t>(false);
  const auto load = [&](const Nifti& nifti) { load_volume(put("v.nii", nifti.header() + bytes)); };
  EXPECT_REFUSED(load({.type = 128}), "type 128 are no scalars");
  EXPECT_REFUSED(load({.sizes = {4, 5, 4, 3, 7}}), "4 axes of 5x4x3x7");
  EXPECT_REFUSED(load({.sizes = {2, 5, 4}}), "2 axes");
  EXPECT_REFUSED(load({.sizes = {3, 5, -4, 3}}), "at least 1");
  EXPECT_REFUSED(load({.steps = {1, 1, 0, 1}}), "spacing along axis 1 is 0");
  EXPECT_REFUSED(load_volume(put("v.nii", std::string(400, 'x'))), "no NIfTI file");
  std::string two_files = Nifti().header();
  two_files.replace(344, 3, "ni1");
  EXPECT_REFUSED(load_volume(put("v.nii", two_files)), "two files");
  EXPECT_REFUSED(load_volume(test_folder() / "missing.nii.gz"), "missing.nii.gz");
  EXPECT_REFUSED(load_volume(put("v.nii.gz", Nifti().header() + bytes)), "not compressed by gzip");
}

TEST(NiftiFiles, refuses_files_that_are_cut_short) {
  for (const bool second : {false, true}) {
    const Nifti nifti{.second = second, .type = 64};
    const std::string whole = nifti.header() + samples<double>(false), zipped = packed(whole, wbits_gzip);
    for (std::size_t bytes = 0; bytes < whole.size(); bytes += 97)
      EXPECT_REFUSED(load_volume(put("v.nii", whole.substr(0, bytes))), "v.nii\"");
    for (std::size_t bytes = 0; bytes < zipped.size(); bytes += 97)
      EXPECT_REFUSED(load_volume(put("v.nii.gz", zipped.substr(0, bytes))), "v.nii.gz\"");
    EXPECT_REFUSED(load_volume(put("v.nii", whole.substr(0, whole.size() - 80))),
                   "asks for 480 bytes of data, but there are 400");
    EXPECT_REFUSED(load_volume(put("v.nii", whole + "more")), "asks for 480 bytes");
  }
}

}  // namespace
}  // namespace smurf
