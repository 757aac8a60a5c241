// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "backend/smoother.h"
#include "messages/graph_messages.h"

/// What the graph publishes of itself, the same from the live back end and from a replay.
namespace ignis::messages {

/// What an update changed. `smoother` is the one that made it, `utime` [us] the stamp of its newest keyframe.
[[nodiscard]] GraphRevision revision_of(const Smoother& smoother, const SmootherUpdate& update, std::int32_t session,
                                        Utime utime);

/// Makes it a full one: lists every keyframe of the graph.
void list_all(GraphRevision& revision, const Smoother& smoother);

}  // namespace ignis::messages
