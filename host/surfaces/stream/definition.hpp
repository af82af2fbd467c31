// Stream surfaces x(u, τ) = φ_τ(c(u)), where φ is the flow of a vector field and c a seed curve.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "flows/definition.hpp"
#include "flows/seeds/seed_curve.hpp"
#include "patches/leaves.hpp"
#include "smurf/stream.hpp"
#include "surfaces/surface_definition.hpp"

namespace smurf {

class Executor;
struct StreamMesh;

class StreamSurface : public SurfaceDefinition {
 public:
  // Throws Error (input) as stream_surface() of smurf/stream.hpp does.
  StreamSurface(VectorField field, SeedLine seed, const StreamOptions& options);

  std::string_view kind() const override { return "stream"; }
  Bounds bounds() const override;  // of the mesh
  std::uint32_t properties() const override;
  std::vector<std::string_view> coordinate_names() const override { return {"", "u", "v"}; }
  std::vector<Fact> facts() const override;
  RootResolver root_resolver() const override;
  std::string_view ray_limits() const override { return ", and its origin not 5e11 times as far out as the surface"; }

  const VectorFieldDefinition& field() const { return field_.model(); }
  const std::shared_ptr<const VectorFieldDefinition>& share_field() const { return field_.share(); }
  const SeedCurve& seed() const { return *seed_.share(); }
  const SeedLine& share_seed() const { return seed_; }
  const StreamOptions& options() const { return options_; }  // with defaults put in
  double field_extent() const;                               // the longest side of the field's bounds
  bool is_smooth() const { return field().smoothness() >= 2; }

  // Of the same field and seed. What was traced is shared where times and tolerance are the same.
  std::shared_ptr<const StreamSurface> with(const StreamOptions& options) const;

  // Traced by the first who asks, on that executor, and kept; without one on the first device there is.
  const StreamMesh& mesh(Executor* executor = nullptr) const;
  // Leaves of the mesh, and open ones where streamlines end within a cell. What they exclude is the true
  // surface, within the tolerance; what they isolate are roots of its patches.
  std::vector<PatchLeaf> leaves() const;

 private:
  VectorField field_;
  SeedLine seed_;
  StreamOptions options_;
  struct Kept;
  std::shared_ptr<Kept> kept_;
};

}  // namespace smurf
