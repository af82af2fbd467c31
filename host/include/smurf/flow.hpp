// Flows: vector fields, and streamlines through them in batches.
//
//   auto field  = smurf::expression_flow({"-y", "x", "0.3"}, {.lower = glm::dvec3(-3), .upper = glm::dvec3(3)});
//   auto tracer = smurf::Tracer(smurf::open_device("opencl"), field);
//   auto lines  = tracer.trace({.positions = seeds}, {.time = 6});
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "smurf/device.hpp"
#include "smurf/interrogator.hpp"
#include "smurf/surface.hpp"
#include "smurf/values.hpp"
#include "smurf/volume.hpp"

namespace smurf {

class VectorFieldDefinition;  // internal: one class per kind, see host/flows/definition.hpp

// Copies share the description.
class VectorField {
 public:
  explicit VectorField(std::shared_ptr<const VectorFieldDefinition> model) : model_(std::move(model)) {}
  std::string_view kind() const;  // "expression", "grid", "rectilinear", "curvilinear" or "source"
  Bounds bounds() const;          // of the domain, in world coordinates
  const VectorFieldDefinition& model() const { return *model_; }
  const std::shared_ptr<const VectorFieldDefinition>& share() const { return model_; }

 private:
  std::shared_ptr<const VectorFieldDefinition> model_;
};

// How a continuous field is made from vectors at nodes.
//   trilinear  interpolates in a cell; C⁰, its derivatives are those within the cell, and jump at faces
//   tricubic   interpolating cubic B-spline (Unser 1999), C², with its own derivatives. Beyond the outer nodes the data
//              goes on with second derivative 0, so that affine fields are reproduced. Grids that are curved have their
//              nodes interpolated in the same way.
enum class VectorReconstruction { trilinear, tricubic };

// Vectors at the nodes of a regular grid, i fastest, in world axes: vectors[i + size.x*(j + size.y*k)] stands at
// placement.origin + placement.axes*(i, j, k).
struct VectorGrid {
  glm::ivec3 size{0};
  GridPlacement placement;
  Values<glm::vec3> vectors;
};

// Vectors at the nodes of a grid whose nodes stand anywhere, i fastest. Neighbouring nodes are the corners of cells, in
// which a place is the trilinear interpolation of the eight corners. Lists are as long as there are nodes.
struct CurvilinearBlock {
  glm::ivec3 size{0};
  Values<glm::dvec3> points;
  Values<glm::vec3> vectors;
  std::vector<std::uint8_t> blanked;  // 1 where a node is blanked, and with it the cells about it; empty: none is
};

// Each throws Error (input), one line that says what is wrong, where and what would be right: fewer than two nodes
// along an axis, lists of the wrong length, a placement that is singular, axes that do not increase. Vectors that are
// not finite make their cells undefined.
VectorField grid_flow(VectorGrid grid, VectorReconstruction reconstruction = VectorReconstruction::trilinear);
// Nodes at (axes[0][i], axes[1][j], axes[2][k]).
VectorField rectilinear_flow(const std::array<std::vector<double>, 3>& axes, Values<glm::vec3> vectors,
                             VectorReconstruction reconstruction = VectorReconstruction::trilinear);
// One block or more; where blocks overlap, a place belongs to the first of them. `tolerance`: how exactly places are
// found in cells, in units of space; 0: 1e-6 of the extent.
VectorField curvilinear_flow(std::vector<CurvilinearBlock> blocks,
                             VectorReconstruction reconstruction = VectorReconstruction::trilinear,
                             double tolerance = 0);
// Three expressions in x, y, z, in the words of implicit(). Where one is undefined the field is.
VectorField expression_flow(const std::array<std::string, 3>& vector, const Domain& domain,
                            const Parameters& parameters = {});

// A field that is known by the values of a user's own device source (smurf/black_box.hpp tells its language), which
// defines FN real3 flow_source(real x, real y, real z). Derivatives are central differences of fourth order.
struct FlowSource {
  std::string source;
  std::function<glm::dvec3(const glm::dvec3&)> value;  // the same on the host, called by threads at once; may be
                                                       // missing: the reference then answers with an error that says so
  std::string name = "source";                         // for messages and `smurf info`
};
VectorField source_flow(const FlowSource& source, const Domain& domain);

// A field's description (JSON: {"kind": "expression" | "grid" | "rectilinear" | "curvilinear" | "source", ...}), that
// of a stream surface, whose field is taken, or a file of vectors. Throws Error (input) that names the file and the
// member.
VectorField load_vector_field(const std::filesystem::path& description);
// Whether a file is meant for load_vector_field rather than for load_surface, from its ending and "kind".
bool is_vector_field(const std::filesystem::path& description);

// What the ends of a line, and samples, are due to. `inside`: the field has a value there.
enum class FlowStatus : std::uint32_t {
  inside = 0,
  time = 1,        // the time asked for has passed
  domain = 2,      // the border of the domain
  blanked = 3,     // a blanked cell
  stagnation = 4,  // slower than TraceOptions::stagnation
  steps = 5,       // as many steps as allowed
  length = 6,      // the arc length asked for
  undefined = 7    // the field has no finite value there
};
std::string_view name_of(FlowStatus status);

enum class Integrator {
  rk4,            // the classic Runge-Kutta method of fourth order with a fixed step
  dormand_prince  // Dormand and Prince's 5(4), with error control and dense output (Hairer, Nørsett, Wanner 1993, II.5)
};

// Where lines begin. Tangents are derivatives of the positions by a parameter u of the seeds, for the variation.
struct FlowSeeds {
  std::vector<glm::dvec3> positions;
  std::vector<glm::dvec3> tangents = {};         // c'(u), or none
  std::vector<glm::dvec3> second_tangents = {};  // c''(u), or none: taken to be 0
};

struct TraceOptions {
  double time = 1;    // negative: back
  bool both = false;  // from -time to time, in one line
  Integrator integrator = Integrator::dormand_prince;
  double step = 0;       // rk4: length of a step in time; 0: a 200th of the time
  double tolerance = 0;  // dormand_prince: of the error of one step, in units of space; 0: 1e-6 of the domain's extent
  double interval = 0;   // time between positions that are kept; 0: every step
  bool ends_only = false;  // keeps the first and last position of each line only
  int most_steps = 100000;
  double length = 0;      // arc length to end at; 0: any
  double stagnation = 0;  // speed to end at; 0: 1e-6 of the greatest speed of the samples, or of the seeds
  int variation = 0;  // 1: also ∂x/∂u, from FlowSeeds::tangents; 2: also ∂²x/∂u² (fields that are C² only)
  std::function<void(std::size_t done, std::size_t total)> progress = {};  // lines; on the calling thread
};

// Lines in compressed rows: those of line i are offsets[i] .. offsets[i + 1] - 1, from the seed on, so that times of
// lines traced back descend; of lines traced both ways in order of time. A seed that lies outside of the domain has one
// row, its own position; `end` says why.
struct Streamlines {
  Values<std::uint64_t> offsets;
  Values<glm::vec3> positions;
  Values<float> times;                     // from the seed
  Values<glm::vec3> first, second;         // variation: ∂x/∂u, ∂²x/∂u²; empty where not asked for
  std::vector<FlowStatus> end, beginning;  // of each line: why it ends there; of lines traced both ways, why it begins
                                           // there, else `inside`
  std::uint64_t steps = 0;                 // all that were taken

