// Stream surfaces as polygons for other programs, with u and τ, normals and curvature at the corners.
//
//   auto mesh = smurf::measured_polygons(smurf::open_device("opencl"), surface);
//   smurf::save_polygons(mesh, "surface.vtp");
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "smurf/device.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/stream.hpp"

namespace smurf {

struct MeasuredPolygons {
  StreamPolygons polygons;
  // One to each place: location, normal, gauss, mean, k1 and k2. Curvature is NaN where it is undefined.
  PointProperties points;
  std::size_t left_out = 0;  // polygons with a corner that no streamline reaches
};

// The polygons of stream_polygons() with what the surface's own derivatives (StreamOptions::derivatives) tell at their
// corners. `progress` counts corners. Throws Error (usage) on surfaces of another kind.
MeasuredPolygons measured_polygons(const Device& device, const Surface& surface,
                                   std::function<void(std::size_t done, std::size_t total)> progress = {});

// By the ending of the name:
//   .vtp  VTK XML: points with u, tau, normal (of length 1), gauss, mean, k1 and k2
//   .ply  binary, little endian: vertices with x y z nx ny nz u v gauss mean k1 k2, where v is τ
// Faces are polygons, counter-clockwise from where normals point to. Written whole or not at all: throws Error (io)
// when that fails, Error (usage) on another ending.
void save_polygons(const MeasuredPolygons& mesh, const std::filesystem::path& file);

}  // namespace smurf
