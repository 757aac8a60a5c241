// SPDX-License-Identifier: Apache-2.0
//
// lio_frontend: L1_IMU and L1_SCAN in; LIO_STATE at each IMU sample, LIO_SCAN_STATS and LIO_CLOUD at each scan and
// LIO_KEYFRAME every few metres out. KEYFRAME_REQUEST makes it send keyframes again.

#include "frontend_node.h"

#include "runtime/stop_signal.h"

int main(int argc, char** argv) {
  using namespace ignis::runtime;
  return run_application(
      "lio_frontend", "LiDAR-inertial odometry: error-state Kalman filter with scan matching.", argc, argv,
      [](CLI::App&) {},
      [](const Application& application) {
        ignis::FrontendNode node(application);
        while (!stop_requested()) node.spin_once();
        return kDone;
      });
}
