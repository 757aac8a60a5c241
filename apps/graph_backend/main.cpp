// SPDX-License-Identifier: Apache-2.0
//
// graph_backend: iSAM2 over keyframes. LIO_KEYFRAME causes one update of the graph, one LOOP_RESULT and one revision of
// SMOOTHED_KEYFRAMES; each LIO_STATE is placed in map by the newest correction and leaves as SMOOTHED_STATE, at 50 Hz.

#include "backend_node.h"

#include "runtime/stop_signal.h"

int main(int argc, char** argv) {
  using namespace ignis::runtime;
  return run_application(
      "graph_backend", "Pose-graph smoother: keyframes in, corrected keyframes out.", argc, argv, [](CLI::App&) {},
      [](const Application& application) {
        ignis::BackendNode node(application);
        while (!stop_requested()) node.spin_once();
        return kDone;
      });
}
