// SPDX-License-Identifier: Apache-2.0
//
// lio_frontend: L1_IMU and L1_SCAN in; LIO_STATE at each IMU sample, LIO_SCAN_STATS and LIO_CLOUD at each scan and
// LIO_KEYFRAME every few metres out. LIO_COMMAND begins a new session. KEYFRAME_REQUEST makes it send keyframes again,
// CLOUD_REQUEST the newest clouds as LIO_CLOUD_AGAIN. With a checkpoint, a killed process is succeeded by one that goes
// on in the same session.

#include "frontend_node.h"

#include "runtime/state_folder.h"
#include "runtime/stop_signal.h"

int main(int argc, char** argv) {
  using namespace ignis::runtime;
  std::string checkpoint_folder = supervised_folder("RUNTIME_DIRECTORY");
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
