// Compares what host and kernels share (kernels/layout) with the public enums and structures: a difference does not
// compile.
#include <cstddef>

#include "api/rows.hpp"
#include "kernels/layout/codes.inc"
#include "kernels/layout/records.inc"
#include "smurf/interrogator.hpp"
#include "smurf/rays.hpp"

namespace smurf {
namespace {

constexpr std::size_t word = 4;

static_assert(int(HitStatus::isolated) == STATUS_ISOLATED && int(HitStatus::tangent) == STATUS_TANGENT &&
              int(HitStatus::unresolved) == STATUS_UNRESOLVED && int(HitStatus::bracketed) == STATUS_BRACKETED &&
              int(HitStatus::sampled) == STATUS_SAMPLED);
static_assert(int(RayStatus::ok) == RAY_STATUS_OK && int(RayStatus::invalid) == RAY_STATUS_INVALID);
static_assert(int(WalkStatus::start) == WALK_START && int(WalkStatus::reached) == WALK_REACHED &&
              int(WalkStatus::crease) == WALK_CREASE && int(WalkStatus::boundary) == WALK_BOUNDARY &&
              int(WalkStatus::unreachable) == WALK_UNREACHABLE && int(WalkStatus::undefined) == WALK_UNDEFINED &&
              int(WalkStatus::unresolved) == WALK_UNRESOLVED && int(WalkStatus::off_surface) == WALK_OFF_SURFACE &&
              int(WalkStatus::no_direction) == WALK_NO_DIRECTION && int(WalkStatus::invalid) == WALK_INVALID);
static_assert(umbilic == POINT_UMBILIC && boundary == POINT_BOUNDARY && undefined == POINT_UNDEFINED &&
              crease == POINT_CREASE && singular == POINT_SINGULAR);
static_assert(int(Property::value) == PROPERTY_VALUE && int(Property::normal) == PROPERTY_NORMAL &&
              int(Property::gauss) == PROPERTY_GAUSS && int(Property::mean) == PROPERTY_MEAN &&
              int(Property::principal) == PROPERTY_PRINCIPAL && int(Property::directions) == PROPERTY_DIRECTIONS &&
              int(Property::normal_curvature) == PROPERTY_NORMAL_CURVATURE &&
              int(Property::location) == PROPERTY_LOCATION);

static_assert(int(RayBatch::origin_x) == RAY_ORIGIN && int(RayBatch::direction_x) == RAY_DIRECTION &&
              int(RayBatch::t_min) == RAY_T_MIN && int(RayBatch::t_max) == RAY_T_MAX &&
              RayBatch::component_count == RAY_COMPONENTS);

static_assert(sizeof(BlockSum) == BLOCK_WORDS * word && offsetof(BlockSum, hits) == BLOCK_HITS * word &&
              offsetof(BlockSum, most) == BLOCK_MOST * word && offsetof(BlockSum, invalid) == BLOCK_INVALID * word &&
              offsetof(BlockSum, cut) == BLOCK_CUT * word && offsetof(BlockSum, open) == BLOCK_OPEN * word);

static_assert(sizeof(SurfaceCoordinates) == COORDINATES_WORDS * word &&
              offsetof(SurfaceCoordinates, part) == COORDINATES_PART * word &&
              offsetof(SurfaceCoordinates, u) == COORDINATES_U * word &&
              offsetof(SurfaceCoordinates, v) == COORDINATES_V * word);

}  // namespace
}  // namespace smurf
