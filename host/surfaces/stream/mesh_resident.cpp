// The mesh of a stream surface on a device: its cells are pieces, as those of patches are.
#include <fmt/format.h>

#include <algorithm>

#include "kernels/patch/layout.inc"
#include "kernels/stream/mesh_layout.inc"
#include "surfaces/patch_form.hpp"
#include "surfaces/stream/mesh.hpp"
#include "surfaces/stream/resident.hpp"

namespace smurf {
namespace {

static_assert(TREE_NOTHING == StreamMesh::no_cell);

class ResidentStreamMesh final : public ResidentSurface {
 public:
  ResidentStreamMesh(const StreamSurface& surface, Executor& executor)
      : mesh_(surface.mesh(&executor)), form_(mesh_.bounds) {
    std::vector<ParameterBox> borders;
    for (const StreamBorder& border : mesh_.borders) borders.push_back({border.lower, border.upper});
    const std::vector<PatchLeaf> leaves = surface.leaves();
    form_.add_pieces(*mesh_.pieces, mesh_.topology, leaves, borders);
    const std::size_t tree = put_tree();
    put_cells();
    form_.upload(
        executor, leaves, mesh_.bounds,
        [&](const PatchLeaf& leaf) {
          return leaf.piece < mesh_.cells.size() && mesh_.cells[leaf.piece].proved ? HitStatus::isolated
                                                                                   : HitStatus::sampled;
        },
        tree, 1);
    modules_["surface"] = kernel_source("patch/surface.inc");
    modules_["position"] = kernel_source("stream/cells.inc");
    modules_["frame"] = kernel_source("patch/frame.inc");
    defines_ = form_.defines();
    defines_["BEZIER_U"] = defines_["BEZIER_V"] = "3";
    defines_["BEZIER_RATIONAL"] = "0";
    const bool flat = surface.options().derivatives == StreamDerivatives::mesh;
    defines_["STREAM_CURVED"] = mesh_.is_smooth && !flat ? "1" : "0";
    defines_["STREAM_FLAT"] = flat ? "1" : "0";
  }

  const std::map<std::string, std::string>& modules() const override { return modules_; }
  const std::map<std::string, std::string>& defines() const override { return defines_; }
  BufferGroup buffers() const override { return form_.buffers(); }
  std::size_t bytes() const override { return form_.bytes(); }
  int room_words() const override { return PATCH_ROOM_WORDS; }
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
      Words words(form_.points);
      std::size_t at = words.add(CELL_BEYOND_WORDS);
      const glm::dvec2 size = cell.upper - cell.lower;
      for (const glm::dvec3& uu : cell.beyond_uu) words.put(at, uu * size.x * size.x * form_.frame().unit), at += 3;
      for (const glm::dvec3& vv : cell.beyond_vv) words.put(at, vv * size.y * size.y * form_.frame().unit), at += 3;
    }
  }

  const StreamMesh& mesh_;
  PatchForm form_;
  std::map<std::string, std::string> modules_, defines_;
};

}  // namespace

std::unique_ptr<ResidentSurface> reside_stream_mesh(const StreamSurface& surface, Executor& executor,
                                                    const PrepareOptions&) {
  return std::make_unique<ResidentStreamMesh>(surface, executor);
}

}  // namespace smurf
