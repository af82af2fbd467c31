// The mesh of a stream surface: cells are within the tolerance of the surface everywhere, and fit together without
// cracks where larger ones border on smaller ones. The oracle is integration from the seed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include "harness/density.hpp"
#include "harness/devices.hpp"
#include "harness/files/test_files.hpp"
#include "harness/kernel_cover.hpp"
#include "harness/stream_case.hpp"
#include "smurf/stream.hpp"
#include "surfaces/stream/definition.hpp"
#include "surfaces/stream/mesh.hpp"

KERNELS(find_hits, finish_hits, polish_hits, measure, trace_lines, sample_flow);

namespace smurf::test {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double pi = std::numbers::pi;

struct Scene {
  std::string name;
  VectorField field;
  SeedLine seed;
  StreamOptions options;
  Surface with(StreamDerivatives derivatives) const {
    StreamOptions other = options;
    other.derivatives = derivatives;
    return stream_surface(field, seed, other);
  }
};

VectorField abc_flow() {
  return expression_flow({"sqrt(3)*sin(z)+cos(y)", "sqrt(2)*sin(x)+sqrt(3)*cos(z)", "sin(y)+sqrt(2)*cos(x)"},
                         {dvec3(-20), dvec3(20)});
}

Scene abc_scene(double time) {
  return {
      "ABC flow", abc_flow(), seed_expression({"pi+u", "pi", "pi"}, {-2, 2}), {.time = {0, time}, .tolerance = 6e-5}};
}

// The field of a description with files of the library's own data.
VectorField described(const std::string& text) { return load_vector_field(put("field.json", text)); }

std::vector<Scene> scenes() {
  const std::string data = SMURF_SOURCE_DIR "/host/data/";
  return {abc_scene(3),
          {"before and after the seed",
           expression_flow({"-y", "x", "0.3*cos(x)"}, {dvec3(-3), dvec3(3)}),
           seed_points({{0.3, 0, 0}, {1, 0, 0}, {1.3, 0, 0.7}}),
           {.time = {-1.5, 2}}},
          {"carotid artery",
           described(R"({"kind": "grid", "file": ")" + data +
                     R"(carotid.vtk", "array": "vectors", "reconstruction": "tricubic"})"),
           seed_expression({"147.5 + 1.3*cos(u)", "102.5 + 1.3*sin(u)", "9"}, {0, 2 * pi}),
           {.time = {-1, 2}}},
          {"combustor",
           described(R"({"kind": "curvilinear", "file": ")" + data + R"(flows/combxyz.bin", "solution": ")" + data +
                     R"(flows/combq.bin", "reconstruction": "tricubic"})"),
           seed_points({{9, -1, 27}, {9, 1, 31}}),
           {.time = {0, 0.004}}}};
}

TEST(StreamCells, AreWithinTheToleranceOfTheSurface) {
  const std::size_t count = std::size_t(10000 / sanitized_part * density());
  const std::vector<Scene> all = scenes();
  // Under sanitizers those of expressions alone.
  for (const Scene& scene : std::span(all).first(sanitized_part > 1 ? 2 : all.size())) {
    for (const TestDevice& on : one_of_each()) {
      // Programs of curvilinear fields take a minute there, and are tested by tests/cases/flow.
      if (on.device.is_reference() || (on.slow && scene.name == "combustor")) continue;
      SCOPED_TRACE(scene.name + " on " + on.label);
      std::mt19937 random(7);
      const dvec2 u = scene.seed.share()->range();
      std::uniform_real_distribution<double> in_u(u.x, u.y), in_time(scene.options.time.x, scene.options.time.y);
      std::vector<SurfaceCoordinates> places(on.slow ? count / 50 : count);
      for (SurfaceCoordinates& place : places) place = {0, float(in_u(random)), float(in_time(random))};
      const Surface meshed = scene.with(StreamDerivatives::interpolated);
      const auto tolerance = dynamic_cast<const StreamSurface&>(meshed.model()).options().tolerance;
      const PointProperties cells =
          Interrogator(on.device, meshed).properties_at(places, Property::location | Property::normal);
      const PointProperties exact = Interrogator(on.device, scene.with(StreamDerivatives::integrated))
                                        .properties_at(places, Property::location | Property::normal);
      double greatest = 0, least_cosine = 1;
      std::size_t compared = 0, missing = 0;
      for (std::size_t i = 0; i < places.size(); i++) {
        const double off = glm::distance(dvec3(cells.location[i]), dvec3(exact.location[i]));
        const bool there = std::isfinite(exact.location[i].x);
        missing += there && std::isnan(cells.location[i].x) ? 1 : 0;
        if (std::isnan(off)) continue;
        compared++;
        greatest = std::max(greatest, off);
        least_cosine = std::min(least_cosine, glm::dot(dvec3(cells.normal[i]), dvec3(exact.normal[i])));
      }
      std::cout << scene.name << " on " << on.label << ": greatest deviation " << greatest << " of " << tolerance
                << " at " << compared << " places, normals within " << std::acos(std::min(least_cosine, 1.0)) << "\n";
      EXPECT_GE(compared, places.size() / 2);
      // Where streamlines end cells do: what is missing is less than a cell.
      EXPECT_LE(missing, scene.name == "combustor" ? places.size() / 50 : 0u);
      EXPECT_LE(greatest, tolerance);
    }
  }
}

