// SPDX-License-Identifier: Apache-2.0
//
// loop_defences: wrong loops among the true ones of a drive, and what becomes of the trajectory under each defence:
// none, robust kernels, trial and withdrawal alone, and the back end as it is, with pairwise consistency before.
//
//     build/release/bin/loop_defences --config config/ignis8_tuned.json [--log KEYFRAMES.lcm --truth ground_truth.tum]
//
// Without a log, over synthetic laps (test/backend/synthetic_drive.h), one drive per seed; with one, one set of lies
// per seed. One row per share of wrong loops and defence: mean over the seeds of the error after alignment, the same
// over that of the same defence without wrong loops, the largest such ratio, true and wrong loops in the final graph,
// seconds of processor time.
//
//     build/release/bin/loop_defences --config config/ignis8_tuned.json --graph GRAPH.g2o [--set backend.KEY=VALUE]
//
// Over a published pose graph (graph_study.h) the back end as it is alone. One row per share: the same over the seeds,
// and the processor time of a pose with its loops.

#include <algorithm>
#include <format>
#include <functional>
#include <iostream>
#include <string>
#include <vector>

#include "aligned_error.h"
#include "graph_study.h"
#include "loop_liar.h"
#include "process_cost.h"
#include "robust_graph.h"
#include "runtime/application.h"
#include "study_drive.h"

namespace {

using namespace ignis;
using namespace ignis::bench;

constexpr double kKeptAsMeasuredM = 1e-6;

struct Outcome {
  double error_m = 0.0;
  int true_kept = 0;
  int wrong_kept = 0;
  double seconds = 0.0;
};

struct Defence {
  std::string name;
  std::function<Outcome(const StudyDrive&, const std::vector<StudyLoop>&)> run;
};

/// Feeds keyframes and loops to a graph in the order in which they would have come.
template <class Graph, class AddLoop>
void feed(const StudyDrive& drive, const std::vector<StudyLoop>& loops, Graph& graph, AddLoop add_loop) {
  std::size_t next = 0;
  for (const Keyframe& keyframe : drive.keyframes) {
    graph(keyframe);
    for (; next < loops.size() && loops[next].measurement.from_id == keyframe.id; ++next) add_loop(loops[next]);
  }
}

Outcome by_kernel(Kernel kernel, const BackendConfig& config, const StudyDrive& drive,
                  const std::vector<StudyLoop>& loops) {
  const double began = processor_ms();
  RobustGraph graph(config, kernel);
  const auto add = [&](const Keyframe& keyframe) { graph.add(keyframe); };
  Outcome outcome;
  feed(drive, loops, add, [&](const StudyLoop& loop) {
    graph.add(loop.measurement);
    ++(loop.is_true ? outcome.true_kept : outcome.wrong_kept);
  });
  outcome.error_m = aligned_error(graph.poses(), drive.T_world_body);
  outcome.seconds = (processor_ms() - began) / 1e3;
  return outcome;
}

bool is_the_same(const PoseGraphEdge& edge, const LoopMeasurement& loop) {
  return edge.to == loop.from_id && edge.from == loop.to_id &&
         (edge.T_from_to.translation - loop.T_to_from.translation).norm() < kKeptAsMeasuredM;
}

Outcome by_decision(BackendConfig config, const StudyDrive& drive, const std::vector<StudyLoop>& loops) {
  config.use_loop_closing = false;  // the search is another matter
  const double began = processor_ms();
  Smoother smoother(config, LoopGates());
  const auto add = [&](const Keyframe& keyframe) { static_cast<void>(smoother.add_keyframe(keyframe)); };
  feed(drive, loops, add, [&](const StudyLoop& loop) { static_cast<void>(smoother.add_loop(loop.measurement)); });
  Outcome outcome;
  std::vector<Pose> poses;
  for (const KeyframePose& pose : smoother.all_poses()) poses.push_back(pose.T_map_body);
  outcome.error_m = aligned_error(poses, drive.T_world_body);
  outcome.seconds = (processor_ms() - began) / 1e3;
  for (const PoseGraphEdge& edge : smoother.pose_graph().edges) {
    if (!edge.is_loop) continue;
    for (const StudyLoop& loop : loops) {
      if (!is_the_same(edge, loop.measurement)) continue;
      ++(loop.is_true ? outcome.true_kept : outcome.wrong_kept);
      break;
    }
  }
  return outcome;
}

/// Neither odometry nor other loops are asked before a loop enters; what the graph contradicts is taken out again.
BackendConfig without_consistency(BackendConfig config) {
  config.loop_drift_scale = 100.0;
  config.loop_support_beyond_m = 1000.0;
  return config;
}

std::vector<Defence> defences(const BackendConfig& config) {
  const auto kernel = [&config](Kernel kind) {
    return [&config, kind](const StudyDrive& drive, const std::vector<StudyLoop>& loops) {
      return by_kernel(kind, config, drive, loops);
    };
  };
  const auto decision = [](const BackendConfig& rules) {
    return [rules](const StudyDrive& drive, const std::vector<StudyLoop>& loops) {
      return by_decision(rules, drive, loops);
    };
  };
  return {{"none", kernel(Kernel::kNone)},
          {"Huber", kernel(Kernel::kHuber)},
          {"Cauchy", kernel(Kernel::kCauchy)},
          {"trial alone", decision(without_consistency(config))},
          {"as it is", decision(config)}};
}

struct Study {
  std::vector<StudyDrive> drives;  ///< one, or one per seed
  unsigned seeds = 0;
  [[nodiscard]] const StudyDrive& drive(unsigned seed) const { return drives[drives.size() == 1 ? 0 : seed]; }
};

void print_row(const Defence& defence, const Study& study, double share, Lies lies,
               std::vector<double>& clean_error_m) {
  Outcome sum;
  std::size_t true_loops = 0;
  std::size_t wrong_loops = 0;
  double ratio_sum = 0.0;
  double worst = 0.0;
  for (unsigned seed = 0; seed < study.seeds; ++seed) {
    const StudyDrive& drive = study.drive(seed);
    const std::vector<StudyLoop> loops = with_lies(drive, share, lies, seed + 1);
    const Outcome outcome = defence.run(drive, loops);
    if (share == 0.0) clean_error_m.push_back(outcome.error_m);
    const double ratio = outcome.error_m / clean_error_m[seed];
    ratio_sum += ratio;
    worst = std::max(worst, ratio);
    sum.error_m += outcome.error_m;
    sum.true_kept += outcome.true_kept;
    sum.wrong_kept += outcome.wrong_kept;
    sum.seconds += outcome.seconds;
    true_loops += drive.loops.size();
    wrong_loops += loops.size() - drive.loops.size();
  }
  std::cout << std::format("{:7.0f} %  {:12s} {:9.4f} {:8.3f} {:8.3f}   {:5d} of {:5d}   {:5d} of {:5d} {:8.2f}\n",
                           100.0 * share, defence.name, sum.error_m / study.seeds, ratio_sum / study.seeds, worst,
                           sum.true_kept, true_loops, sum.wrong_kept, wrong_loops, sum.seconds)
            << std::flush;
}

void print_graph_row(const GraphStudy& study, double share, Lies lies, unsigned seeds, const BackendConfig& config) {
  GraphOutcome sum;
  sum.ate_ratio = 0.0;
  double largest_ratio = 0.0;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    const GraphOutcome outcome = judged(study, with_lies(study.drive, share, lies, seed), config);
    sum.true_tried += outcome.true_tried;
    sum.true_kept += outcome.true_kept;
    sum.false_tried += outcome.false_tried;
    sum.false_kept += outcome.false_kept;
    sum.from_clean_m += outcome.from_clean_m / seeds;
    sum.ate_ratio += outcome.ate_ratio / seeds;
    sum.p99_ms = std::max(sum.p99_ms, outcome.p99_ms);
    largest_ratio = std::max(largest_ratio, outcome.ate_ratio);
  }
  std::cout << std::format("{:7.0f} %   {:9.4f} {:8.3f} {:8.3f}   {:5d} of {:5d}   {:5d} of {:5d} {:8.1f}\n",
                           100.0 * share, sum.from_clean_m, sum.ate_ratio, largest_ratio, sum.true_kept, sum.true_tried,
                           sum.false_kept, sum.false_tried, sum.p99_ms)
            << std::flush;
}

}  // namespace

