// Polygons of stream surfaces as VTK XML and as PLY.
#include <fmt/format.h>

#include <bit>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <string>

#include "io/atomic_file.hpp"
#include "io/writers/vtk_xml.hpp"
#include "smurf/error.hpp"
#include "smurf/stream_export.hpp"

namespace smurf {
namespace {

void put_vectors(VtkXmlWriter& xml, const char* name, const Column<glm::vec3>& vectors) {
  xml.array<float>(name, 3, 3 * vectors.size(), [&](std::size_t i) { return vectors[i / 3][int(i % 3)]; });
}

void put_numbers(VtkXmlWriter& xml, const char* name, const Column<float>& numbers) {
  xml.array<float>(name, 1, numbers.size(), [&](std::size_t i) { return numbers[i]; });
}

void write_vtp(const MeasuredPolygons& mesh, const std::filesystem::path& file) {
  const StreamPolygons& polygons = mesh.polygons;
  const std::size_t count = polygons.offsets.size() - 1;
  VtkXmlWriter xml(file, "PolyData");
  xml.open("Piece", {{"NumberOfPoints", polygons.places.size()}, {"NumberOfPolys", count}});
  xml.open("PointData");
  xml.array<float>("u", 1, polygons.places.size(), [&](std::size_t i) { return polygons.places[i].x; });
  xml.array<float>("tau", 1, polygons.places.size(), [&](std::size_t i) { return polygons.places[i].y; });
  put_vectors(xml, "normal", mesh.points.normal);
  put_numbers(xml, "gauss", mesh.points.gauss);
  put_numbers(xml, "mean", mesh.points.mean);
  put_numbers(xml, "k1", mesh.points.k1);
  put_numbers(xml, "k2", mesh.points.k2);
  xml.close();
  xml.open("Points");
  put_vectors(xml, "Points", mesh.points.location);
  xml.close();
  xml.open("Polys");
  xml.array<std::int64_t>("connectivity", 1, polygons.corners.size(),
                          [&](std::size_t i) { return polygons.corners[i]; });
  xml.array<std::int64_t>("offsets", 1, count, [&](std::size_t i) { return polygons.offsets[i + 1]; });
  xml.close();
  xml.commit();
}

// Numbers of four bytes, little endian whatever the machine.
class LittleEndian {
 public:
  explicit LittleEndian(const std::filesystem::path& file) : file_(file) { bytes_.reserve(capacity + 4096); }

  void text(std::string_view text) { bytes_ += text; }
  void put(std::uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) bytes_ += char(word >> shift & 255);
    if (bytes_.size() >= capacity) flush();
  }
  void put(float number) { put(std::bit_cast<std::uint32_t>(number)); }
  void put(const glm::vec3& v) {
    for (int c = 0; c < 3; c++) put(v[c]);
  }
  void commit() {
    flush();
    file_.commit();
  }

 private:
  static constexpr std::size_t capacity = std::size_t(1) << 20;

  void flush() {
    file_.write(bytes_);
    bytes_.clear();
  }

  AtomicFile file_;
  std::string bytes_;
};

void write_ply(const MeasuredPolygons& mesh, const std::filesystem::path& file) {
  const StreamPolygons& polygons = mesh.polygons;
  const PointProperties& points = mesh.points;
  const std::size_t count = polygons.offsets.size() - 1;
  LittleEndian out(file);
  out.text(fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", polygons.places.size()));
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "u", "v", "gauss", "mean", "k1", "k2"})
    out.text(fmt::format("property float {}\n", name));
  // The number of corners is a word: many small cells may share the side of a large one.
  out.text(fmt::format("element face {}\nproperty list uint int vertex_indices\nend_header\n", count));
  for (std::size_t i = 0; i < polygons.places.size(); i++) {
    out.put(points.location[i]);
    out.put(points.normal[i]);
    out.put(float(polygons.places[i].x));
    out.put(float(polygons.places[i].y));
    out.put(points.gauss[i]);
    out.put(points.mean[i]);
    out.put(points.k1[i]);
    out.put(points.k2[i]);
  }
  for (std::size_t i = 0; i < count; i++) {
    out.put(polygons.offsets[i + 1] - polygons.offsets[i]);
    for (std::size_t k = polygons.offsets[i]; k < polygons.offsets[i + 1]; k++) out.put(polygons.corners[k]);
  }
  out.commit();
}

}  // namespace

void save_polygons(const MeasuredPolygons& mesh, const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  for (char& c : ending) c = char(std::tolower(static_cast<unsigned char>(c)));
  if (ending == ".vtp") write_vtp(mesh, file);
  else if (ending == ".ply") write_ply(mesh, file);
  else
    throw Error(ErrorCode::usage,
                fmt::format("cannot write polygons to {}: the name must end in .vtp or .ply", file.string()));
}

}  // namespace smurf
