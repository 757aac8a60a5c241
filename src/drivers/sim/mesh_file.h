// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>

#include "drivers/sim/mesh.h"

namespace ignis::sim {

/// A mesh file that cannot be used; what() says why, without the file's name.
class MeshFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads the triangles of a PLY or OBJ file in the file's own axes and unit; polygons are split, points and lines left
/// out. Throws MeshFileError for a missing or damaged file, other formats, corners that are not finite or do not exist,
/// and a file without triangles.
[[nodiscard]] TriangleMesh load_mesh(const std::filesystem::path& file);

}  // namespace ignis::sim
