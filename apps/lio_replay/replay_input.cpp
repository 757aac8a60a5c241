// SPDX-License-Identifier: Apache-2.0
#include "replay_input.h"

#include <algorithm>
#include <format>
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
  const auto require = [&](const char* channel) {
    if (inventory_.used.contains(channel)) return;
    std::string found;
    for (const auto& [name, count] : inventory_.ignored) found += std::format(" {} ({})", name, count);
    throw std::runtime_error(std::format("{}: holds no usable message on {}; its other channels are:{}", file.string(),
                                         channel, found.empty() ? " none" : found));
  };
  require(channels::kImu);
  require(channels::kScan);
  // At equal stamps the IMU goes first; parts of one scan share their stamp and keep their order.
  std::ranges::stable_sort(entries_, [](const Entry& a, const Entry& b) {
    return a.utime != b.utime ? a.utime < b.utime : a.is_scan < b.is_scan;
  });
  std::ranges::stable_sort(ground_truth_, {}, &StampedPose::utime);
  inventory_.first_utime = entries_.front().utime;
  inventory_.last_utime = entries_.back().utime;
  count_missing();
}

void ReplayInput::index(const messages::LogEvent& event) {
  const std::string channel(event.channel);
  const bool is_scan = channel == channels::kScan;
  if (channel == channels::kGroundTruth) return index_ground_truth(event);
  if (!is_scan && channel != channels::kImu) {
    ++inventory_.ignored[channel];
    return;
  }
  imu_t imu;
  scan_t scan;
  const bool decoded = is_scan ? messages::decode_checked(event.data, scan) : messages::decode_checked(event.data, imu);
  if (!decoded) {
    ++inventory_.undecodable;
    return;
  }
  ++inventory_.used[channel];
  entries_.push_back({is_scan ? scan.utime : imu.utime, is_scan, event.data});
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
  for (const Entry& entry : entries_) {
    imu_t imu;
    scan_t scan;
    if (entry.is_scan && messages::decode_checked(entry.data, scan)) {
      inventory_.missing_scans += scan_sequence.observe(scan.sequence);
      (void)assembler.add(scan);
    } else if (!entry.is_scan && messages::decode_checked(entry.data, imu)) {
      inventory_.missing_imu += imu_sequence.observe(imu.sequence);
    }
  }
  inventory_.incomplete_scans = assembler.incomplete();
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
