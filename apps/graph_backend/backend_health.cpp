// SPDX-License-Identifier: Apache-2.0
#include "backend_health.h"

#include <format>

#include "ignis/health_t.hpp"

namespace ignis {
namespace {

/// What is no fault, and still worth a look.
std::string remark_on(const SmootherStats& graph) {
  std::string remark = "OK";
  if (graph.keyframes == 0) remark += ": no keyframe yet";
  if (graph.shadow_checks > 0) {
    remark += std::format(": {:.1f} mm and {:.2f} mrad from the batch optimum at most; swapped {} times",
                          1e3 * graph.shadow_gap_m, 1e3 * graph.shadow_gap_rad, graph.shadow_swaps);
  }
  if (graph.retired > 0) {
    remark += std::format("; the oldest {} of {} keyframes have retired", graph.retired, graph.keyframes);
  }
  if (graph.absorbed > 0) remark += std::format(", others stand for {} of them", graph.absorbed);
  return remark;
}

}  // namespace

BackendHealth health_of(const BackendSituation& situation) {
  const SmootherStats& graph = situation.graph;
  if (!graph.solver_failure.empty()) {
    return {health_t::FAULT,
            std::format("the graph takes no more keyframes: {}; a restart or a new session begins a new graph",
                        graph.solver_failure)};
  }
  if (!situation.journal_failure.empty()) return {health_t::FAULT, situation.journal_failure};
  if (!situation.refusal.empty()) return {health_t::DEGRADED, situation.refusal};
  if (situation.waiting_for) {
    return {health_t::DEGRADED, std::format("waiting for keyframe {}", *situation.waiting_for)};
  }
  if (situation.gave_up_lately) {
    return {health_t::DEGRADED,
            std::format("{} keyframes are given up; the graph has holes there", situation.keyframes_given_up)};
  }
  if (graph.clouds_unreadable > 0) {
    const bool lately = situation.missed_a_cloud_lately;
    return {lately ? health_t::DEGRADED : health_t::OK,
            std::format("{}{} times the journal did not give a cloud back, and a loop was refused for it",
                        lately ? "" : "OK: ", graph.clouds_unreadable)};
  }
  if (graph.clouds_forgotten > 0) {
    return {
        health_t::OK,
        std::format("OK: without a journal {} clouds beyond backend.cloud_memory_mb were dropped; no loop ends there",
                    graph.clouds_forgotten)};
  }
  return {health_t::OK, remark_on(graph)};
}

}  // namespace ignis
