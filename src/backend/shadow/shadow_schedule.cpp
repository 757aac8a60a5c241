// SPDX-License-Identifier: Apache-2.0
#include "backend/shadow/shadow_schedule.h"

#include <algorithm>

namespace ignis {
namespace {

bool is_in_or_out(const LoopResult& loop) { return loop.accepted() || loop.reason == LoopReason::kWithdrawn; }

}  // namespace

int shadow_delay(int estimated) { return 1 + estimated / 50; }

void ShadowSchedule::note(const SmootherUpdate& update) {
  loops_changed_ |= (update.loop && is_in_or_out(*update.loop)) || std::ranges::any_of(update.changed, is_in_or_out);
}

void ShadowSchedule::begin(const SmootherStats& graph) {
  loops_changed_ = false;
  due_at_ = graph.keyframes + shadow_delay(graph.keyframes - graph.retired);
}

}  // namespace ignis
