// The roots of a sampled field along rays, in double precision: what hits are judged by.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "reference/grid/field.hpp"
#include "smurf/rays.hpp"

namespace smurf::test {

// A place where a ray crosses the surface; where it is not `certain`, the exact field comes so close to the isovalue
// (or only at an end of the ray) that the crossing may be there or not.
struct Root {
  double t;
  bool certain = true;
};

// Ascending in t; per ray compressed rows.
class Truth {
 public:
  // By the reference; rays that are not valid have no roots.
  Truth(const std::shared_ptr<const GridField>& field, double isovalue, const RayBatch& rays);
  // Of roots known otherwise, for each ray.
  explicit Truth(std::span<const std::vector<double>> roots);

  std::span<const Root> roots(std::size_t ray) const {
    return {roots_.data() + offsets_[ray], std::size_t(offsets_[ray + 1] - offsets_[ray])};
  }
  std::size_t size() const { return roots_.size(); }

 private:
  std::vector<std::uint64_t> offsets_{0};
  std::vector<Root> roots_;
};

// A ray in double precision, seen by the field.
class RayLine {
 public:
  RayLine(const GridField& field, const Ray& ray);

  glm::dvec3 at(double t) const { return origin_ + t * direction_; }
  double voxels() const { return voxels_; }  // that a step of 1 in t covers
  // How far, in voxels, the rounding of t to float moves a point.
  double rounding(double t) const;
  // Within `voxels` of an end of the ray's range or of the border of the domain, or outside.
  bool at_border(double t, double voxels) const;

 private:
  glm::dvec3 origin_, direction_;              // in the world
  glm::dvec3 index_origin_, index_direction_;  // in index coordinates
  glm::dvec3 last_;
  double t_min_, t_max_, voxels_;
};

}  // namespace smurf::test
