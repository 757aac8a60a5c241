// SPDX-License-Identifier: Apache-2.0
//
// lio_frontend: L1_IMU and L1_SCAN in; LIO_STATE at each IMU sample, LIO_SCAN_STATS and LIO_CLOUD at each scan and
// LIO_KEYFRAME every few metres out. KEYFRAME_REQUEST makes it send keyframes again. With a checkpoint, a killed
// process is succeeded by one that goes on in the same session.

#include <cstdlib>

#include "frontend_node.h"

#include "runtime/stop_signal.h"

namespace {

/// A supervisor that gives a folder for run time files wants a killed process to be succeeded within the drive. Whoever
/// starts it by hand asks for a checkpoint by name, so that no files appear in folders unasked.
std::string supervised_folder() {
  const char* folder = std::getenv("RUNTIME_DIRECTORY");
  return folder != nullptr ? folder : "";
}

}  // namespace

int main(int argc, char** argv) {
  using namespace ignis::runtime;
  std::string checkpoint_folder = supervised_folder();
  return run_application(
      "lio_frontend", "LiDAR-inertial odometry: error-state Kalman filter with scan matching.", argc, argv,
      [&](CLI::App& app) {
        app.add_option("--checkpoint", checkpoint_folder,
                       "folder for the checkpoint from which a killed process goes on (default: RUNTIME_DIRECTORY, "
                       "else none)");
      },
      [&](const Application& application) {
        ignis::FrontendNode node(application, checkpoint_folder);
        while (!stop_requested()) node.spin_once();
        return kDone;
      });
}
