// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ignis/health_t.hpp"

namespace ignis {

/// What every process of the pipeline says of itself on HEALTH, and since when it has been silent.
class ProcessTable {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  struct Row {
    std::string process;
    std::string state;   ///< ok, degraded, lost, fault, or silent
    std::string reason;  ///< in the process's own words
  };

  /// A process's state has become another one.
  struct Change {
    std::string process;
    std::string before;  ///< empty when the process is new
    std::string now;
    std::string reason;
  };

  /// Takes a message; tells what has changed.
  std::optional<Change> record(const health_t& message, TimePoint now);

  /// Processes that have just become silent: no word for kSilence.
  std::vector<Change> silent_since(TimePoint now);

  [[nodiscard]] std::vector<Row> rows() const;

 private:
  static constexpr std::chrono::seconds kSilence{4};  // HEALTH comes once a second
  struct Entry {
    std::string state;
    std::string reason;
    TimePoint heard;
  };
  std::map<std::string, Entry> entries_;
};

}  // namespace ignis
