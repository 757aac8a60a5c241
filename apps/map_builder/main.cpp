// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <iostream>

#include "map/map_export.h"
#include "map_builder/map_process.h"
#include "runtime/application.h"
#include "runtime/state_folder.h"

namespace {

struct Options {
  int port = -1;
  std::string out;
  std::string journal_folder = ignis::runtime::supervised_folder("RUNTIME_DIRECTORY");
};

void save_map(const ignis::ThreeLevelMap& map, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  ignis::write_pcd(folder / "map.pcd", map);
  ignis::write_ply(folder / "map.ply", map);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace ignis;
  Options options;
  const auto add_options = [&](CLI::App& app) {
    app.add_option("--port", options.port, "TCP port of the view instead of hmi.port; 0 lets the system choose")
        ->check(CLI::Range(0, 65535));
    app.add_option("--journal", options.journal_folder,
                   "folder for the journal of the map, from which a killed process goes on (default: "
                   "RUNTIME_DIRECTORY, else none)");
    app.add_option("--out", options.out, "folder for map.pcd and map.ply, written when the process is stopped");
  };
  const auto body = [&](const runtime::Application& application) {
    runtime::HmiConfig hmi = application.config.hmi;
    if (options.port >= 0) hmi.port = options.port;
    MapProcess process(application, hmi, options.journal_folder);
    std::cout << "map_builder: the view is at " << process.address() << std::endl;
    process.run();
    if (!options.out.empty()) save_map(process.map().voxels(), options.out);
    return runtime::kDone;
  };
  return runtime::run_application("map_builder", "Three-level voxel map and browser view", argc, argv, add_options,
                                  body);
}
