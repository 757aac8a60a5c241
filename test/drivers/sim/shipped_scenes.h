// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/sim/scene_config.h"

namespace ignis::sim::test {

inline std::filesystem::path scene_folder() { return std::filesystem::path(IGNIS_CONFIG_DIR) / "scenes"; }

/// File names of every scene that is shipped, in alphabetical order.
inline std::vector<std::string> shipped_scenes() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(scene_folder())) {
    if (entry.path().extension() == ".json") names.push_back(entry.path().filename().string());
  }
  std::ranges::sort(names);
  return names;
}

/// Those whose LiDAR is of a model.
inline std::vector<std::string> shipped_scenes(const std::string& model) {
  std::vector<std::string> names = shipped_scenes();
  std::erase_if(names, [&](const std::string& name) { return load_scene(scene_folder() / name).lidar.model != model; });
  return names;
}

/// Name of the test of a scene.
inline constexpr auto kSceneName = [](const auto& scene) { return std::filesystem::path(scene.param).stem().string(); };

}  // namespace ignis::sim::test
