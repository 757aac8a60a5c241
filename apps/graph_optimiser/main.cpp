// SPDX-License-Identifier: Apache-2.0
//
// graph_optimiser: a pose graph from a file through the back end's solver, pose by pose, with batch
// Levenberg-Marquardt beside it.

#include <format>
#include <iostream>
#include <optional>

#include "optimise_report.h"
#include "runtime/application.h"
#include "runtime/stop_signal.h"

namespace {

using namespace ignis;

struct Options {
  std::string input;
  std::string output;
  bool no_batch = false;
  SolverConfig solver;
};

/// Thousands of poses that a loop moves all at once would otherwise be linearised anew at every step; what this leaves
/// undone, the settling at the end does.
SolverConfig solver_for_files() {
  SolverConfig config;
  config.relinearize_position_m = config.relinearize_rotation_rad = 0.1;
  config.relinearize_skip = 10;
  config.wildfire_threshold = 1e-3;
  return config;
}

PoseGraph read(const std::string& file) {
  try {
    return read_pose_graph(file);
  } catch (const std::runtime_error& error) {
    throw runtime::UserError(error.what());
  }
}

PoseGraphOptimiser make_optimiser(const PoseGraph& graph, const Options& options) {
  try {
    return PoseGraphOptimiser(graph, options.solver);
  } catch (const config::ConfigError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw runtime::UserError(std::format("{}: {}", options.input, error.what()));
  }
}

/// Nothing when it was interrupted.
std::optional<PoseGraphSolution> solve_incrementally(const PoseGraph& graph, const Options& options) {
  PoseGraphOptimiser optimiser = make_optimiser(graph, options);
  SolveProgress progress;
  UpdateTimes times;
  while (!optimiser.complete()) {
    const Stopwatch update;
    optimiser.add_next();
    times.seconds.push_back(update.seconds());
    progress.show(std::format("incremental, {} of {} poses", optimiser.entered(), graph.vertices.size()));
    if (runtime::stop_requested()) {
      std::cout << std::format("interrupted after {} of {} poses\n", optimiser.entered(), graph.vertices.size());
      return std::nullopt;
    }
  }
  const Stopwatch settling;
  PoseGraphSolution solution = optimiser.finish([&](PoseGraphStart start) {
    progress.show(std::format("settling from {}, {:.0f} s", words_of(start), settling.seconds()));
    return !runtime::stop_requested();
  });
  std::cout << cost_line(
                   "incremental", graph, solution,
                   std::format("{:.2f} s; per update p50 {:.2f} ms, p99 {:.2f} ms, max {:.1f} ms; settling {:.2f} s; "
                               "lowest from {}{}",
                               times.total() + settling.seconds(), 1e3 * times.quantile(0.5),
                               1e3 * times.quantile(0.99), 1e3 * times.quantile(1.0), settling.seconds(),
                               words_of(solution.start), runtime::stop_requested() ? ", interrupted" : ""))
            << std::flush;
  if (!solution.given_up.empty()) std::cout << std::format("  further starts failed: {}\n", solution.given_up);
  return solution;
}

void solve_in_batch(const PoseGraph& graph) {
  SolveProgress progress;
  const Stopwatch total;
  std::size_t iterations = 0;
  const PoseGraphSolution solution = optimise_in_batch(graph, [&](std::size_t iteration, double half_chi_square) {
    iterations = iteration;
    progress.show(std::format("batch, iteration {}, half chi-square {:.6g}", iteration, half_chi_square));
    return !runtime::stop_requested();
  });
  std::cout << cost_line("batch LM", graph, solution,
                         std::format("{:.2f} s; {} iterations from the file's poses{}", total.seconds(), iterations,
                                     runtime::stop_requested() ? ", interrupted" : ""));
}

runtime::ExitCode optimise(const Options& options) {
  PoseGraph graph = read(options.input);
  std::cout << std::format("{}: {} poses, {} edges{}\n", options.input, graph.vertices.size(), graph.edges.size(),
                           graph.planar ? ", planar" : "")
            << cost_head() << std::flush;
  const std::optional<PoseGraphSolution> solution = solve_incrementally(graph, options);
  if (!solution) return runtime::kFailed;
  if (!options.output.empty()) {
    PoseGraph solved = graph;
    solved.vertices = solution->poses;
    write_pose_graph(options.output, solved);
  }
  if (!options.no_batch) solve_in_batch(graph);
  if (!options.output.empty()) std::cout << std::format("result: {}\n", options.output);
  return runtime::stop_requested() ? runtime::kFailed : runtime::kDone;
}

}  // namespace

int main(int argc, char** argv) {
  Options options{.input = {}, .output = {}, .no_batch = false, .solver = solver_for_files()};
  return runtime::run_application(
      "graph_optimiser",
      "Solves a g2o pose graph with the back end's incremental solver, a pose entering when an edge connects it, and "
      "with batch Levenberg-Marquardt beside it.",
      argc, argv,
      [&](CLI::App& app) {
        app.add_option("graph", options.input, "g2o text: VERTEX_SE3:QUAT and EDGE_SE3:QUAT, or the SE2 records");
        app.add_option("-o,--out", options.output, "file for the graph with the solution of lowest cost");
        app.add_flag("--no-batch", options.no_batch, "leave out the batch solve");
        app.add_option("--relinearize-position", options.solver.relinearize_position_m,
                       "shift that asks for a new linearisation [m]")
            ->capture_default_str();
        app.add_option("--relinearize-rotation", options.solver.relinearize_rotation_rad, "the same, attitude [rad]")
            ->capture_default_str();
        app.add_option("--relinearize-skip", options.solver.relinearize_skip, "updates between checks of the two")
            ->capture_default_str();
      },
      [&](const runtime::Application&) {
        if (options.input.empty()) throw runtime::UserError("give a g2o file; --help shows all options");
        return optimise(options);
      });
}