// Much more time than lines need: until they leave the field, or come to rest at x = 1. Both surfaces are z = 0.8 x y²,
// and τ is x, or -log(1 - x).
TEST(StreamCells, FollowLinesThatEndLongBeforeTheTimeDoes) {
  const Domain domain{dvec3(-1.3, -1.3, -2.2), dvec3(1.3, 1.3, 2.2)};
  for (const bool rests : {false, true}) {
    const VectorField field =
        rests ? expression_flow({"1-x", "0", "0.8*y^2*(1-x)"}, domain) : expression_flow({"1", "0", "0.8*y^2"}, domain);
    const Surface surface = stream_surface(field, seed_expression({"0", "u", "0"}, {-1, 1}), {.time = {-0.5, 1e5}});
    const double greatest_x = rests ? 0.999 : 1.27;  // next to the exit hits are `unresolved`
    for (const TestDevice& on : one_of_each()) {
      if (on.device.is_reference()) continue;  // it samples times evenly
      SCOPED_TRACE(std::string(rests ? "rests" : "leaves") + " on " + on.label);
      std::mt19937 random(11);
      std::uniform_real_distribution<float> in_x(-0.3f, float(greatest_x)), in_y(-0.99f, 0.99f);
      RayBatch rays(on.slow ? 200 : 5000);
      for (std::size_t i = 0; i < rays.size(); i++) rays.set(i, {{in_x(random), in_y(random), -3}, {0, 0, 1}});
      const HitList hits = Interrogator(on.device, surface).cast(rays, {.hits = Hits::all});
      ASSERT_EQ(hits.size(), rays.size());
      double off = 0, off_time = 0;
      for (std::size_t i = 0; i < hits.size(); i++) {
        ASSERT_EQ(hits.rays()[i], i);
        const dvec3 p = hits.locations()[i];
        off = std::max(off, std::abs(p.z - 0.8 * p.x * p.y * p.y));
        const double time = rests ? -std::log1p(-p.x) : p.x;
        // Where x comes to rest τ is as ill determined as e^τ.
        off_time = std::max(off_time, std::abs(double(hits.coordinates()[i].v) - time) * (rests ? 1 - p.x : 1));
      }
      std::cout << on.label << ": off by " << off << ", times by " << off_time << "\n";
      EXPECT_LE(off, 4.4e-5);  // 1e-5 of the extent, the usual tolerance
      EXPECT_LE(off_time, 4.4e-5);
    }
  }
}

// A place, and how near in (u, τ) another hit counts as one of the same place.
struct Aim {
  SurfaceCoordinates place;
  dvec2 near;
};

// All corners of cells that have smaller neighbours, and places between them along the sides.
std::vector<Aim> aims_at_borders(const Surface& surface) {
  const StreamPolygons polygons = stream_polygons(surface);
  const auto& model = dynamic_cast<const StreamSurface&>(surface.model());
  const dvec2 lower{model.seed().range().x, model.options().time.x},
      upper{model.seed().range().y, model.options().time.y};
  std::vector<Aim> aims;
  for (std::size_t p = 0; p + 1 < polygons.offsets.size(); p++) {
    const std::size_t first = polygons.offsets[p], count = polygons.offsets[p + 1] - first;
    if (count == 4) continue;
    dvec2 low(INFINITY), high(-INFINITY);
    for (std::size_t i = 0; i < count; i++) {
      low = glm::min(low, polygons.places[polygons.corners[first + i]]);
      high = glm::max(high, polygons.places[polygons.corners[first + i]]);
    }
    for (std::size_t i = 0; i < count; i++) {
      const dvec2 a = polygons.places[polygons.corners[first + i]],
                  b = polygons.places[polygons.corners[first + (i + 1) % count]];
      for (const double part : {0.0, 0.37}) {
        const dvec2 at = a + part * (b - a);
        if (at.x == lower.x || at.x == upper.x || at.y == lower.y || at.y == upper.y) continue;
        aims.push_back({{0, float(at.x), float(at.y)}, 0.05 * (high - low)});
      }
    }
  }
  return aims;
}

