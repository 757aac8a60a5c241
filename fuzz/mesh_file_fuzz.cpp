// SPDX-License-Identifier: Apache-2.0
//
// Meshes of scenes from strangers: a file is refused with a message, or gives triangles whose corners exist and are
// numbers. The first byte chooses PLY or OBJ.

#include <cstdint>
#include <filesystem>
#include <format>
#include <fstream>

#include <unistd.h>

#include "drivers/sim/mesh_file.h"
#include "require.h"

namespace {

using namespace ignis;
using fuzz::require;

void check(const sim::TriangleMesh& mesh) {
  require(!mesh.triangles.empty());
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) require(corner < mesh.vertices.size());
  }
  for (const Eigen::Vector3f& vertex : mesh.vertices) require(vertex.allFinite());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  // Assimp looks at the name, so no descriptor will do.
  static const std::filesystem::path stem = std::format("/dev/shm/ignis_mesh_fuzz.{}", getpid());
  std::filesystem::path file = stem;
  file += data[0] % 2 == 0 ? ".ply" : ".obj";
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(data) + 1, std::streamsize(size) - 1);
  try {
    check(sim::load_mesh(file));
  } catch (const sim::MeshFileError& error) {
    require(*error.what() != '\0');
  }
  std::filesystem::remove(file);
  return 0;
}
