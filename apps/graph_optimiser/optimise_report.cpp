// SPDX-License-Identifier: Apache-2.0
#include "optimise_report.h"

#include <algorithm>
#include <cmath>
#include <format>
#include <iostream>
#include <numeric>

#include "backend/pose_graph/pose_graph_cost.h"

namespace ignis {
namespace {

constexpr double kShowEvery_s = 5.0;

}  // namespace

void SolveProgress::show(const std::string& text) {
  const double now = since_start_.seconds();
  if (now - shown_s_ < kShowEvery_s) return;
  shown_s_ = now;
  std::cerr << std::format("graph_optimiser: {}, {:.0f} s\n", text, now);
}

double UpdateTimes::total() const { return std::accumulate(seconds.begin(), seconds.end(), 0.0); }

double UpdateTimes::quantile(double share) const {
  if (seconds.empty()) return 0.0;
  std::vector<double> sorted = seconds;
  std::ranges::sort(sorted);
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::clamp<std::size_t>(rank, 1, sorted.size()) - 1];
}

std::string cost_line(const std::string& name, const PoseGraph& graph, const PoseGraphSolution& solution,
                      const std::string& effort) {
  const std::optional<double> measure = se_sync_cost(graph, solution.poses);
  return std::format("{:<14}{:>18.9g}  {:>18}  {}\n", name, solution.half_chi_square,
                     measure ? std::format("{:.9g}", *measure) : "not defined", effort);
}

std::string cost_head() { return std::format("{:<14}{:>18}  {:>18}\n", "", "half chi-square", "SE-Sync measure"); }

}  // namespace ignis