TEST(StreamCells, FitWithoutCracksWhereTheirSizesDiffer) {
  const Scene scene = abc_scene(3);
  const Surface surface = scene.with(StreamDerivatives::interpolated);
  for (const TestDevice& on : one_of_each()) {
    if (on.device.is_reference()) continue;
    SCOPED_TRACE(on.label);
    const Interrogator query(on.device, surface);
    std::vector<Aim> aims = aims_at_borders(surface);
    ASSERT_GT(aims.size(), 1000u);
    if (on.slow || sanitized_part > 1) aims.resize(1000);
    std::vector<SurfaceCoordinates> places;
    for (const Aim& aim : aims) places.push_back(aim.place);
    const PointProperties at = query.properties_at(places, Property::location | Property::normal);
    // From a little beside the surface, across it.
    std::mt19937 random(3);
    std::normal_distribution<float> gauss(0, 0.5f);
    RayBatch rays(aims.size());
    for (std::size_t i = 0; i < aims.size(); i++) {
      const glm::vec3 n = at.normal[i];
      glm::vec3 d = glm::vec3(gauss(random), gauss(random), gauss(random));
      d = n + 0.5f * (d - glm::dot(d, n) * n);
      rays.set(i, {at.location[i] - 0.02f * d, d, 0, 0.04f});
    }
    const HitList hits = query.cast(rays, {.hits = Hits::all});
    std::size_t wrong = 0, flagged = 0;
    for (std::size_t i = 0; i < aims.size(); i++) {
      std::size_t found = 0;
      bool doubtful = false;
      for (std::size_t h = hits.offsets()[i]; h < hits.offsets()[i + 1]; h++) {
        const SurfaceCoordinates c = hits.coordinates()[h];
        const bool same = std::abs(double(c.u) - double(aims[i].place.u)) <= aims[i].near.x &&
                          std::abs(double(c.v) - double(aims[i].place.v)) <= aims[i].near.y;
        found += same ? 1 : 0;
        const HitStatus status = hits.status()[h];
        doubtful = doubtful || status == HitStatus::tangent || status == HitStatus::unresolved;
      }
      flagged += doubtful ? 1 : 0;
      if (found != 1 && !doubtful && wrong++ < 5)
        ADD_FAILURE() << found << " hits at u = " << aims[i].place.u << ", t = " << aims[i].place.v;
    }
    std::cout << on.label << ": " << aims.size() << " rays at borders of cells of different size, " << flagged
              << " flagged\n";
    EXPECT_EQ(wrong, 0u);
    EXPECT_LE(flagged, aims.size() / 200);
  }
}

TEST(StreamCells, HitsArePolishedToTheSurfaceItself) {
  Scene scene = abc_scene(2);
  scene.options.tolerance = 1e-3;
  for (const TestDevice& on : one_of_each()) {
    if (on.device.is_reference()) continue;
    SCOPED_TRACE(on.label);
    double greatest[2] = {0, 0};
    std::size_t found[2] = {0, 0};
    for (const bool polish : {false, true}) {
      scene.options.polish = polish;
      const Surface surface = scene.with(StreamDerivatives::integrated);
      const Interrogator query(on.device, surface);
      const HitList hits = query.cast(chords_of(surface.bounds(), on.slow ? 500 : 20000), {.hits = Hits::all});
      const PointProperties exact = query.properties_at(hits.coordinates(), Property::location | Property::normal);
      for (std::size_t h = 0; h < hits.size(); h++) {
        if (hits.status()[h] != HitStatus::isolated && hits.status()[h] != HitStatus::sampled) continue;
        // Off the tangent plane: along the surface (u, v) are as exact as floats of them.
        const double off =
            std::abs(glm::dot(dvec3(exact.location[h]) - dvec3(hits.locations()[h]), dvec3(exact.normal[h])));
        if (std::isnan(off)) continue;
        found[polish]++;
        greatest[polish] = std::max(greatest[polish], off);
      }
    }
    std::cout << on.label << ": " << found[1] << " hits, off by " << greatest[0] << ", polished " << greatest[1]
              << "\n";
    EXPECT_GT(found[1], on.slow ? 100u : 5000u);
    EXPECT_NEAR(double(found[0]), double(found[1]), 0.01 * double(found[0]));
    EXPECT_LE(greatest[0], 1e-3);
    // t is a float of about two diagonals.
    EXPECT_LE(greatest[1], 2e-5);
    EXPECT_LT(greatest[1], 0.1 * greatest[0]);
  }
}

TEST(StreamCells, OfAStretchingFlowAreProvedForModerateTimes) {
  for (const auto& [time, least] : {std::pair(1.5, 1.0), std::pair(3.0, 0.85)}) {
    const Surface surface = abc_scene(time).with(StreamDerivatives::interpolated);
    const StreamMesh& mesh = dynamic_cast<const StreamSurface&>(surface.model()).mesh();
    std::cout << "T = " << time << ": " << mesh.proved << " of " << mesh.cells.size() << " cells are proved\n";
    EXPECT_GE(double(mesh.proved), least * double(mesh.cells.size()));
  }
}

}  // namespace
}  // namespace smurf::test
