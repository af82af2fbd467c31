// PLY (Turk 1994), as text and binary of both byte orders: the elements `vertex` (x, y, z), `face` (vertex_indices or
// vertex_index) and `tristrips`; other properties are skipped, other elements skipped and counted.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <functional>
#include <optional>

#include "io/mesh_file.hpp"
#include "io/word_reader.hpp"

namespace smurf {
namespace {

using std::filesystem::path;
using Index = std::int64_t;

enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
enum class Format { text, little, big };

struct Property {
  std::string name;
  Type type;
  std::optional<Type> count_type = {};  // of lists
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties = {};
};

struct Header {
  Format format = Format::text;
  std::vector<Element> elements = {};
};

std::size_t size_of(Type type) {
  static constexpr std::array<std::size_t, 8> sizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[std::size_t(type)];
}

bool is_integer(Type type) { return type < Type::float32; }

Type read_type(WordReader& reader) {
  static constexpr std::array<std::array<std::string_view, 2>, 8> names = {{{"char", "int8"},
                                                                            {"uchar", "uint8"},
                                                                            {"short", "int16"},
                                                                            {"ushort", "uint16"},
                                                                            {"int", "int32"},
                                                                            {"uint", "uint32"},
                                                                            {"float", "float32"},
                                                                            {"double", "float64"}}};
  const std::string_view word = reader.word_in_line();
  for (std::size_t i = 0; i < names.size(); i++) {
    if (word == names[i][0] || word == names[i][1]) return Type(i);
  }
  reader.fail(fmt::format("\"{}\" is no type of PLY files", WordReader::shown(word)));
}

Property read_property(WordReader& reader) {
  // The type, or "list" and two types, then the name.
  WordReader ahead = reader;
  Property property{{}, Type::int8};
  if (ahead.word_in_line() == "list") {
    reader.word_in_line();
    property.count_type = read_type(reader);
    if (!is_integer(*property.count_type)) reader.fail("the length of a list must be of a whole type");
  }
  property.type = read_type(reader);
  property.name = reader.word_in_line();
  return property;
}

Format read_format(WordReader& reader) {
  const std::string_view name = reader.word_in_line();
  if (name == "ascii") return Format::text;
  if (name == "binary_little_endian") return Format::little;
  if (name == "binary_big_endian") return Format::big;
  reader.fail(fmt::format("\"{}\" is no format of PLY files", WordReader::shown(name)));
}

Header read_header(WordReader& reader, std::size_t bytes) {
  if (reader.word_in_line() != "ply") reader.fail("a PLY file begins with \"ply\"");
  Header header;
  bool has_format = false;
  while (reader.next_line()) {
    const std::string_view word = reader.word_in_line();
    if (word == "format") {
      header.format = read_format(reader);
      has_format = true;
    } else if (word == "element") {
      Element element{std::string(reader.word_in_line())};
      const auto count = reader.number<Index>(reader.word_in_line(), "the number of elements");
      if (count < 0 || std::size_t(count) > bytes)  // each takes a byte
        reader.fail(fmt::format("{} elements \"{}\", but the file has {} bytes", count, WordReader::shown(element.name),
                                bytes));
      element.count = std::size_t(count);
      header.elements.push_back(element);
    } else if (word == "property") {
      if (header.elements.empty()) reader.fail("a property before any element");
      header.elements.back().properties.push_back(read_property(reader));
    } else if (word == "end_header") {
      if (!has_format) reader.fail("the header states no format");
      if (!reader.next_line()) reader.fail("the file ends after its header");
      return header;
    } else if (!word.empty() && word != "comment" && word != "obj_info") {
      reader.fail(fmt::format("\"{}\" is no statement of PLY headers", WordReader::shown(word)));
    }
  }
  reader.fail("the header has no end (end_header)");
}

// A number as the file has it: whole ones exactly, others as double.
struct Value {
  double real = 0;
  Index whole = 0;
};

// The values of elements one after the other.
class ValueReader {
 public:
  ValueReader(const path& file, const std::string& bytes, Format format, const WordReader& header_end)
      : file_(file), bytes_(bytes), format_(format), words_(header_end), at_(header_end.position()) {}

  void place(const std::string& element, std::size_t row) {
    element_ = &element;
    row_ = row;
  }

  Value read(Type type) { return format_ == Format::text ? read_text(type) : read_binary(type); }

  // A coordinate, rounded once.
  float read_coordinate(Type type) {
    if (format_ == Format::text) return words_.number<float>(next_word(), "a coordinate");
    return float(read_binary(type).real);
  }

  [[noreturn]] void fail(const std::string& message) const {
    if (format_ == Format::text) words_.fail(message);
    throw Error(ErrorCode::input, fmt::format("\"{}\", {} {}: {}", file_.string(), *element_, row_, message));
  }

  void expect_end() {
    if (format_ == Format::text) {
      const std::string_view word = words_.word();
      if (!word.empty()) words_.fail(fmt::format("\"{}\" follows after all elements", WordReader::shown(word)));
    } else if (at_ != bytes_.size()) {
      throw Error(ErrorCode::input,
                  fmt::format("\"{}\": {} bytes follow after all elements", file_.string(), bytes_.size() - at_));
    }
  }

 private:
  std::string_view next_word() {
    const std::string_view word = words_.word();
    if (word.empty()) words_.fail(fmt::format("the file ends within \"{}\" {}", *element_, row_));
    return word;
  }

  Value read_text(Type type) {
    const std::string_view word = next_word();
    if (!is_integer(type)) return {words_.number<double>(word, "a value"), 0};
    const auto whole = words_.number<Index>(word, "a value");
    return {double(whole), whole};
  }

