// Mesh files, through assimp.
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/core.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <string>

#include "bench/metrics/triangle_mesh.hpp"
#include "core/assimp_files.hpp"
#include "core/input_error.hpp"
#include "core/plausible_length.hpp"

namespace tankrig {
namespace {

void append(const aiMesh& part, const aiMatrix4x4& file_from_node, TriangleMesh& mesh) {
  const int base = static_cast<int>(mesh.vertices.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D v = file_from_node * part.mVertices[i];
    mesh.vertices.emplace_back(v.x, v.y, v.z);
  }
  const bool mirrored = file_from_node.Determinant() < 0;
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices != 3) continue;  // points and lines; polygons are triangles by now
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k) corners[k] = base + static_cast<int>(face.mIndices[k]);
    if (mirrored) std::swap(corners[1], corners[2]);
    mesh.triangles.push_back(corners);
  }
}

void append(const aiScene& scene, const aiNode& node, const aiMatrix4x4& file_from_parent, TriangleMesh& mesh) {
  const aiMatrix4x4 file_from_node = file_from_parent * node.mTransformation;
  for (unsigned i = 0; i < node.mNumMeshes; ++i) append(*scene.mMeshes[node.mMeshes[i]], file_from_node, mesh);
  for (unsigned i = 0; i < node.mNumChildren; ++i) append(scene, *node.mChildren[i], file_from_node, mesh);
}

std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

/// An object that no tank holds, or that no camera sees, was drawn in another unit.
void check_size(const std::filesystem::path& file, const TriangleMesh& mesh) {
  const double longest = mesh.bounds().sizes().maxCoeff();
  if (longest >= kSmallestObject && longest <= kLargestObject) return;
  throw InputError(file, fmt::format("found an object of {:g} m, expected metres, from {:g} to {:g} m: looks like {}",
                                     longest, kSmallestObject, kLargestObject,
                                     longest > kLargestObject ? "millimetres" : "metres divided by 1000"));
}

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& file, const std::filesystem::path& root) {
  check_mesh_file(file);
  Assimp::Importer importer;
  importer.SetIOHandler(new AssimpFiles(root));  // the importer's own from here on
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene = importer.ReadFile(file.string(), aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr)
    throw InputError(file, "not readable as a mesh (" + one_line(importer.GetErrorString()) +
                               "), expected a triangle mesh such as PLY, STL, OBJ or Collada");

  TriangleMesh raw;
  append(*scene, *scene->mRootNode, aiMatrix4x4(), raw);
  if (raw.triangles.empty())
    throw InputError(file, fmt::format("found {} vertices and no face, expected triangles", raw.vertices.size()));
  for (std::size_t i = 0; i < raw.vertices.size(); ++i)
    if (!raw.vertices[i].allFinite())
      throw InputError(file, fmt::format("vertex {} is not finite, expected metres", i));

  TriangleMesh mesh = weld(raw);
  if (!(mesh.area() > 0)) throw InputError(file, "all faces have area 0, expected a surface");
  check_size(file, mesh);
  const MeshTopology shape = topology(mesh);
  if (shape.closed && !shape.outward)
    for (Eigen::Vector3i& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

}  // namespace tankrig