  std::size_t size() const { return end.size(); }
};

// Values of the field at points.
struct FlowSamples {
  Values<glm::vec3> value;
  Values<glm::mat3> jacobian;                // column c: ∂v/∂x_c
  Values<std::array<glm::vec3, 6>> hessian;  // ∂²v by xx, yy, zz, xy, xz, yz
  std::vector<FlowStatus> status;            // NaN where not `inside`
  std::vector<std::int32_t> cell;            // of grids: i + (nx-1)*(j + (ny-1)*k), cells of the blocks before it
                                             // added; -1 where there is none
  Values<glm::vec3> local;                   // of grids: where in the cell, 0 to 1 along each axis
};

class FlowQueries;  // internal

class Tracer {
 public:
  // Uploads the field and compiles its kernels.
  Tracer(const Device& device, const VectorField& field, const PrepareOptions& options = {});

  // Throws Error (input) when no seed is inside of the domain, or the field is zero at all of them; Error (usage) on
  // options that make no sense, and on a variation that the field is not smooth enough for.
  Streamlines trace(const FlowSeeds& seeds, const TraceOptions& options = {}) const;
  // `derivatives` 0: values alone, 1: Jacobians, 2: second derivatives too.
  FlowSamples sample(std::span<const glm::vec3> points, int derivatives = 0) const;
  std::size_t device_bytes() const;

 private:
  Device device_;
  VectorField field_;
  std::shared_ptr<FlowQueries> queries_;
};

}  // namespace smurf
