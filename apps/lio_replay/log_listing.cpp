// SPDX-License-Identifier: Apache-2.0
#include "log_listing.h"

#include <format>

#include "messages/type_name.h"

namespace ignis {
void LogListing::add(const messages::LogEvent& event) {
  Channel& channel = channels_[std::string(event.channel)];
  ++channel.messages;
  channel.fingerprint = messages::fingerprint_of(event.data);
}

std::string LogListing::text() const {
  std::string text;
  for (const auto& [name, channel] : channels_) {
    text +=
        std::format("\n  {:24} {:8} messages, {}", name, channel.messages, messages::type_name(channel.fingerprint));
  }
  return text;
}

}  // namespace ignis
