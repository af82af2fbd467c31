// The mesh of a stream surface on a device: its cells are pieces, as those of patches are.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "kernels/patch/layout.inc"
#include "kernels/stream/mesh_layout.inc"
#include "surfaces/patch_form.hpp"
#include "surfaces/stream/flow_map.hpp"
#include "surfaces/stream/mesh.hpp"
#include "surfaces/stream/resident.hpp"
#include "surfaces/stream/tubes.hpp"

namespace smurf {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double greatest_error = 5e-4;  // of interpolated curvature, relative
static_assert(TREE_NOTHING == StreamMesh::no_cell);

class ResidentStreamMesh final : public ResidentSurface {
 public:
  ResidentStreamMesh(const StreamSurface& surface, Executor& executor, const PrepareOptions& options)
      : mesh_(surface.mesh(&executor)), form_(mesh_.bounds), polishes_(surface.options().polish) {
    std::vector<ParameterBox> borders;
    for (const StreamBorder& border : mesh_.borders) borders.push_back({border.lower, border.upper});
    const std::vector<PatchLeaf> leaves = surface.leaves();
    form_.add_pieces(*mesh_.pieces, mesh_.topology, leaves, borders);
    const std::size_t tree = put_tree();
    put_cells();
    put_borders();
    form_.off = std::max(surface.options().tolerance, mesh_.deviation);
    form_.upload(
        executor, leaves, mesh_.bounds,
        [&](const PatchLeaf& leaf) {
          return leaf.piece < mesh_.cells.size() ? more_remainder(mesh_.cells[leaf.piece], leaf) : infinity;
        },
        tree, 1);
    modules_["surface"] = kernel_source("patch/surface.inc");
    modules_["position"] = kernel_source("stream/cells.inc");
    defines_ = form_.defines();
    defines_["BEZIER_U"] = defines_["BEZIER_V"] = "3";
    defines_["BEZIER_RATIONAL"] = "0";
    const bool flat = surface.options().derivatives == StreamDerivatives::mesh;
    defines_["STREAM_CURVED"] = mesh_.is_smooth && !flat ? "1" : "0";
    defines_["STREAM_FLAT"] = flat ? "1" : "0";
    const StreamDerivatives derivatives = surface.options().derivatives;
    const bool integrates =
        derivatives == StreamDerivatives::integrated || derivatives == StreamDerivatives::neighbours;
    const bool rough = derivatives == StreamDerivatives::interpolated && mesh_.curvature_error > greatest_error;
    if (integrates || rough || polishes_) map_.emplace(surface, executor, options);
    if (map_) map_->add_to(modules_, defines_);
    if (polishes_) modules_["polish"] = kernel_source("stream/polish.inc");
    modules_["map"] = kernel_source(map_ ? "stream/mesh_map.inc" : "patch/no_map.inc");
    modules_["walk"] = kernel_source("patch/walk.inc");
    defines_["WALK_PART"] = "0.5f";
    defines_["WALK_NOTHING"] = "WALK_BOUNDARY";
    modules_["frame"] =
        kernel_source(integrates ? "stream/frame.inc" : (rough ? "stream/mesh_frame.inc" : "patch/frame.inc"));
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override {
    BufferGroup buffers = form_.buffers();
    if (map_) map_->add_to(buffers);
    return buffers;
  }
  std::size_t bytes() const override { return form_.bytes() + (map_ ? map_->bytes() : 0); }
  int room_words() const override { return PATCH_ROOM_WORDS; }
  bool polishes() const override { return polishes_; }
  bool update(const SurfaceDefinition&) override { return false; }

 private:
  // Returns where it begins.
  std::size_t put_tree() {
    Words words(form_.pieces);
    const std::size_t at = words.add(TREE_NODES + mesh_.tree.size());
    words.put(at + TREE_COLUMNS, std::int32_t(mesh_.base.x));
    words.put(at + TREE_ROWS, std::int32_t(mesh_.base.y));
    words.put(at + TREE_ROWS_BEFORE, mesh_.base_before);
    words.put(at + TREE_LOW_U, float(mesh_.lower.x));
    words.put(at + TREE_HIGH_U, float(mesh_.upper.x));
    words.put(at + TREE_LOW_V, float(mesh_.lower.y));
    words.put(at + TREE_ZERO_V, float(mesh_.zero));
    words.put(at + TREE_HIGH_V, float(mesh_.upper.y));
    for (std::size_t i = 0; i < mesh_.tree.size(); i++) words.put(at + TREE_NODES + i, mesh_.tree[i]);
    return at;
  }

  void put_cells() {
    for (std::size_t i = 0; i < mesh_.cells.size(); i++) {
      const StreamCell& cell = mesh_.cells[i];
      form_.put_bezier(i, mesh_.pieces->pieces()[i], mesh_.lower, false);
      Words records(form_.pieces), words(form_.points);
      records.put(PIECE_WORDS * i + PIECE_ROUGH, std::int32_t(cell.curvature_error > greatest_error ? 1 : 0));
      std::size_t at = words.add(CELL_BEYOND_WORDS);
      const glm::dvec2 size = cell.upper - cell.lower;
      for (const glm::dvec3& uu : cell.beyond_uu) words.put(at, uu * size.x * size.x * form_.frame().unit), at += 3;
      for (const glm::dvec3& vv : cell.beyond_vv) words.put(at, vv * size.y * size.y * form_.frame().unit), at += 3;
    }
  }

  // Where nothing is known but a box, positions are NaN.
  void put_borders() {
    if (mesh_.borders.empty()) return;
    Words records(form_.pieces), words(form_.points);
    const std::size_t at = words.add(CELL_BEYOND + CELL_BEYOND_WORDS);
    for (std::size_t i = 0; i < CELL_BEYOND + CELL_BEYOND_WORDS; i++)
      words.put(at + i, std::numeric_limits<float>::quiet_NaN());
    for (std::size_t i = 0; i < mesh_.borders.size(); i++)
      records.put(PIECE_WORDS * (mesh_.cells.size() + i) + PIECE_POINTS, std::int32_t(at));
  }

  const StreamMesh& mesh_;
  PatchForm form_;
  const bool polishes_;
  std::optional<StreamMap> map_;  // where properties are integrated
  std::map<std::string, std::string> modules_, defines_;
};

}  // namespace

std::unique_ptr<ResidentSurface> reside_stream_mesh(const StreamSurface& surface, Executor& executor,
                                                    const PrepareOptions& options) {
  return std::make_unique<ResidentStreamMesh>(surface, executor, options);
}

}  // namespace smurf
