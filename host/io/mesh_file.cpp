// Mesh files by the ends of their names.
//
// OFF, OBJ, PLY and STL are read here, all others by assimp. Assimp 5.2 reads these four, too, but it takes the
// vertices of OBJ files apart corner by corner, drops polygons of more than nine corners and clamps indices in OFF
// files, repeats faces where a PLY file is truncated, crashes or does not come to an end on damaged PLY files, and does
// not round numbers to the nearest float.
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <map>

#include "io/mesh_file.hpp"
#include "numerics/text_file.hpp"
#include "smurf/error.hpp"
#include "smurf/mesh.hpp"

namespace smurf {
namespace {

using std::filesystem::path;

[[noreturn]] void fail(const path& file, const std::string& message) {
  throw Error(ErrorCode::input, fmt::format("\"{}\": {}", file.string(), message));
}

std::string lower_case(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

std::string one_line(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c < ' ' && c >= 0; }, ' ');
  return text;
}

// The meshes of a node and of those below it, placed in the world; a mesh may stand in several places.
void add_node(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, Polygons& polygons) {
  const aiMatrix4x4 placement = parent * node.mTransformation;
  const bool mirrored = placement.Determinant() < 0;
  for (unsigned i = 0; i < node.mNumMeshes; i++) {
    const aiMesh& mesh = *scene.mMeshes[node.mMeshes[i]];
    const auto first = std::uint32_t(polygons.vertices.size());
    for (unsigned v = 0; v < mesh.mNumVertices; v++) {
      const aiVector3D p = placement * mesh.mVertices[v];
      polygons.vertices.emplace_back(p.x, p.y, p.z);
    }
    for (unsigned f = 0; f < mesh.mNumFaces; f++) {
      const aiFace& face = mesh.mFaces[f];
      polygons.sizes.push_back(face.mNumIndices);
      const auto begin = polygons.corners.size();
      for (unsigned k = 0; k < face.mNumIndices; k++) polygons.corners.push_back(first + face.mIndices[k]);
      if (mirrored) std::reverse(polygons.corners.begin() + std::ptrdiff_t(begin), polygons.corners.end());
    }
  }
  for (unsigned i = 0; i < node.mNumChildren; i++) add_node(scene, *node.mChildren[i], placement, polygons);
}

}  // namespace

Polygons read_by_assimp(const path& file) {
  Assimp::Importer importer;
  if (!importer.IsExtensionSupported(file.extension().string()))
    fail(file, fmt::format("\"{}\" is no mesh format that is known: .off, .obj, .ply, .stl, or one that assimp reads",
                           file.extension().string()));
  const aiScene* scene = nullptr;
  try {
    scene = importer.ReadFile(file.string(), aiProcess_ValidateDataStructure);
  } catch (const std::exception& error) {
    fail(file, one_line(error.what()));
  }
  if (scene == nullptr) fail(file, one_line(importer.GetErrorString()));
  Polygons polygons;
  if (scene->mRootNode != nullptr) add_node(*scene, *scene->mRootNode, aiMatrix4x4(), polygons);
  return polygons;
}

Mesh load_mesh(const path& file, const MeshOptions& options) {
  using Reader = Polygons (*)(const path&, const std::string&);
  static const std::map<std::string, Reader> readers = {
      {".off", read_off}, {".obj", read_obj}, {".ply", read_ply}, {".stl", read_stl}};
  const std::string extension = lower_case(file.extension().string());
  const auto reader = readers.find(extension);
  const bool own = reader != readers.end();
  if (!own && !std::filesystem::is_regular_file(file)) read_file(file);  // says what is wrong
  MeshOptions used = options;
  used.weld |= !own || extension == ".stl";
  try {
    return MeshBuilder::build(own ? reader->second(file, read_file(file)) : read_by_assimp(file), used,
                              fmt::format("\"{}\"", file.string()));
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::memory, fmt::format("\"{}\": not enough memory for this mesh", file.string()));
  }
}

}  // namespace smurf