  template <class T>
  Value as(const unsigned char* bytes) const {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    if constexpr (std::is_integral_v<T>) return {double(value), Index(value)};
    else return {double(value), 0};
  }

  Value read_binary(Type type) {
    const std::size_t size = size_of(type);
    if (bytes_.size() - at_ < size) fail("the file ends here");
    std::array<unsigned char, 8> raw{};
    std::memcpy(raw.data(), bytes_.data() + at_, size);
    at_ += size;
    if ((format_ == Format::little) != (std::endian::native == std::endian::little))
      std::reverse(raw.begin(), raw.begin() + std::ptrdiff_t(size));
    switch (type) {
      case Type::int8:
        return as<std::int8_t>(raw.data());
      case Type::uint8:
        return as<std::uint8_t>(raw.data());
      case Type::int16:
        return as<std::int16_t>(raw.data());
      case Type::uint16:
        return as<std::uint16_t>(raw.data());
      case Type::int32:
        return as<std::int32_t>(raw.data());
      case Type::uint32:
        return as<std::uint32_t>(raw.data());
      case Type::float32:
        return as<float>(raw.data());
      case Type::float64:
        return as<double>(raw.data());
    }
    return {};
  }

  const path& file_;
  const std::string& bytes_;
  Format format_;
  WordReader words_;
  std::size_t at_;
  const std::string* element_ = nullptr;
  std::size_t row_ = 0;
};

bool is_corner_list(const Property& p) { return p.name == "vertex_indices" || p.name == "vertex_index"; }

bool has_list(const Element& element) {
  return std::ranges::any_of(element.properties,
                             [](const Property& p) { return is_corner_list(p) && p.count_type && is_integer(p.type); });
}

void check_elements(const path& file, const Header& header) {
  for (const Element& element : header.elements) {
    const auto has = [&](const char* name) {
      return std::ranges::any_of(element.properties,
                                 [&](const Property& p) { return p.name == name && !p.count_type; });
    };
    if (element.name == "vertex" && !(has("x") && has("y") && has("z")))
      throw Error(ErrorCode::input, fmt::format("\"{}\": the vertices have no x, y and z", file.string()));
    if ((element.name == "face" || element.name == "tristrips") && !has_list(element))
      throw Error(ErrorCode::input,
                  fmt::format("\"{}\": the element \"{}\" has no list vertex_indices of whole numbers", file.string(),
                              element.name));
  }
}

// A list's values, or one value.
std::vector<Value> read_values(ValueReader& reader, const Property& property) {
  if (!property.count_type) return {reader.read(property.type)};
  const Index count = reader.read(*property.count_type).whole;
  if (count < 0) reader.fail(fmt::format("a list of {} values", count));
  std::vector<Value> values;
  values.reserve(std::size_t(std::min<Index>(count, 16)));
  for (Index i = 0; i < count; i++) values.push_back(reader.read(property.type));
  return values;
}

void add_vertex(ValueReader& reader, const Element& element, Polygons& polygons) {
  glm::vec3 vertex(0.0f);
  for (const Property& property : element.properties) {
    const std::size_t axis = std::string_view("xyz").find(property.name);
    if (property.name.size() == 1 && axis != std::string_view::npos && !property.count_type)
      vertex[int(axis)] = reader.read_coordinate(property.type);
    else read_values(reader, property);
  }
  polygons.vertices.push_back(vertex);
}

std::uint32_t corner(const ValueReader& reader, Index index, std::size_t vertices) {
  if (index < 0 || index >= Index(vertices))
    reader.fail(
        fmt::format("a corner names vertex {}, but there are {} (0 to {})", index, vertices, Index(vertices) - 1));
  return std::uint32_t(index);
}

void add_face(const ValueReader& reader, const std::vector<Value>& corners, std::size_t vertices, Polygons& polygons) {
  for (const Value& value : corners) polygons.corners.push_back(corner(reader, value.whole, vertices));
  polygons.sizes.push_back(std::uint32_t(corners.size()));
}

// Strips of triangles, -1 between them; every other triangle runs backwards.
void add_strips(const ValueReader& reader, const std::vector<Value>& corners, std::size_t vertices,
                Polygons& polygons) {
  for (std::size_t begin = 0, i = 0; i < corners.size(); i++) {
    if (corners[i].whole == -1) begin = i + 1;
    if (i < begin + 2 || corners[i].whole == -1) continue;
    const bool backwards = (i - begin) % 2 == 1;
    for (const std::size_t k : {i - 2, backwards ? i : i - 1, backwards ? i - 1 : i})
      polygons.corners.push_back(corner(reader, corners[k].whole, vertices));
    polygons.sizes.push_back(3);
  }
}

}  // namespace

Polygons read_ply(const path& file, const std::string& bytes) {
  WordReader words(file, bytes, '\n');
  const Header header = read_header(words, bytes.size());
  check_elements(file, header);
  std::size_t vertices = 0;
  for (const Element& element : header.elements) vertices += element.name == "vertex" ? element.count : 0;

  ValueReader reader(file, bytes, header.format, words);
  Polygons polygons;
  for (const Element& element : header.elements) {
    const bool strips = element.name == "tristrips", faces = element.name == "face";
    const bool other = !strips && !faces && element.name != "vertex";
    for (std::size_t row = 0; row < element.count; row++) {
      reader.place(element.name, row);
      if (element.name == "vertex") {
        add_vertex(reader, element, polygons);
        continue;
      }
      for (const Property& property : element.properties) {
        const std::vector<Value> values = read_values(reader, property);
        if (!is_corner_list(property) || other) continue;
        strips ? add_strips(reader, values, vertices, polygons) : add_face(reader, values, vertices, polygons);
      }
    }
    if (other) polygons.ignored_elements += element.count;
  }
  reader.expect_end();
  return polygons;
}

}  // namespace smurf
