// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "messages/lcm_log.h"

namespace ignis {

/// What stands on the channels of a log, known or not, for messages to people.
class LogListing {
 public:
  void add(const messages::LogEvent& event);

  /// One line a channel: count, and the type's name or fingerprint.
  [[nodiscard]] std::string text() const;

 private:
  struct Channel {
    std::int64_t messages = 0;
    std::uint64_t fingerprint = 0;  ///< of the newest message
  };
  std::map<std::string, Channel> channels_;
};

}  // namespace ignis
