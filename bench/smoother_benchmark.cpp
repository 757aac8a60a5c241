// SPDX-License-Identifier: Apache-2.0
//
// The smoother over long synthetic drives with loops: time per update as the graph grows, time to resume from the
// journal, memory per keyframe. With clouds the journal is a file, as in the process. Bound by iSAM2: the elimination
// of what a loop touches, and the relinearisation that follows a correction; then by back-substitution down to where
// nothing moves.
//
//     ninja -C build/release benchmarks && build/release/bin/smoother_benchmark

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "backend/smoother.h"
#include "backend/synthetic_drive.h"
#include "graph_backend/journal_file.h"
#include "process_cost.h"

namespace ignis {
namespace {

using bench::processor_ms;
using bench::quantile;
using bench::resident_bytes;

constexpr int kKeyframesPerLap = 21;
constexpr double kCloudReach = 15.0;  // [m]

/// A loop from keyframe `from` to the place one to three laps ago, as an exact match would measure it.
LoopMeasurement true_loop(const testing::Drive& drive, int from) {
  LoopMeasurement loop;
  loop.from_id = from;
  loop.to_id = from - kKeyframesPerLap * (1 + from % 3);
  loop.T_to_from = drive.T_world_body[static_cast<std::size_t>(loop.to_id)].inverse() *
                   drive.T_world_body[static_cast<std::size_t>(from)];
  Vector6d information;
  information << Eigen::Vector3d::Constant(1.0 / (0.003 * 0.003)), Eigen::Vector3d::Constant(1.0 / (0.02 * 0.02));
  loop.information = information.asDiagonal();
  return loop;
}

/// Loops are handed in, so what it shows does not matter.
std::vector<CloudPoint> cloud_of(std::int64_t points) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-kCloudReach, kCloudReach);
  std::vector<CloudPoint> cloud(static_cast<std::size_t>(points));
  for (CloudPoint& point : cloud) point.position = {place(random), place(random), place(random)};
  return cloud;
}

/// Of this process alone: two that run at once would remove each other's journal.
std::filesystem::path journal_folder() {
  return std::filesystem::temp_directory_path() / ("ignis_smoother_benchmark_" + std::to_string(getpid()));
}

/// Arguments: keyframes, keyframes from one loop to the next, points of a cloud.
void drive(benchmark::State& state) {
  const auto count = static_cast<int>(state.range(0));
  const auto loop_every = static_cast<int>(state.range(1));
  const std::vector<CloudPoint> cloud = cloud_of(state.range(2));
  const testing::Drive drive = testing::make_drive({.seed = 1, .keyframes = count});
  BackendConfig config;
  config.use_loop_closing = false;  // the search is another matter; loops are handed in
  for (auto _ : state) {
    const std::filesystem::path folder = journal_folder();
    std::filesystem::remove_all(folder);
    JournalFile journal(folder);
    journal.begin({kJournalVersion, "benchmark", 0});
    const double before = resident_bytes();
    Smoother smoother(config, LoopGates{}, &journal);
    std::vector<double> updates;
    std::vector<double> loops;
    std::vector<double> changes;
    std::vector<double> steps;  // of a process that keeps a journal: all three
    for (Keyframe keyframe : drive.keyframes) {
      keyframe.cloud = cloud;
      const double began = processor_ms();
      benchmark::DoNotOptimize(smoother.add_keyframe(keyframe));
      const double updated = processor_ms();
      updates.push_back(updated - began);
      if (keyframe.id > 3 * kKeyframesPerLap && keyframe.id % loop_every == 0) {
        benchmark::DoNotOptimize(smoother.add_loop(true_loop(drive, keyframe.id)));
        loops.push_back(processor_ms() - updated);
      }
      const double closed = processor_ms();
      journal.append(smoother.take_change());
      changes.push_back(processor_ms() - closed);
      steps.push_back(processor_ms() - began);
    }
    state.counters["kB/keyframe"] = (resident_bytes() - before) / 1e3 / count;
    state.counters["MB"] = resident_bytes() / 1e6;
    const double resume_began = processor_ms();
    const std::optional<LoadedJournal> loaded = journal.load();
    const SmootherRestoration restoration = restore_smoother(config, LoopGates{}, loaded->contents.payloads, &journal);
    state.counters["resume_ms"] = processor_ms() - resume_began;
    if (restoration.smoother.all_poses().size() != drive.keyframes.size()) state.SkipWithError("not resumed");
    state.counters["p50_ms"] = quantile(updates, 0.5);
    state.counters["p99_ms"] = quantile(updates, 0.99);
    state.counters["last100_p50_ms"] = quantile({updates.end() - 100, updates.end()}, 0.5);
    state.counters["change_p50_ms"] = quantile(changes, 0.5);
    state.counters["step_p50_ms"] = quantile(steps, 0.5);
    state.counters["step_p99_ms"] = quantile(steps, 0.99);
    state.counters["step_max_ms"] = quantile(steps, 1.0);
    state.counters["loop_p50_ms"] = quantile(loops, 0.5);
    state.counters["loop_max_ms"] = quantile(loops, 1.0);
    state.counters["loops"] = smoother.stats().loops_kept;
    state.counters["journal_kB/keyframe"] = static_cast<double>(loaded->bytes().size()) / 1e3 / count;
    std::filesystem::remove_all(folder);
  }
}

BENCHMARK(drive)
    ->Args({600, 27, 0})
    ->Args({2000, 27, 0})
    ->Args({10000, 27, 0})
    ->Args({2000, 27, 12000})
    ->Args({2000, 9, 12000})
    ->Args({10000, 27, 12000})
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

}  // namespace
}  // namespace ignis
