// SPDX-License-Identifier: Apache-2.0
#include "map_builder/loop_table.h"

#include <algorithm>

#include <nlohmann/json.hpp>

namespace ignis {
namespace {

using Json = nlohmann::ordered_json;

Json loop_json(const loop_result_t& loop) {
  return {{"from", loop.from_id},
          {"to", loop.to_id},
          {"stage", stage_name(loop.stage)},
          {"reason", loop.reason_text},
          {"residual_m", loop.mean_residual},
          {"matched", loop.matched_fraction},
          {"overlap", loop.overlap},
          {"correction_m", loop.correction_m},
          {"chi_square", loop.chi_square},
          {"chi_square_bound", loop.chi_square_bound}};
}

}  // namespace

bool is_in_graph(std::int8_t stage) {
  return stage == loop_result_t::STAGE_ON_TRIAL || stage == loop_result_t::STAGE_KEPT;
}

const char* stage_name(std::int8_t stage) {
  switch (stage) {
    case loop_result_t::STAGE_VERIFIED:
      return "verified";
    case loop_result_t::STAGE_ON_TRIAL:
      return "on_trial";
    case loop_result_t::STAGE_KEPT:
      return "kept";
    case loop_result_t::STAGE_WITHDRAWN:
      return "withdrawn";
    default:
      return "candidate";
  }
}

bool LoopTable::record(const loop_result_t& result) {
  if (result.stage == loop_result_t::STAGE_NO_LOOP || result.from_id < 0 || result.to_id < 0) return false;
  const auto [found, is_new] = loops_.try_emplace({result.from_id, result.to_id});
  if (is_new) found->second.order = next_order_++;
  found->second.newest = result;
  drop_oldest_outside();
  return true;
}

void LoopTable::drop_oldest_outside() {
  const auto outside = [](const auto& entry) { return !is_in_graph(entry.second.newest.stage); };
  if (static_cast<std::size_t>(std::ranges::count_if(loops_, outside)) <= kMaxOutside) return;
  auto oldest = loops_.end();
  for (auto entry = loops_.begin(); entry != loops_.end(); ++entry) {
    if (outside(*entry) && (oldest == loops_.end() || entry->second.order < oldest->second.order)) oldest = entry;
  }
  loops_.erase(oldest);
}

std::string LoopTable::text() const {
  std::vector<const Loop*> ordered;
  for (const auto& [ids, loop] : loops_) ordered.push_back(&loop);
  std::ranges::sort(ordered, {}, &Loop::order);
  Json list = Json::array();
  for (const Loop* loop : ordered) list.push_back(loop_json(loop->newest));
  // Reasons come from the bus and may hold anything; broken UTF-8 is replaced, since browsers close the socket on it.
  return Json{{"type", "loops"}, {"list", std::move(list)}}.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace ignis