int main(int argc, char** argv) {
  std::string log;
  std::string truth;
  std::string graph;
  double information_scale = 1.0;
  std::size_t poses = 100'000;
  std::string lies = "independent";
  unsigned seeds = 10;
  std::vector<double> shares = {0.01, 0.03, 0.1, 0.3};
  std::vector<std::string> only;
  return runtime::run_application(
      "loop_defences", "Compares defences against wrong loops.", argc, argv,
      [&](CLI::App& app) {
        CLI::Option* file = app.add_option("--log", log, "LCM log with LIO_KEYFRAME; without: synthetic laps");
        app.add_option("--truth", truth, "its ground_truth.tum")->needs(file);
        app.add_option("--graph", graph, "g2o file of a pose graph")->excludes(file);
        app.add_option("--poses", poses, "only the first ones of it")->check(CLI::Range(2, 100'000));
        app.add_option("--information-scale", information_scale, "factor on the information of its edges")
            ->check(CLI::PositiveNumber);
        app.add_option("--lies", lies, "independent or groups")->check(CLI::IsMember({"independent", "groups"}));
        app.add_option("--seeds", seeds, "sets of wrong loops")->check(CLI::Range(1U, 1000U));
        app.add_option("--shares", shares, "of wrong loops among all")->check(CLI::Range(0.0, 0.95));
        app.add_option("--only", only, "defences to compare");
      },
      [&](const runtime::Application& application) {
        const BackendConfig& config = application.config.backend;
        const Lies kind = lies == "groups" ? Lies::kGroups : Lies::kIndependent;
        if (!graph.empty()) {
          const GraphStudy study = graph_study(read_pose_graph(graph), poses, information_scale);
          std::cout << std::format("the optimum's own error {:.4f} m\n", study.clean_ate_m)
                    << "  wrong     from it [m]  ATE of clean, largest    true in graph  wrong in graph   p99 ms\n";
          print_graph_row(study, 0.0, kind, 1, config);
          for (const double share : shares) print_graph_row(study, share, kind, seeds, config);
          return runtime::kDone;
        }
        Study study{{}, seeds};
        if (log.empty()) {
          for (unsigned seed = 1; seed <= seeds; ++seed) study.drives.push_back(synthetic_study(seed));
        } else {
          study.drives.push_back(recorded_study(log, truth, config, application.config.frontend.loop_gates));
        }
        std::cout << "  wrong    defence         ATE [m] of clean  largest    true in graph  wrong in graph    cpu s\n";
        for (const Defence& defence : defences(config)) {
          if (!only.empty() && std::ranges::find(only, defence.name) == only.end()) continue;
          std::vector<double> clean_error_m;
          print_row(defence, study, 0.0, Lies::kIndependent, clean_error_m);
          for (const double share : shares) {
            print_row(defence, study, share, kind, clean_error_m);
          }
        }
        return runtime::kDone;
      });
}
