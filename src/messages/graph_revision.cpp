// SPDX-License-Identifier: Apache-2.0
#include "messages/graph_revision.h"

namespace ignis::messages {

GraphRevision revision_of(const Smoother& smoother, const SmootherUpdate& update, std::int32_t session, Utime utime) {
  return {.utime = utime,
          .session = session,
          .revision = smoother.revision(),
          .full = false,
          .keyframes = smoother.stats().keyframes,
          .newest_id = smoother.expected_id() - 1,
          .T_map_odom = smoother.T_map_odom(),
          .covariance = update.covariance,
          .poses = update.moved};
}

void list_all(GraphRevision& revision, const Smoother& smoother) {
  revision.full = true;
  revision.poses = smoother.all_poses();
}

}  // namespace ignis::messages
