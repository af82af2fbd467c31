#include "truth/trimesh.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <nlohmann/json.hpp>

#include "harness/files/shared_data.hpp"

namespace smurf::test {

std::vector<TrimeshCase> trimesh_cases() {
  if (!has_shared_data("expected")) return {};
  const std::filesystem::path folder = shared_data("expected");
  std::string text;
  const gzFile stream = gzopen((folder / "trimesh_ray_data.json.gz").c_str(), "rb");
  if (stream == nullptr) {
    ADD_FAILURE() << "trimesh_ray_data.json.gz cannot be read";
    return {};
  }
  char buffer[65536];
  for (int count = 0; (count = gzread(stream, buffer, sizeof buffer)) > 0;) text.append(buffer, std::size_t(count));
  gzclose(stream);
  const auto all = nlohmann::json::parse(text)["rays"];

  std::vector<TrimeshCase> cases = {{"ballA.off", {}, {}, {}, {}, 344, 688, 4524.714385036},
                                    {"featuretype.STL", {}, {}, {}, {}, 360, 1348, 1026.054797525},
                                    {"angle_block.STL", {}, {}, {}, {}, 360, 1392, 395.914912758},
                                    {"cylinder.stl", {}, {}, {}, {}, 343, 686, 1340.739175801}};
  for (TrimeshCase& known : cases) {
    known.file = folder / "trimesh_models" / known.name;
    const auto vector = [](const nlohmann::json& v) { return glm::dvec3(v.at(0), v.at(1), v.at(2)); };
    for (const auto& v : all.at(known.name).at("ray_origins")) known.origins.push_back(vector(v));
    for (const auto& v : all.at(known.name).at("ray_directions")) known.directions.push_back(vector(v));
    EXPECT_EQ(known.origins.size(), 1200u);
    EXPECT_EQ(known.directions.size(), known.origins.size());
    for (std::size_t i = 0; i < known.origins.size(); i++) {
      Ray ray;
      ray.origin = glm::vec3(known.origins[i]);
      ray.direction = glm::vec3(known.directions[i]);
      known.rays.push_back(ray);
    }
  }
  return cases;
}

}  // namespace smurf::test
