// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/leap_guard.h"
#include "common/measurements.h"
#include "common/trajectory_file.h"
#include "ignis/lio_command_t.hpp"
#include "log_listing.h"
#include "messages/lcm_log.h"
#include "recorded_drop.h"
#include "recorded_results.h"

namespace ignis {

/// What a log holds and what was lost of it.
struct LogInventory {
  std::map<std::string, std::int64_t> used;     ///< messages per channel that the replay reads
  std::map<std::string, std::int64_t> ignored;  ///< messages per channel that it does not read
  std::int64_t undecodable = 0;                 ///< on known channels: another type, or a damaged body
  std::int64_t incomplete_scans = 0;            ///< scans of which a part is missing
  std::int64_t missing_imu = 0;                 ///< by the running number
  std::int64_t missing_scans = 0;               ///< by the running number
  std::int64_t damaged_bytes = 0;               ///< of the file, in no whole record
  std::int64_t out_of_order = 0;                ///< measurements that stand behind a later one of their channel
  std::optional<RecordedDrop> first_drop;       ///< up to here a replay must equal the live run
  Utime first_utime = 0;                        ///< [us] of the first measurement
  Utime last_utime = 0;

  [[nodiscard]] bool damaged() const { return undecodable > 0 || damaged_bytes > 0 || incomplete_scans > 0; }
  /// Some of what the sensors gave is not in the log.
  [[nodiscard]] bool incomplete() const { return damaged() || missing_imu > 0 || missing_scans > 0; }
};

/// The measurements of a log, in the order of their own stamps per channel: under load LCM records out of order. The
/// log stays on disk: it is mapped, what is kept of a message is its head and place, and memory of pages that were read
/// is given back as the reading goes on.
class ReplayInput {
 public:
  /// Indexes the log. Throws std::runtime_error when it is no log or holds no IMU or no scans.
  explicit ReplayInput(const std::filesystem::path& file);

  [[nodiscard]] const LogInventory& inventory() const { return inventory_; }
  [[nodiscard]] const Trajectory& ground_truth() const { return ground_truth_; }

  /// Of the live run whose log this is; empty in a log of sensor data alone.
  [[nodiscard]] const RecordedResults& live_results() const { return live_results_; }

  struct Handlers {
    std::function<void(const ImuSample&)> on_imu;
    std::function<void(Scan)> on_scan;
    std::function<void(const lio_command_t&)> on_command;  ///< to the front end, at the instant it was recorded
    std::function<bool(Utime)> proceed;                    ///< asked before each of them [us]; false: stop here
  };

  /// Calls the handlers with every measurement and command, in time order.
  void run(const Handlers& handlers) const;

 private:
  /// In the order of their turns at equal stamps: a command is about what is behind it, and a scan needs the samples up
  /// to its end.
  enum class Kind : std::uint8_t { kImu, kCommand, kScan };
  struct Entry {
    Utime utime = 0;
    std::int32_t sequence = 0;
    std::int16_t part = 0;
    std::int16_t part_count = 1;
    Kind kind = Kind::kImu;
    std::span<const std::byte> data;
  };

  void index(const messages::LogEvent& event);
  void index_imu(const messages::LogEvent& event);
  void index_scan(const messages::LogEvent& event);
  void index_command(const messages::LogEvent& event);
  void index_ground_truth(const messages::LogEvent& event);
  void index_health(const messages::LogEvent& event);
  void require(const std::filesystem::path& file, const char* channel) const;
  void sort_entries();
  void count_missing();

  messages::LcmLog log_;
  LogListing listing_;
  LogInventory inventory_;
  std::vector<Entry> entries_;
  RecordedResults live_results_;
  std::optional<Utime> newest_imu_;  // [us] of those that were indexed, as the front end believes it
  LeapGuard imu_leaps_;
  std::optional<Utime> newest_health_;  // [us] of the live front end, while it had lost nothing
  Trajectory ground_truth_;
};

}  // namespace ignis
