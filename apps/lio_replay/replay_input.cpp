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

constexpr Utime kEarliest = std::numeric_limits<Utime>::min();

/// Gives back the pages of a log after every so many bytes read.
class PageRelease {
 public:
  explicit PageRelease(const messages::LcmLog& log) : log_(log) {}

  void read(std::size_t bytes) {
    constexpr std::size_t kStep = std::size_t{64} << 20;
    read_ += bytes;
    if (read_ < kStep) return;
    read_ = 0;
    log_.release_memory();
  }

 private:
  const messages::LcmLog& log_;
  std::size_t read_ = 0;
};

}  // namespace

ReplayInput::ReplayInput(const std::filesystem::path& file) : log_(file) {
  PageRelease pages(log_);
  while (const std::optional<messages::LogEvent> event = log_.next()) {
    index(*event);
    pages.read(event->data.size());
  }
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
  throw std::runtime_error(std::format("{}: holds no usable message on {}, so there is nothing to replay.\nIt holds:{}",
                                       file.string(), channel, listing_.text()));
}

void ReplayInput::index(const messages::LogEvent& event) {
  listing_.add(event);
  if (event.channel == channels::kImu) {
    index_imu(event);
  } else if (event.channel == channels::kScan) {
    index_scan(event);
  } else if (event.channel == channels::kLioCommand) {
    index_command(event);
  } else if (event.channel == channels::kGroundTruth) {
    index_ground_truth(event);
  } else {
    live_results_.add(event);
    if (event.channel == channels::kHealth) index_health(event);
    ++inventory_.ignored[std::string(event.channel)];
  }
}

void ReplayInput::index_imu(const messages::LogEvent& event) {
  imu_t imu;
  if (!messages::decode_checked(event.data, imu)) {
    ++inventory_.undecodable;
    return;
  }
  ++inventory_.used[channels::kImu];
  if (!newest_imu_ || (imu.utime > *newest_imu_ && !imu_leaps_.leaps_ahead(*newest_imu_, imu.utime))) {
    newest_imu_ = imu.utime;
  }
  entries_.push_back({.utime = imu.utime, .sequence = imu.sequence, .kind = Kind::kImu, .data = event.data});
}

void ReplayInput::index_scan(const messages::LogEvent& event) {
  const std::optional<messages::ScanHead> head = messages::read_scan_head(event.data);
  if (!head) {
    ++inventory_.undecodable;
    return;
  }
  ++inventory_.used[channels::kScan];
  entries_.push_back({head->utime, head->sequence, head->part, head->part_count, Kind::kScan, event.data});
}

/// Its stamp is when it is due; it was heard behind the newest sample that was recorded until then.
void ReplayInput::index_command(const messages::LogEvent& event) {
  lio_command_t command;
  if (!messages::decode_checked(event.data, command)) {
    ++inventory_.undecodable;
    return;
  }
  ++inventory_.used[channels::kLioCommand];
  if (newest_imu_) entries_.push_back({.utime = *newest_imu_, .kind = Kind::kCommand, .data = event.data});
}

void ReplayInput::index_health(const messages::LogEvent& event) {
  health_t health;
  // Another version of HEALTH says nothing about the measurements: no damage.
  if (inventory_.first_drop || !messages::decode_checked(event.data, health) || health.process != "lio_frontend")
    return;
  const std::string loss = loss_in(health);
  if (!loss.empty()) inventory_.first_drop = RecordedDrop{newest_health_.value_or(health.utime), loss};
  newest_health_ = health.utime;
}

void ReplayInput::sort_entries() {
  Utime newest[] = {kEarliest, kEarliest, kEarliest};
  for (const Entry& entry : entries_) {
    Utime& before = newest[static_cast<std::size_t>(entry.kind)];
    if (entry.utime < before) ++inventory_.out_of_order;
    before = std::max(before, entry.utime);
  }
  // At equal stamps the IMU goes first; parts of one scan share their stamp and keep their order.
  std::ranges::stable_sort(entries_, [](const Entry& a, const Entry& b) {
    return a.utime != b.utime ? a.utime < b.utime : a.kind < b.kind;
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
  messages::PartAssembler<Entry> assembler;
  std::optional<RecordedDrop> gap;
  // Per channel, of the message ahead: what is missing comes behind it.
  Utime last_imu = entries_.front().utime;
  Utime last_scan = entries_.front().utime;
  const auto missed = [&](Utime last, std::int64_t count, const char* what) {
    if (count > 0) gap = earlier(gap, RecordedDrop{last, std::format("{} {} missing in the log", count, what)});
    return count;
  };
  for (const Entry& entry : entries_) {
    if (entry.kind == Kind::kScan) {
      inventory_.missing_scans += missed(last_scan, scan_sequence.observe(entry.sequence, entry.utime), "of L1_SCAN");
      const std::int64_t incomplete = assembler.incomplete();
      (void)assembler.add(entry);
      missed(last_scan, assembler.incomplete() - incomplete, "of L1_SCAN with a part");
      last_scan = entry.utime;
    } else if (entry.kind == Kind::kImu) {
      inventory_.missing_imu += missed(last_imu, imu_sequence.observe(entry.sequence, entry.utime), "of L1_IMU");
      last_imu = entry.utime;
    }
  }
  inventory_.incomplete_scans = assembler.incomplete();
  inventory_.first_drop = earlier(inventory_.first_drop, gap);
}

void ReplayInput::run(const Handlers& handlers) const {
  messages::EncodedScanAssembler assembler;
  PageRelease pages(log_);
  for (const Entry& entry : entries_) {
    if (!handlers.proceed(entry.utime)) return;
    pages.read(entry.data.size());
    imu_t imu;
    lio_command_t command;
    if (entry.kind == Kind::kScan) {
      if (const auto scan = assembler.add(entry.data)) handlers.on_scan(scan->read());
    } else if (entry.kind == Kind::kCommand && messages::decode_checked(entry.data, command)) {
      handlers.on_command(command);
    } else if (messages::decode_checked(entry.data, imu)) {
      handlers.on_imu(messages::from_message(imu));
    }
  }
}

}  // namespace ignis
