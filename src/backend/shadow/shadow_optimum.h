// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>

/// The batch optimum of the smoother's graph, computed beside it: how far is the incremental solution from it?
namespace ignis {

/// A copy of the graph and its estimate that nothing changes any more. May be solved on any thread, more than once.
struct ShadowProblem {
  struct Graph;
  std::shared_ptr<const Graph> graph;
};

/// Where batch Levenberg-Marquardt ends that begins at the incremental solution.
struct ShadowOptimum {
  struct Solution;
  std::shared_ptr<const Solution> solution;
  std::int32_t revision = 0;  ///< of the graph that was copied
  int keyframes = 0;
  double largest_gap_m = 0.0;  ///< over all that are estimated, between the copied estimate and the optimum
  double largest_gap_rad = 0.0;
  double half_chi_square_before = 0.0;  ///< of the copied estimate
  double half_chi_square = 0.0;         ///< of the optimum
  bool solved = false;  ///< false: stopped, or the solver threw, or what it found is not finite or no better
};

/// Pure: no state is shared with the smoother. Seconds for thousands of keyframes; asked to stop it ends with the
/// iteration under way. `got_on` is called after each one, on the thread that solves.
[[nodiscard]] ShadowOptimum solve(const ShadowProblem& problem, const std::stop_token& stop = {},
                                  const std::function<void()>& got_on = {});

}  // namespace ignis
