// From polygons to meshes: checks, welds, splits polygons and drops what has no area.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "smurf/mesh.hpp"

namespace smurf {

// Faces as files have them.
struct Polygons {
  std::vector<glm::vec3> vertices;
  std::vector<std::uint32_t> corners;  // of all faces, one after the other
  std::vector<std::uint32_t> sizes;    // corners of each face; empty when all are triangles
  std::uint64_t ignored_elements = 0;
};

class MeshBuilder {
 public:
  // `origin` begins the messages of errors: "mesh", or a file's name.
  static Mesh build(Polygons polygons, const MeshOptions& options, const std::string& origin);

 private:
  MeshBuilder(Polygons& polygons, const std::string& origin) : polygons_(polygons), origin_(origin) {}
  [[noreturn]] void fail(const std::string& message) const;
  void check() const;
  void weld();
  void add_face(std::uint32_t face, const std::uint32_t* corners, std::size_t size);
  void add_triangle(std::uint32_t face, const glm::uvec3& triangle);
  [[noreturn]] void fail_empty(std::uint64_t face_count) const;

  Polygons& polygons_;
  const std::string& origin_;
  std::vector<glm::uvec3> faces_;
  std::vector<std::uint32_t> source_faces_;
  MeshRepairs repairs_;
};

// Splits a polygon into triangles of its corners' numbers 0 .. n-1: ears are cut off in the plane of the polygon's area
// vector; a polygon that crosses itself, where no ear is left, ends in a fan.
void split_polygon(const std::vector<glm::dvec3>& corners, std::vector<glm::uvec3>& triangles);

constexpr std::uint32_t most_corners = 16384;  // cutting ears takes quadratic time

// Whether the corners lie exactly on one line, or on one point.
bool has_no_area(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c);

}  // namespace smurf
