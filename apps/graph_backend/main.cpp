// SPDX-License-Identifier: Apache-2.0
//
// graph_backend: iSAM2 over keyframes. LIO_KEYFRAME causes one update of the graph, one LOOP_RESULT and one revision of
// SMOOTHED_KEYFRAMES; each LIO_STATE is placed in map by the newest correction and leaves as SMOOTHED_STATE, at 50 Hz.
// GRAPH_COMMAND withdraws and vetoes loops. With a journal, a killed process is succeeded by one with the same graph.

#include "backend_node.h"
#include "runtime/state_folder.h"
#include "runtime/stop_signal.h"

int main(int argc, char** argv) {
  using namespace ignis::runtime;
  std::string journal_folder = supervised_folder("STATE_DIRECTORY");
  return run_application(
      "graph_backend", "Pose-graph smoother: keyframes in, corrected keyframes out.", argc, argv,
      [&](CLI::App& app) {
        app.add_option("--journal", journal_folder,
                       "folder for the journal of the graph, from which a killed process resumes (default: "
                       "STATE_DIRECTORY, else none)");
      },
      [&](const Application& application) {
        ignis::BackendNode node(application, journal_folder);
        while (!stop_requested()) node.spin_once();
        return kDone;
      });
}
