// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/scene_config.h"

#include <format>

#include "common/config_json.h"
#include "drivers/sim/mesh_file.h"

namespace ignis::sim {
namespace {

void load_meshes(std::vector<MeshConfig>& meshes, const std::filesystem::path& folder) {
  config::Offences offences;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    try {
      meshes[i].mesh = placed(meshes[i], load_mesh(folder / meshes[i].file));
    } catch (const MeshFileError& error) {
      offences.push_back({std::format("meshes[{}].file", i), '"' + meshes[i].file + '"',
                          std::format("a PLY or OBJ file with triangles; {}", error.what())});
    }
  }
  if (!offences.empty()) throw config::ConfigError(offences);
}

SceneConfig load_one(const std::filesystem::path& file) {
  const config::Json json = config::read_json(file);
  try {
    SceneConfig scene = config::load<SceneConfig>(json);
    load_meshes(scene.meshes, file.parent_path());
    return scene;
  } catch (const config::ConfigError& error) {
    throw config::ConfigError("scene " + file.string() + ": " + error.what());
  }
}

template <class T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

SceneConfig load_scene(const std::filesystem::path& file) {
  SceneConfig scene = load_one(file);
  if (scene.geometry.empty()) return scene;
  const SceneConfig source = load_one(file.parent_path() / scene.geometry);
  if (!source.geometry.empty()) {
    throw config::ConfigError("scene " + file.string() + ": geometry = \"" + scene.geometry +
                              "\" takes its own geometry from \"" + source.geometry + "\"; name that file instead");
  }
  append(scene.planes, source.planes);
  append(scene.boxes, source.boxes);
  append(scene.cylinders, source.cylinders);
  append(scene.spheres, source.spheres);
  append(scene.meshes, source.meshes);
  append(scene.movers, source.movers);
  return scene;
}

RayScene make_ray_scene(const SceneConfig& scene) {
  std::vector<Plane> planes;
  for (const PlaneConfig& plane : scene.planes) planes.push_back(to_plane(plane));
  std::vector<TriangleMesh> meshes;
  for (const MeshConfig& mesh : scene.meshes) meshes.push_back(mesh.mesh);
  std::vector<Mover> movers;
  for (const MoverConfig& mover : scene.movers) movers.push_back(to_mover(mover));
  return {std::move(planes), to_solids(scene.boxes, scene.cylinders, scene.spheres), std::move(meshes),
          std::move(movers)};
}

}  // namespace ignis::sim
