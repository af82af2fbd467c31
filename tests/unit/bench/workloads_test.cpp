// The workloads of `smurf bench`: what they are named, and that rays and meshes are what their texts say.
#include "workloads/workloads.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <string>

namespace smurf::workloads {
namespace {

// $SMURF_BUNNY for the life of an object; null for unset.
class Bunny {
 public:
  explicit Bunny(const char* file) {
    if (const char* before = std::getenv(name)) before_ = before;
    set(file);
  }
  ~Bunny() { set(before_ ? before_->c_str() : nullptr); }
  Bunny(const Bunny&) = delete;
  Bunny& operator=(const Bunny&) = delete;

 private:
  static constexpr const char* name = "SMURF_BUNNY";
  static void set(const char* file) { file ? ::setenv(name, file, 1) : ::unsetenv(name); }
  std::optional<std::string> before_;
};

std::set<std::string> names(const Catalogue& list) {
  std::set<std::string> result;
  for (const Workload& workload : list.workloads) result.insert(workload.name);
  return result;
}

TEST(Workloads, NamesAreTheirOwn) {
  const Catalogue all = catalogue();
  EXPECT_EQ(names(all).size(), all.workloads.size());
  for (const Workload& workload : all.workloads) EXPECT_FALSE(workload.text.empty()) << workload.name;
}

TEST(Workloads, WithoutTheBunnyASphereIsMeasuredByAnotherNameAndSaid) {
  const Bunny none(nullptr);
  const Catalogue list = catalogue("w8");
  EXPECT_EQ(names(list), (std::set<std::string>{"W8-sphere-camera-first", "W8-sphere-camera-all",
                                                "W8-sphere-chords-first", "W8-sphere-chords-all"}));
  ASSERT_EQ(list.missing.size(), 4u);
  for (const Missing& entry : list.missing) {
    EXPECT_EQ(entry.name.find("sphere"), std::string::npos) << entry.name;
    EXPECT_NE(entry.reason.find("SMURF_BUNNY"), std::string::npos) << entry.reason;
  }
  const Mesh mesh = list.workloads.front().mesh();
  EXPECT_NEAR(double(mesh.face_count()), 75'408, 1'000);  // whole rings, and none of no area at the poles
  EXPECT_TRUE(mesh.topology().closed);
  EXPECT_TRUE(mesh.topology().manifold);
  EXPECT_EQ(mesh.topology().orientation, MeshOrientation::outward);
  EXPECT_EQ(mesh.topology().euler_characteristic, 2);
}

TEST(Workloads, AFileThatIsNotThereIsNamed) {
  const Bunny gone("/nowhere/bunny00.off");
  const Catalogue list = catalogue("W8-camera");
  ASSERT_EQ(list.missing.size(), 2u);
  EXPECT_NE(list.missing.front().reason.find("/nowhere/bunny00.off"), std::string::npos) << list.missing.front().reason;
}

TEST(Workloads, TheBunnyIsReadFromItsFile) {
  const std::filesystem::path file = std::filesystem::path(SMURF_TEST_OUTPUT) / "workload_bunny.off";
  std::ofstream(file) << "OFF\n4 4 0\n0 0 0\n1 0 0\n0 2 0\n0 0 4\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  const Bunny bunny(file.c_str());
  const Catalogue list = catalogue("W8");
  EXPECT_EQ(names(list),
            (std::set<std::string>{"W8-camera-first", "W8-camera-all", "W8-chords-first", "W8-chords-all"}));
  EXPECT_TRUE(list.missing.empty());
  for (const Workload& workload : list.workloads) {
    EXPECT_EQ(workload.mesh().face_count(), 4u);
    EXPECT_DOUBLE_EQ(workload.length_unit(), 4.0 / 1024);
    EXPECT_EQ(workload.sizes, (std::vector<int>{512, 1024}));
    EXPECT_EQ(workload.properties, 0u);
    EXPECT_EQ(workload.cast_options().hits == Hits::all, workload.name.ends_with("all"));
    const bool camera = workload.name.find("camera") != std::string::npos;
    EXPECT_EQ(rays_of(workload, workload.surface(), 16).image_width, camera ? 16u : 0u) << workload.name;
  }
}

// The ring that stands for the teapot: closed, every border shared, nearly the torus.
TEST(Workloads, TheRingIsClosed) {
  const std::vector<Patch> patches = bicubic_ring();
  ASSERT_EQ(patches.size(), 32u);
  const Surface surface = nurbs(patches);
  EXPECT_NEAR(surface.bounds().upper.x, 3, 1e-3);
  EXPECT_NEAR(surface.bounds().upper.z, 1, 1e-3);
  const HitList hits =
      Interrogator(open_device("reference"), surface).cast(random_chords(surface.bounds(), 16), {.hits = Hits::all});
  for (std::size_t i = 0; i < hits.ray_count(); i++)
    EXPECT_EQ((hits.offsets()[i + 1] - hits.offsets()[i]) % 2, 0u) << i;
  EXPECT_GT(hits.size(), 100u);
}

TEST(Workloads, PatchesAndExpressionsAreMeasured) {
  const Catalogue list = catalogue("W7");
  EXPECT_EQ(list.workloads.size(), 5u);
  for (const Workload& workload : list.workloads) {
    EXPECT_TRUE(workload.parametric()) << workload.name;
    EXPECT_GT(workload.length_unit(), 0) << workload.name;
    EXPECT_EQ(workload.cast_options().hits == Hits::all, workload.name.ends_with("all"));
  }
}

TEST(Workloads, ChordsRunFromSphereToSphereInAllDirections) {
  const Bounds bounds{{-1, 2, 5}, {3, 4, 9}};
  const glm::dvec3 centre(1, 3, 7);
  const RayBatch rays = random_chords(bounds, 64);
  ASSERT_EQ(rays.size(), 64u * 64u);
  glm::dvec3 origins(0), directions(0);
  for (std::size_t i = 0; i < rays.size(); i++) {
    const glm::dvec3 from(rays[i].origin), along(rays[i].direction);
    EXPECT_NEAR(glm::length(from - centre), 3, 1e-5) << i;  // half the diagonal: |(2, 1, 2)|
    EXPECT_NEAR(glm::length(from + along - centre), 3, 1e-5) << i;
    origins += (from - centre) / (3.0 * double(rays.size()));
    directions += along / (3.0 * double(rays.size()));
  }
  // Means of 4,096 unit vectors have a spread of 1/64/sqrt(3) = 0.009 an axis, their differences 0.013.
  EXPECT_LT(glm::length(origins), 0.06);
  EXPECT_LT(glm::length(directions), 0.08);
  EXPECT_EQ(random_chords(bounds, 64)[4095].direction, rays[4095].direction);
}

}  // namespace
}  // namespace smurf::workloads
