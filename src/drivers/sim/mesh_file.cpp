// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/mesh_file.h"

#include <format>

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>

namespace ignis::sim {
namespace {

void append_vertices(TriangleMesh& mesh, const aiMesh& part) {
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& v = part.mVertices[i];
    const Eigen::Vector3f vertex(v.x, v.y, v.z);
    if (!vertex.allFinite()) {
      throw MeshFileError(std::format("corner {} is not a number in each coordinate", mesh.vertices.size()));
    }
    mesh.vertices.push_back(vertex);
  }
}

void append_triangles(TriangleMesh& mesh, const aiMesh& part, std::size_t first_vertex) {
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices != 3) continue;
    std::array<std::uint32_t, 3>& triangle = mesh.triangles.emplace_back();
    for (unsigned k = 0; k < 3; ++k) {
      if (face.mIndices[k] >= part.mNumVertices) {
        throw MeshFileError(std::format("triangle {} has a corner {}, but the file ends at corner {}", i,
                                        face.mIndices[k], part.mNumVertices - 1));
      }
      triangle[k] = static_cast<std::uint32_t>(first_vertex) + face.mIndices[k];
    }
  }
}

}  // namespace

TriangleMesh load_mesh(const std::filesystem::path& file) {
  const std::filesystem::path extension = file.extension();
  if (extension != ".ply" && extension != ".obj") throw MeshFileError("its name must end in .ply or .obj");
  if (!std::filesystem::is_regular_file(file)) throw MeshFileError("there is no such file");

  Assimp::Importer importer;
  // The structure is validated before polygons are split, so a wrong index never reaches the splitting.
  const aiScene* scene = importer.ReadFile(file.string(), aiProcess_ValidateDataStructure | aiProcess_Triangulate);
  if (scene == nullptr) throw MeshFileError(std::format("it cannot be read: {}", importer.GetErrorString()));

  TriangleMesh mesh;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    const std::size_t first_vertex = mesh.vertices.size();
    append_vertices(mesh, *scene->mMeshes[i]);
    append_triangles(mesh, *scene->mMeshes[i], first_vertex);
  }
  if (mesh.triangles.empty()) throw MeshFileError("it holds no triangles");
  return mesh;
}

}  // namespace ignis::sim
