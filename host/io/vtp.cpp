// VTK XML PolyData: the document through pugixml, arrays inline in base64 (the format's header word is the number
// of bytes as UInt64). Words become a String array, which holds them one after another, each ended by a zero byte.
#include <bit>
#include <cstring>
#include <pugixml.hpp>
#include <stdexcept>

#include "io/atomic_file.hpp"
#include "io/result_table.hpp"

namespace smurf {
namespace {

std::string base64(std::string_view bytes) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) { return k < bytes.size() ? std::uint32_t(std::uint8_t(bytes[k])) : 0u; };
    const std::uint32_t word = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    for (int shift = 18; shift >= 0; shift -= 6) text += digits[word >> shift & 63];
  }
  const std::size_t padding = (3 - bytes.size() % 3) % 3;
  text.replace(text.size() - padding, padding, padding, '=');
  return text;
}

// The bytes of an array after its header word.
class Payload {
 public:
  Payload() : bytes_(sizeof(std::uint64_t), '\0') {}
  template <class T>
  void put(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void put_word(std::string_view word) {
    bytes_ += word;
    bytes_ += '\0';
  }
  std::string encoded() {
    const std::uint64_t size = bytes_.size() - sizeof(std::uint64_t);
    std::memcpy(bytes_.data(), &size, sizeof size);
    return base64(bytes_);
  }

 private:
  std::string bytes_;
};

template <class T>
constexpr const char* vtk_type() {
  if constexpr (std::is_same_v<T, float>) return "Float32";
  else if constexpr (std::is_same_v<T, std::uint32_t>) return "UInt32";
  else if constexpr (std::is_same_v<T, std::uint64_t>) return "UInt64";
  else if constexpr (std::is_same_v<T, std::int64_t>) return "Int64";
  else {
    static_assert(std::is_same_v<T, std::string_view>);
    return "String";
  }
}

void add_array(pugi::xml_node parent, const char* type, const std::string& name, int components, Payload& payload) {
  pugi::xml_node array = parent.append_child("DataArray");
  array.append_attribute("type") = type;
  array.append_attribute("Name") = name.c_str();
  if (components > 1) array.append_attribute("NumberOfComponents") = components;
  array.append_attribute("format") = "binary";
  array.text().set(payload.encoded().c_str());
}

void add_column(pugi::xml_node parent, const TableColumn& column, std::size_t rows) {
  std::visit(
      [&]<class T>(const Strided<T>& values) {
        Payload payload;
        for (std::size_t i = 0; i < rows; i++) {
          if constexpr (std::is_same_v<T, std::string_view>) payload.put_word(values[i]);
          else payload.put(values[i]);
        }
        add_array(parent, vtk_type<T>(), column.name, 1, payload);
      },
      column.values);
}

using FloatTriple = std::array<const Strided<float>*, 3>;

void add_triple(pugi::xml_node parent, const FloatTriple& triple, const std::string& name, std::size_t rows) {
  Payload payload;
  for (std::size_t i = 0; i < rows; i++)
    for (const Strided<float>* component : triple) payload.put((*component)[i]);
  add_array(parent, vtk_type<float>(), name, 3, payload);
}

// The three columns from `first` on, when they are the x, y and z of one vector.
bool is_triple(const std::vector<TableColumn>& columns, std::size_t first, FloatTriple& triple) {
  if (first + 3 > columns.size()) return false;
  const std::string stem = columns[first].name.substr(0, columns[first].name.size() - 1);
  for (std::size_t c = 0; c < 3; c++) {
    triple[c] = std::get_if<Strided<float>>(&columns[first + c].values);
    if (triple[c] == nullptr || columns[first + c].name != stem + "xyz"[c]) return false;
  }
  return true;
}

void add_vertices(pugi::xml_node piece, std::size_t rows) {
  pugi::xml_node vertices = piece.append_child("Verts");
  Payload connectivity, offsets;
  for (std::size_t i = 0; i < rows; i++) {
    connectivity.put(std::int64_t(i));
    offsets.put(std::int64_t(i + 1));
  }
  add_array(vertices, vtk_type<std::int64_t>(), "connectivity", 1, connectivity);
  add_array(vertices, vtk_type<std::int64_t>(), "offsets", 1, offsets);
}

struct XmlToFile : pugi::xml_writer {
  explicit XmlToFile(AtomicFile& file) : file(file) {}
  void write(const void* data, std::size_t size) override { file.write({static_cast<const char*>(data), size}); }
  AtomicFile& file;
};

}  // namespace

void write_vtp(const Table& table, const std::filesystem::path& file) {
  AtomicFile out(file);  // first, so that a place that cannot be written to is found before the work
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("VTKFile");
  root.append_attribute("type") = "PolyData";
  root.append_attribute("version") = "1.0";
  root.append_attribute("byte_order") = std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian";
  root.append_attribute("header_type") = "UInt64";
  pugi::xml_node piece = root.append_child("PolyData").append_child("Piece");
  piece.append_attribute("NumberOfPoints") = static_cast<unsigned long long>(table.rows());
  piece.append_attribute("NumberOfVerts") = static_cast<unsigned long long>(table.rows());
  pugi::xml_node point_data = piece.append_child("PointData");
  pugi::xml_node points = piece.append_child("Points");

  const std::vector<TableColumn>& columns = table.columns();
  bool located = false;
  for (std::size_t i = 0; i < columns.size(); i++) {
    FloatTriple triple;
    if (!is_triple(columns, i, triple)) {
      add_column(point_data, columns[i], table.rows());
      continue;
    }
    const std::string stem = columns[i].name.substr(0, columns[i].name.size() - 1);
    add_triple(stem.empty() ? points : point_data, triple, stem.empty() ? "Points" : stem, table.rows());
    located = located || stem.empty();
    i += 2;
  }
  if (!located) throw std::logic_error("a table without float columns x, y, z cannot be written as points");
  add_vertices(piece, table.rows());

  XmlToFile writer(out);
  document.save(writer, " ");
  out.commit();
}

}  // namespace smurf
