// Volumes: construction, statistics, the Marschner-Lobb signal, and NRRD files of every kind, written here byte by
// byte.
#include "smurf/volume.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <thread>

#include "harness/files/test_files.hpp"
#include "harness/refusal.hpp"
#include "smurf/error.hpp"

namespace smurf {
namespace {

namespace fs = std::filesystem;
using test::put;
using test::test_folder;

std::string gzip(const std::string& bytes) { return test::packed(bytes, test::wbits_gzip); }

template <class T>
std::string bytes_of(const std::vector<T>& values, bool big_endian) {
  std::string out(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  if (big_endian == (std::endian::native == std::endian::little))
    for (std::size_t i = 0; i < out.size(); i += sizeof(T))
      std::reverse(out.begin() + long(i), out.begin() + long(i + sizeof(T)));
  return out;
}

template <class T>
std::string text_of(const std::vector<T>& values) {
  std::ostringstream out;
  out.precision(std::numeric_limits<T>::max_digits10);
  for (std::size_t i = 0; i < values.size(); i++) out << +values[i] << (i % 5 == 4 ? "\n" : i % 3 == 1 ? ", " : " ");
  return out.str();
}

// Values over the whole range of the type, with its extremes.
template <class T>
std::vector<T> test_values(std::size_t count) {
  std::mt19937_64 random(7);
  std::vector<T> values(count);
  for (T& value : values) {
    if constexpr (std::is_floating_point_v<T>)
      value = T(std::ldexp(double(random()) / 1e19 - 0.9, int(random() % 60) - 30));
    else value = T(random());
  }
  values[0] = std::numeric_limits<T>::lowest();
  values[1] = std::numeric_limits<T>::max();
  return values;
}

// ---- Construction

TEST(Volume, refuses_what_cannot_be_a_grid) {
  const std::vector<float> samples(24, 1.0f);
  const auto make = [&](glm::ivec3 size, const GridPlacement& placement = {}) {
    return borrow_volume(std::span(samples), size, placement);
  };
  EXPECT_REFUSED(make({0, 4, 6}), "0 x 4 x 6");
  EXPECT_REFUSED(make({-2, -2, 6}), "at least 1");
  EXPECT_REFUSED(make({2, 3, 5}), "120 bytes, but 96 were given");
  EXPECT_REFUSED(make({2000, 2000, 2000}), "2147483647");
  EXPECT_REFUSED(make({2147483647, 2147483647, 2147483647}), "2147483647");
  EXPECT_REFUSED(make({2, 3, 4}, spacing(1, 0, 1)), "axis 1");
  EXPECT_REFUSED(make({2, 3, 4}, spacing(1, 1, NAN)), "finite");
  EXPECT_REFUSED(make({2, 3, 4}, spacing(1, INFINITY, 1)), "finite");
  EXPECT_REFUSED(make({2, 3, 4}, {.axes = glm::dmat3(1, 2, 3, 4, 5, 6, 7, 8, 9), .origin = {}}), "singular");
  EXPECT_REFUSED(make({2, 3, 4}, {.axes = glm::dmat3(1.0), .origin = {0, NAN, 0}}), "origin");
  EXPECT_REFUSED(Volume(nullptr, SampleType::uint8, {1, 1, 1}, {}), "no samples");
}

TEST(Volume, borrows_without_copy) {
  std::vector<std::int16_t> samples = test_values<std::int16_t>(24);
  const GridPlacement tiny = spacing(1e-160, 2e-160, 1e160);  // squares of these leave the range of double
  const Volume volume = borrow_volume(std::span<const std::int16_t>(samples), {4, 3, 2}, tiny);
  EXPECT_EQ(volume.samples(), samples.data());
  EXPECT_EQ(volume.count(), 24u);
  EXPECT_EQ(volume.bytes(), 48u);
  EXPECT_EQ(volume.type(), SampleType::int16);
  for (std::size_t i = 0; i < 24; i++) EXPECT_EQ(volume.at(i), samples[i]);
  const Volume flat = borrow_volume(std::span<const std::int16_t>(samples), {24, 1, 1});  // no cells, but a volume
  EXPECT_EQ(flat.size(), glm::ivec3(24, 1, 1));
}

template <class T>
void check_statistics() {
  const std::vector<T> samples = test_values<T>(1000);
  const Volume volume = borrow_volume(std::span<const T>(samples), {10, 10, 10});
  EXPECT_EQ(volume.minimum(), double(*std::ranges::min_element(samples)));
  EXPECT_EQ(volume.maximum(), double(*std::ranges::max_element(samples)));
  EXPECT_EQ(volume.non_finite(), 0u);
  EXPECT_EQ(size_of(volume.type()), sizeof(T));
}

TEST(Volume, statistics_of_every_type) {
  check_statistics<std::uint8_t>();
  check_statistics<std::int8_t>();
  check_statistics<std::uint16_t>();
  check_statistics<std::int16_t>();
  check_statistics<std::uint32_t>();
  check_statistics<std::int32_t>();
  check_statistics<std::uint64_t>();
  check_statistics<std::int64_t>();
  check_statistics<float>();
  check_statistics<double>();
}

TEST(Volume, statistics_pass_over_what_is_not_finite) {
  const std::vector<float> mixed{NAN, 3.0f, INFINITY, -2.0f, -INFINITY, NAN, 1.0f, 0.0f};
  const Volume volume = borrow_volume(std::span(mixed), {2, 2, 2});
  EXPECT_EQ(volume.minimum(), -2.0);
  EXPECT_EQ(volume.maximum(), 3.0);
  EXPECT_EQ(volume.non_finite(), 4u);
  const std::vector<double> none(8, double(NAN));
  const Volume empty = borrow_volume(std::span(none), {2, 2, 2});
  EXPECT_EQ(empty.minimum(), 0.0);
  EXPECT_EQ(empty.maximum(), 0.0);
  EXPECT_EQ(empty.non_finite(), 8u);
}

TEST(Volume, statistics_may_be_asked_for_by_several_threads) {
  const Volume volume = marschner_lobb_volume(40);
  std::vector<double> answers(8);
  std::vector<std::jthread> threads;
  threads.reserve(answers.size());
  for (double& answer : answers)
    threads.emplace_back([&answer, copy = volume] { answer = copy.maximum() - copy.minimum(); });
  threads.clear();
  for (const double answer : answers) EXPECT_EQ(answer, answers[0]);
}

TEST(Volume, marschner_lobb) {
  const Volume volume = marschner_lobb_volume(41);
  EXPECT_EQ(volume.size(), glm::ivec3(41));
  EXPECT_EQ(volume.placement().origin, glm::dvec3(-1.0));
  EXPECT_DOUBLE_EQ(volume.placement().axes[1].y, 0.05);
  const double pi = std::acos(-1.0);
  for (std::size_t index = 0; index < volume.count(); index += 17) {
    const std::size_t k = index / (std::size_t(41) * 41), j = index / 41 % 41;
    const double x = -1 + 0.05 * double(index % 41), y = -1 + 0.05 * double(j), z = -1 + 0.05 * double(k);
    const double rho = std::cos(12 * pi * std::cos(pi * std::hypot(x, y) / 2));
    EXPECT_NEAR(volume.at(index), ((1 - std::sin(pi * z / 2)) + (1 + rho) / 4) / 2.5, 1e-7);
  }
  EXPECT_GE(volume.minimum(), 0.0);
  EXPECT_LE(volume.maximum(), 1.0);
  EXPECT_REFUSED(marschner_lobb_volume(1), "at least 2");
  EXPECT_REFUSED(marschner_lobb_volume(100000), "2147483647");
}

// ---- NRRD: what must be read

enum class Encoding { raw, gzip, ascii };

template <class T>
void check_nrrd(const char* type, Encoding encoding, bool big_endian, bool detached) {
  const std::vector<T> values = test_values<T>(5 * 4 * 3);
  const char* encoding_name = encoding == Encoding::raw ? "raw" : encoding == Encoding::gzip ? "gzip" : "ascii";
  SCOPED_TRACE(testing::Message() << type << ' ' << encoding_name << (big_endian ? " big" : " little")
                                  << (detached ? " detached" : ""));
  const std::string plain = encoding == Encoding::ascii ? text_of(values) : bytes_of(values, big_endian);
  const std::string data = encoding == Encoding::gzip ? gzip(plain) : plain;
  std::string header =
      std::string("NRRD0004\n# made by a test\ntype: ") + type + "\ndimension: 3\nsizes: 5 4 3\nspacings: 1 2 0.5\n";
  if (sizeof(T) > 1 && encoding != Encoding::ascii)
    header += std::string("endian: ") + (big_endian ? "big" : "little") + "\n";
  header += std::string("encoding: ") + encoding_name + "\ncontent: any\nkey:=value\n";
  const fs::path file = test_folder() / (detached ? "volume.nhdr" : "volume.nrrd");
  if (detached) {
    put(file.parent_path() / "volume.data", data);
    put(file, header + "data file: volume.data\n");
  } else {
    put(file, header + "\n" + data);
  }
  const Volume volume = load_volume(file);
  EXPECT_EQ(volume.type(), sample_type_of<T>());
  ASSERT_EQ(volume.size(), glm::ivec3(5, 4, 3));
  EXPECT_EQ(volume.placement().axes, spacing(1, 2, 0.5).axes);
  EXPECT_EQ(volume.placement().origin, glm::dvec3(0.0));
  EXPECT_EQ(std::memcmp(volume.samples(), values.data(), values.size() * sizeof(T)), 0);
  for (std::size_t i = 0; i < values.size(); i++) EXPECT_EQ(volume.at(i), double(values[i]));
}

template <class T>
void check_nrrd_type(std::initializer_list<const char*> names) {
  for (const char* name : names)
    for (const Encoding encoding : {Encoding::raw, Encoding::gzip, Encoding::ascii})
      for (const bool big_endian : {false, true})
        for (const bool detached : {false, true}) check_nrrd<T>(name, encoding, big_endian, detached);
}

TEST(Nrrd, every_type_encoding_and_byte_order) {
  check_nrrd_type<std::uint8_t>({"unsigned char", "uchar", "uint8", "uint8_t"});
  check_nrrd_type<std::int8_t>({"signed char", "int8"});
  check_nrrd_type<std::uint16_t>({"unsigned short", "ushort", "uint16"});
  check_nrrd_type<std::int16_t>({"short", "int16_t"});
  check_nrrd_type<std::uint32_t>({"unsigned int", "uint32"});
  check_nrrd_type<std::int32_t>({"int", "int32"});
  check_nrrd_type<std::uint64_t>({"unsigned long long", "uint64"});
  check_nrrd_type<std::int64_t>({"long long", "int64_t"});
  check_nrrd_type<float>({"float"});
  check_nrrd_type<double>({"double"});
}

// A volume of 2 x 3 x 4 bytes 0, 1, 2 … whose header has these lines beside type, sizes and encoding.
std::string simple(const std::string& lines) {
  std::string data;
  for (char i = 0; i < 24; i++) data += i;
  return "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n" + lines + "\n" + data;
}

Volume load_bytes(const std::string& bytes) {
  const fs::path file = test_folder() / "volume.nrrd";
  put(file, bytes);
  return load_volume(file);
}

TEST(Nrrd, placement) {
  const GridPlacement none = load_bytes(simple("")).placement();
  EXPECT_EQ(none.axes, glm::dmat3(1.0));
  const GridPlacement sheared = load_bytes(simple("space: left-posterior-superior\nspace directions: (1,0,0) "
                                                  "(0.5,-2,0) (0,0.25,3e0)\nspace origin: (-10,20.5,30)\n"))
                                    .placement();
  EXPECT_EQ(sheared.axes, glm::dmat3(1, 0, 0, 0.5, -2, 0, 0, 0.25, 3));
  EXPECT_EQ(sheared.origin, glm::dvec3(-10, 20.5, 30));
  const GridPlacement mins = load_bytes(simple("spacings: 1 2 3\naxis mins: -1 -2 5\n")).placement();
  EXPECT_EQ(mins.axes, spacing(1, 2, 3).axes);
  EXPECT_EQ(mins.origin, glm::dvec3(-1, -2, 5));
  const GridPlacement cells =
      load_bytes(simple("spacings: 1 2 3\naxis mins: -1 -2 5\ncenters: cell node cell\n")).placement();
  EXPECT_EQ(cells.origin, glm::dvec3(-0.5, -2, 6.5));
  const GridPlacement ranges = load_bytes(simple("axis mins: -1 -1 -1\naxis maxs: 1 1 2\n")).placement();
  EXPECT_EQ(ranges.axes, spacing(2, 1, 1).axes);
  const GridPlacement shifted =
      load_bytes(simple("space dimension: 3\nspacings: 1 1 2\nspace origin: (1,2,3)\n")).placement();
  EXPECT_EQ(shifted.origin, glm::dvec3(1, 2, 3));
}

TEST(Nrrd, forms_of_the_file) {
  const std::size_t data = simple("spacings: 1 1 2\n").size() - 24;
  std::string header;
  for (const char c : simple("spacings: 1 1 2\n").substr(0, data)) header += c == '\n' ? "\r\n" : std::string(1, c);
  EXPECT_EQ(load_bytes(header + simple("").substr(simple("").size() - 24)).placement().axes, spacing(1, 1, 2).axes);

  const std::string bytes = simple("").substr(simple("").size() - 24);
  const std::string vectors =
      "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 1 2 3 4\nencoding: raw\nspacings: nan 1 1 2\n\n";
  EXPECT_EQ(load_bytes(vectors + bytes).size(), glm::ivec3(2, 3, 4));
  EXPECT_EQ(load_bytes(simple("line skip: 2\n").replace(simple("line skip: 2\n").size() - 24, 0, "one\ntwo\n")).at(23),
            23);
  EXPECT_EQ(load_bytes(simple("byte skip: 5\n").replace(simple("byte skip: 5\n").size() - 24, 0, "12345")).at(23), 23);
  EXPECT_EQ(load_bytes(simple("byte skip: -1\n").replace(simple("byte skip: -1\n").size() - 24, 0, "any")).at(0), 0);
  EXPECT_EQ(load_bytes(simple("byte skip: -4\n") + "end").at(23), 23);

  const std::string zipped = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 3 4\nencoding: gzip\n";
  EXPECT_EQ(load_bytes(zipped + "byte skip: 3\n\n" + gzip("abc" + bytes)).at(23), 23);
  EXPECT_EQ(load_bytes(zipped + "byte skip: -1\n\n" + gzip("abc" + bytes)).at(23), 23);
  EXPECT_EQ(load_bytes(zipped + "\n" + gzip(bytes.substr(0, 10)) + gzip(bytes.substr(10))).at(23), 23);  // two members

  const fs::path folder = test_folder();
  fs::create_directories(folder / "data");
  put(folder / "data" / "v.raw", bytes);
  const std::string detached = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 3 4\nencoding: raw\ndata file: ";
  put(folder / "relative.nhdr", detached + "data/v.raw\n");
  EXPECT_EQ(load_volume(folder / "relative.nhdr").at(7), 7);
  put(folder / "absolute.nhdr", detached + fs::absolute(folder / "data" / "v.raw").string());
  EXPECT_EQ(load_volume(folder / "absolute.nhdr").at(7), 7);
}

TEST(Nrrd, bundled_head) {
  const Volume head = load_volume(fs::path(SMURF_SOURCE_DIR) / "host/data/headsq.nhdr");
  EXPECT_EQ(head.size(), glm::ivec3(64, 64, 93));
  EXPECT_EQ(head.type(), SampleType::uint16);
  EXPECT_EQ(head.placement().axes, spacing(3.2, 3.2, 1.5).axes);
  EXPECT_EQ(head.minimum(), 0.0);
  EXPECT_EQ(head.maximum(), 3926.0);
}

// ---- NRRD: what must be refused

TEST(Nrrd, refuses_files) {
  const fs::path folder = test_folder();
  EXPECT_REFUSED(load_volume(folder / "missing.nrrd"), "missing.nrrd");
  EXPECT_REFUSED(load_volume(folder), "no regular file");
  EXPECT_REFUSED(load_bytes(""), "volume.nrrd");
  EXPECT_REFUSED(load_bytes("P5\n2 2\n255\nabcd"), "no NRRD file");
  EXPECT_REFUSED(load_bytes("NRRD0009\ntype: uint8\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n\n"), "NRRD0009");
  EXPECT_REFUSED(load_bytes("NRRD0004\ntype: uint8\n"), "ends within its header");
  const std::string detached = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 3 4\nencoding: raw\ndata file: ";
  put(folder / "v.nhdr", detached + "nothing.raw\n");
  EXPECT_REFUSED(load_volume(folder / "v.nhdr"), "nothing.raw");
  for (const char* several : {"LIST", "slice%03d.raw 1 4 1", "%n%s 1 4 1", "x%100000d 0 2147483647 1"}) {
    put(folder / "v.nhdr", detached + several + "\nv.raw\n");
    EXPECT_REFUSED(load_volume(folder / "v.nhdr"), "several files");
  }
}

TEST(Nrrd, refuses_data_of_another_length) {
  const std::string whole = simple("");
  EXPECT_REFUSED(load_bytes(whole.substr(0, whole.size() - 1)), "asks for 24 bytes of data, but there are 23");
  EXPECT_REFUSED(load_bytes(whole + "x"), "25");
  const std::string bytes = whole.substr(whole.size() - 24);
  const std::string zipped = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 3 4\nencoding: gzip\n\n";
  EXPECT_REFUSED(load_bytes(zipped + gzip(bytes.substr(1))), "23");
  EXPECT_REFUSED(load_bytes(zipped + gzip(bytes + "x")), "more");
  EXPECT_REFUSED(load_bytes(zipped + gzip(bytes).substr(0, 20)), "truncated");
  EXPECT_REFUSED(load_bytes(zipped + bytes), "not compressed");
  std::string damaged = gzip(bytes);
  damaged[damaged.size() - 6] ^= 1;  // the checksum
  EXPECT_REFUSED(load_bytes(zipped + damaged), "damaged");
  const std::string text = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 2 2\nencoding: ascii\n\n";
  EXPECT_EQ(load_bytes(text + "1 2 3 4").at(3), 4);
  EXPECT_REFUSED(load_bytes(text + "1 2   3"), "there are 3");
  EXPECT_REFUSED(load_bytes(text + "1 2 3 4 5"), "there are more");
  EXPECT_REFUSED(load_bytes(text + "1 2 x 4"), "\"x\"");
  EXPECT_REFUSED(load_bytes(text + "1 2 2.5 4"), "\"2.5\"");
  EXPECT_REFUSED(load_bytes(text + "1 2 256 4"), "does not fit");
  EXPECT_REFUSED(load_bytes(text + "1 2 3 " + std::string(100000, '7')), "does not fit");
}

std::string with_line(const std::string& from, const std::string& to) {
  std::string bytes = simple("");
  return bytes.replace(bytes.find(from), from.size(), to);
}

TEST(Nrrd, refuses_headers) {
  EXPECT_REFUSED(load_bytes(simple("spacings: 1 0 1\n")), "spacing");
  EXPECT_REFUSED(load_bytes(simple("spacings: 1 1 -2\n")), "spacing along axis 2 is -2; it must be positive");
  EXPECT_REFUSED(load_bytes(simple("spacings: 1 nan 1\n")), "spacing along axis 1");
  EXPECT_REFUSED(load_bytes(simple("spacings: 1 inf 1\n")), "spacing");
  EXPECT_REFUSED(load_bytes(simple("spacings: 1 1\n")), "parsed 2 values");
  EXPECT_REFUSED(load_bytes(simple("spacings: 1 1 1mm\n")), "\"1mm\"");
  EXPECT_REFUSED(load_bytes(simple("space dimension: 3\nspace directions: (1,0,0) (2,0,0) (0,0,1)\n")), "singular");
  EXPECT_REFUSED(load_bytes(simple("space dimension: 3\nspace directions: (1,0,0) (0,0,0) (0,0,1)\n")),
                 "axis 1 is zero");
  EXPECT_REFUSED(load_bytes(simple("space dimension: 3\nspace directions: (1,0,0) none (0,0,1)\n")), "axis 1");
  EXPECT_REFUSED(load_bytes(simple("space dimension: 2\nspace directions: (1,0) (0,1) (1,1)\n")),
                 "space dimension is 2");
  EXPECT_REFUSED(load_bytes(simple("space dimension: 3\nspace directions: (1,0,0 (0,1,0) (0,0,1)\n")), "header");
  EXPECT_REFUSED(load_bytes(simple("space directions: (1,0,0) (0,1,0) (0,0,1)\n")), "space dimension");
  EXPECT_REFUSED(load_bytes(simple("sizes: 2 3 4\n")), "already set");
  EXPECT_REFUSED(load_bytes(simple("nonsense\n")), "nonsense");
  EXPECT_REFUSED(load_bytes(simple("spacing: 1 1 1\n")), "spacing: 1 1 1");
  EXPECT_REFUSED(load_bytes(with_line("dimension: 3", "dimension: 2")), "dimension is 2; a volume must have 3");
  EXPECT_REFUSED(load_bytes(with_line("dimension: 3\nsizes: 2 3 4", "dimension: 4\nsizes: 2 3 4 1")), "dimension is 4");
  EXPECT_REFUSED(load_bytes(with_line("dimension: 3", "dimension: 16")), "dimension is 16");
  EXPECT_REFUSED(load_bytes(with_line("dimension: 3", "dimension: three")), "\"three\"");
  EXPECT_REFUSED(load_bytes(with_line("sizes: 2 3 4", "sizes: 2 3")), "parsed 2 values");
  EXPECT_REFUSED(load_bytes(with_line("sizes: 2 3 4", "sizes: 2 3 4 5")), "more than expected");
  EXPECT_REFUSED(load_bytes(with_line("sizes: 2 3 4", "sizes: 2 0 4")), "at least 1");
  EXPECT_REFUSED(load_bytes(with_line("sizes: 2 3 4", "sizes: 2 -3 4")), "at least 1");
  EXPECT_REFUSED(load_bytes(with_line("sizes: 2 3 4", "sizes: 2 3 18446744073709551620")), "too great");
  EXPECT_REFUSED(load_bytes(with_line("sizes: 2 3 4", "sizes: 1000000 1000000 1000000")), "2^31-1");
  EXPECT_REFUSED(load_bytes(with_line("sizes: 2 3 4", "sizes: 1290 1290 1290")), "asks for 2146689000 bytes");
  EXPECT_REFUSED(load_bytes(with_line("type: uint8", "type: block\nblock size: 4")), "block");
  EXPECT_REFUSED(load_bytes(with_line("type: uint8", "type: complex")), "complex");
  EXPECT_REFUSED(load_bytes(with_line("type: uint8\n", "")), "lacks the field \"type\"");
  EXPECT_REFUSED(load_bytes(with_line("sizes: 2 3 4\n", "")), "lacks the field \"sizes\"");
  EXPECT_REFUSED(load_bytes(with_line("encoding: raw\n", "")), "lacks the field \"encoding\"");
  EXPECT_REFUSED(load_bytes(with_line("encoding: raw", "encoding: hex")), "hex");
  EXPECT_REFUSED(load_bytes(with_line("encoding: raw", "encoding: rar")), "rar");
  EXPECT_REFUSED(load_bytes(with_line("uint8", "uint16")), "endian");
  EXPECT_REFUSED(load_bytes(simple("byte skip: 100\n")), "byte skip");
  EXPECT_REFUSED(load_bytes(simple("line skip: 100\n")), "lines to be skipped");
  EXPECT_REFUSED(load_bytes(simple("centers: " + std::string(5000, 'x') + "\n")), "too long");
  const std::string large =
      "NRRD0004\ntype: double\ndimension: 3\nsizes: 1290 1290 1290\nencoding: gzip\nendian: little\n\n";
  EXPECT_REFUSED(load_bytes(large + gzip("short")), "17173512000 bytes");
  std::string ascii = large;
  EXPECT_REFUSED(load_bytes(ascii.replace(ascii.find("gzip"), 4, "ascii") + "1 2 3"), "2146689000 samples");
}

// Damage of every kind to headers: each file is either read or refused.
TEST(Nrrd, survives_mutated_files) {
  const std::vector<std::string> seeds{
      simple("spacings: 1 2 3\naxis mins: 0 0 0\ncenters: node node cell\nlabels: \"a\" \"b\" \"c\"\nkinds: domain "
             "domain domain\n"),
      simple("space: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (1,2,3)\n"
             "measurement frame: (1,0,0) (0,1,0) (0,0,1)\nspace units: \"mm\" \"mm\" \"mm\"\n"),
      "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 3 4\nendian: big\nencoding: gzip\nbyte skip: 0\n\n" +
          gzip(std::string(48, 'a')),
      "NRRD0001\ntype: float\ndimension: 3\nsizes: 2 1 2\nencoding: ascii\nline skip: 0\n\n1 2e3 nan -0.5"};
  const std::vector<std::string> pieces{"0",
                                        "-1",
                                        "4294967296",
                                        "nan",
                                        "none",
                                        "(",
                                        ")",
                                        "1e400",
                                        "\n",
                                        "\n\n",
                                        ": ",
                                        ":=",
                                        "\"",
                                        "%s%n",
                                        " ",
                                        std::string(3000, '9'),
                                        std::string(2000, 'A'),
                                        std::string(1, '\0'),
                                        "sizes: 9 9 9\n",
                                        "dimension: 4\n",
                                        "block size: 8\n",
                                        "data file: LIST\n",
                                        "space dimension: 9\n",
                                        "byte skip: -9\n",
                                        "type: double\n"};
  std::mt19937 random(11);
  const auto below = [&](std::size_t bound) { return std::size_t(random() % std::max<std::size_t>(bound, 1)); };
  int read = 0, refused = 0;
  for (int round = 0; round < 3000; round++) {
    std::string bytes = seeds[below(seeds.size())];
    for (std::size_t changes = 1 + below(2); changes > 0; changes--) {
      const std::size_t place = below(bytes.size());
      switch (below(5)) {
        case 0:
          bytes[place] = char(random());
          break;
        case 1:
          bytes.erase(place, below(random() % 8 == 0 ? 200 : 8));
          break;
        case 2:
          bytes.insert(place, pieces[below(pieces.size())]);
          break;
        case 3:
          bytes.insert(place, bytes.substr(below(bytes.size()), below(40)));
          break;
        default:
          std::swap(bytes[place], bytes[below(bytes.size())]);
          break;
      }
      if (bytes.empty()) bytes = "N";
    }
    try {
      const Volume volume = load_bytes(bytes);
      EXPECT_LE(volume.minimum(), volume.maximum());
      read++;
    } catch (const Error& error) {
      EXPECT_EQ(int(error.code()), int(ErrorCode::input)) << error.what();
      EXPECT_LT(std::strlen(error.what()), 2000u);
      refused++;
    }
  }
  EXPECT_GT(read, 150);  // else the test damages too much
  EXPECT_GT(refused, 1500);
}

}  // namespace
}  // namespace smurf
