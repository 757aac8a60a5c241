// SPDX-License-Identifier: Apache-2.0
#include "replay_input.h"

#include <algorithm>
#include <format>
#include <limits>
#include <stdexcept>

#include "messages/field_copy.h"
#include "messages/length_check.h"
#include "messages/sensor_messages.h"
#include "runtime/channels.h"
#include "runtime/sequence_tracker.h"

namespace ignis {
namespace {

namespace channels = runtime::channels;

}  // namespace

ReplayInput::ReplayInput(const std::filesystem::path& file) : log_(file) {
  while (const std::optional<messages::LogEvent> event = log_.next()) index(*event);
  inventory_.damaged_bytes = log_.damaged_bytes();
  require(file, channels::kImu);
  require(file, channels::kScan);
  sort_entries();
  std::ranges::stable_sort(ground_truth_, {}, &StampedPose::utime);
  inventory_.first_utime = entries_.front().utime;
  inventory_.last_utime = entries_.back().utime;
  count_missing();
}

void ReplayInput::require(const std::filesystem::path& file, const char* channel) const {
  if (inventory_.used.contains(channel)) return;
  throw std::runtime_error(std::format("{}: holds no usable message on {}, so there is nothing to replay. It holds:{}",
                                       file.string(), channel, listing_.text()));
}

void ReplayInput::index(const messages::LogEvent& event) {
  listing_.add(event);
  if (event.channel == channels::kImu || event.channel == channels::kScan) {
    index_measurement(event, event.channel == channels::kScan);
  } else if (event.channel == channels::kGroundTruth) {
    index_ground_truth(event);
  } else {
    if (event.channel == channels::kScanStats) live_scan_stats_.push_back(event.data);
    if (event.channel == channels::kHealth) index_health(event);
    ++inventory_.ignored[std::string(event.channel)];
  }
}

void ReplayInput::index_measurement(const messages::LogEvent& event, bool is_scan) {
  imu_t imu;
  scan_t scan;
  const bool decoded = is_scan ? messages::decode_checked(event.data, scan) : messages::decode_checked(event.data, imu);
  if (!decoded) {
    ++inventory_.undecodable;
    return;
  }
  ++inventory_.used[std::string(event.channel)];
  entries_.push_back({is_scan ? scan.utime : imu.utime, is_scan, event.data});
}

void ReplayInput::index_health(const messages::LogEvent& event) {
  health_t health;
  // Another version of HEALTH says nothing about the measurements: no damage.
  if (!inventory_.first_drop && messages::decode_checked(event.data, health)) inventory_.first_drop = drop_of(health);
}

void ReplayInput::sort_entries() {
  Utime newest[2] = {std::numeric_limits<Utime>::min(), std::numeric_limits<Utime>::min()};
  for (const Entry& entry : entries_) {
    Utime& before = newest[entry.is_scan ? 1 : 0];
    if (entry.utime < before) ++inventory_.out_of_order;
    before = std::max(before, entry.utime);
  }
  // At equal stamps the IMU goes first; parts of one scan share their stamp and keep their order.
  std::ranges::stable_sort(entries_, [](const Entry& a, const Entry& b) {
    return a.utime != b.utime ? a.utime < b.utime : a.is_scan < b.is_scan;
  });
}

void ReplayInput::index_ground_truth(const messages::LogEvent& event) {
  pose_t message;
  if (!messages::decode_checked(event.data, message)) {
    ++inventory_.undecodable;
    return;
  }
  ++inventory_.used[channels::kGroundTruth];
  ground_truth_.push_back({message.utime, {messages::load(message.quaternion), messages::load(message.position)}});
}

void ReplayInput::count_missing() {
  runtime::SequenceTracker imu_sequence;
  runtime::SequenceTracker scan_sequence;
  messages::ScanAssembler assembler;
  std::optional<RecordedDrop> gap;
  const auto missed = [&](Utime utime, std::int64_t count, const char* what) {
    if (count > 0 && !gap) gap = RecordedDrop{utime, std::format("{} {} missing in the log", count, what)};
    return count;
  };
  for (const Entry& entry : entries_) {
    imu_t imu;
    scan_t scan;
    if (entry.is_scan && messages::decode_checked(entry.data, scan)) {
      inventory_.missing_scans += missed(entry.utime, scan_sequence.observe(scan.sequence), "of L1_SCAN");
      const std::int64_t incomplete = assembler.incomplete();
      (void)assembler.add(scan);
      missed(entry.utime, assembler.incomplete() - incomplete, "of L1_SCAN with a part");
    } else if (!entry.is_scan && messages::decode_checked(entry.data, imu)) {
      inventory_.missing_imu += missed(entry.utime, imu_sequence.observe(imu.sequence), "of L1_IMU");
    }
  }
  inventory_.incomplete_scans = assembler.incomplete();
  inventory_.first_drop = earlier(inventory_.first_drop, gap);
}

void ReplayInput::run(const std::function<void(const ImuSample&)>& on_imu,
                      const std::function<void(const Scan&)>& on_scan,
                      const std::function<bool(Utime)>& proceed) const {
  messages::ScanAssembler assembler;
  for (const Entry& entry : entries_) {
    if (!proceed(entry.utime)) return;
    imu_t imu;
    scan_t part;
    if (!entry.is_scan && messages::decode_checked(entry.data, imu)) {
      on_imu(messages::from_message(imu));
    } else if (entry.is_scan && messages::decode_checked(entry.data, part)) {
      if (const std::optional<Scan> scan = assembler.add(part)) on_scan(*scan);
    }
  }
}

}  // namespace ignis
