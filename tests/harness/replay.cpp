#include "harness/replay.hpp"

#include <fmt/format.h>

#include <bit>
#include <cctype>
#include <fstream>
#include <stdexcept>

namespace smurf::test {
namespace {

std::string nrrd_type(SampleType type) {
  switch (type) {
    case SampleType::float32:
      return "float";
    case SampleType::float64:
      return "double";
    default:
      return name_of(type);
  }
}

std::string file_name(std::string name) {
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '-';
  return name;
}

}  // namespace

std::filesystem::path output_folder() {
  const std::filesystem::path folder = SMURF_TEST_OUTPUT;
  std::filesystem::create_directories(folder);
  return folder;
}

std::filesystem::path save_volume(const Volume& volume, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  const glm::dmat3& a = volume.placement().axes;
  const glm::dvec3& o = volume.placement().origin;
  out << fmt::format("NRRD0004\ntype: {}\ndimension: 3\nspace dimension: 3\nsizes: {} {} {}\n",
                     nrrd_type(volume.type()), volume.size().x, volume.size().y, volume.size().z);
  out << "space directions:";
  for (int i = 0; i < 3; i++) out << fmt::format(" ({},{},{})", a[i].x, a[i].y, a[i].z);
  out << fmt::format("\nspace origin: ({},{},{})\n", o.x, o.y, o.z);
  if (size_of(volume.type()) > 1)
    out << "endian: " << (std::endian::native == std::endian::little ? "little" : "big") << "\n";
  out << "encoding: raw\n\n";
  out.write(static_cast<const char*>(volume.samples()), std::streamsize(volume.bytes()));
  if (!out) throw std::runtime_error("cannot write " + file.string());
  return file;
}

std::string replay_command(const std::string& name, const Volume& volume, double isovalue,
                           Reconstruction reconstruction, const Ray& ray, const std::string& device) {
  const std::filesystem::path base = output_folder() / file_name(name);
  const std::filesystem::path data = save_volume(volume, base.string() + ".nrrd");
  const std::string description = fmt::format(
      "{{\"kind\":\"isosurface\",\"isovalue\":{},\"field\":{{\"kind\":\"grid\",\"file\":\"{}\","
      "\"reconstruction\":\"{}\"}}}}\n",
      isovalue, data.filename().string(), name_of(reconstruction));
  return replay_command(name, description, ray, device);
}

std::string replay_command(const std::string& name, const Mesh& mesh, const Ray& ray, const std::string& device) {
  const std::filesystem::path file = (output_folder() / file_name(name)).string() + ".obj";
  std::ofstream out(file);
  for (const glm::vec3& p : mesh.vertices()) out << fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  for (const glm::uvec3& f : mesh.faces()) out << fmt::format("f {} {} {}\n", f.x + 1, f.y + 1, f.z + 1);
  const std::string description = fmt::format("{{\"kind\":\"mesh\",\"file\":\"{}\"}}\n", file.filename().string());
  return replay_command(name, description, ray, device);
}

std::string replay_command(const std::string& name, const std::string& description, const Ray& ray,
                           const std::string& device) {
  const std::filesystem::path base = output_folder() / file_name(name);
  std::ofstream(base.string() + ".json") << description;
  std::ofstream(base.string() + ".csv") << fmt::format("ox,oy,oz,dx,dy,dz,tmin,tmax\n{},{},{},{},{},{},{},{}\n",
                                                       ray.origin.x, ray.origin.y, ray.origin.z, ray.direction.x,
                                                       ray.direction.y, ray.direction.z, ray.t_min, ray.t_max);
  return fmt::format("{} cast {}.json --rays {}.csv --device {} -o {}.hits.csv", SMURF_PROGRAM, base.string(),
                     base.string(), device, base.string());
}

}  // namespace smurf::test
