// SPDX-License-Identifier: Apache-2.0
#include "recorded_results.h"

#include <string_view>
#include <utility>

#include "messages/length_check.h"
#include "runtime/channels.h"

namespace ignis {

namespace channels = runtime::channels;

void RecordedResults::add(const messages::LogEvent& event) {
  const std::pair<std::string_view, Messages*> kept[] = {{channels::kScanStats, &scan_stats},
                                                         {channels::kKeyframe, &keyframes},
                                                         {channels::kState, &states},
                                                         {channels::kSmoothedKeyframes, &revisions},
                                                         {channels::kSmoothedState, &smoothed_states},
                                                         {channels::kLoopResult, &loops}};
  for (const auto& [channel, list] : kept) {
    if (event.channel == channel) list->push_back(event.data);
  }
  scan_stats_t stats;
  if (!first_session && event.channel == channels::kScanStats && messages::decode_checked(event.data, stats)) {
    first_session = stats.session;
  }
  graph_command_t command;
  if (!first_command && event.channel == channels::kGraphCommand && messages::decode_checked(event.data, command) &&
      command.command != graph_command_t::SEND_FULL_SET) {
    first_command = event.log_utime;
  }
}

}  // namespace ignis
