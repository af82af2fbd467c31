// The roots of a sampled field along rays, in double precision, and how hits of grids are held against them.
//
// A hit is right when it is close to its root in voxels along the ray, or (where the ray grazes the surface and no
// float can say t so well) when the exact field at the hit differs from the isovalue by rounding alone. Roots within
// rounding of an end of the ray's range or of the border of the domain may be found or not.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "harness/oracle.hpp"
#include "reference/grid/field.hpp"
#include "smurf/rays.hpp"

namespace smurf::test {

// Ascending in t; per ray compressed rows.
class GridRoots {
 public:
  // By the reference; rays that are not valid have no roots.
  GridRoots(const std::shared_ptr<const GridField>& field, double isovalue, const RayBatch& rays);
  // Of roots known otherwise, for each ray.
  explicit GridRoots(std::span<const std::vector<double>> roots);

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

struct GridTolerances {
  double t;                // voxels
  double value;            // of the field
  double border = 1e-4;    // voxels: roots this close to an end of the range may be found or not
  double same = 1.0 / 16;  // voxels: a hit farther from a root is another one's
};

// The roots of a batch's rays as an oracle; differences of t are told in voxels.
class GridOracle : public Oracle {
 public:
  GridOracle(std::shared_ptr<const GridField> field, double isovalue, GridRoots roots, const GridTolerances& allowed);

  std::unique_ptr<const RayOracle> on(std::size_t index, const Ray& ray) const override;
  const char* unit() const override { return "voxel"; }

 private:
  std::shared_ptr<const GridField> field_;
  double isovalue_;
  GridRoots roots_;
  GridTolerances allowed_;
};

}  // namespace smurf::test
