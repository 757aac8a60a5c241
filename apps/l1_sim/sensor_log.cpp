// SPDX-License-Identifier: Apache-2.0
#include "sensor_log.h"

#include <algorithm>
#include <format>

#include "messages/odometry_messages.h"
#include "runtime/application.h"
#include "runtime/channels.h"

namespace ignis {

namespace channels = runtime::channels;

SensorLog::SensorLog(const std::filesystem::path& path) : output_(path), log_(output_.temporary_path().string(), "w") {
  if (!log_.good()) throw runtime::UserError(std::format("cannot write {}", path.string()), runtime::kFailed);
}

void SensorLog::add(const ImuSample& sample, float temperature) {
  write(channels::kImu, sample.utime, messages::to_message(sample, temperature));
}

void SensorLog::add(const Scan& scan) {
  for (const scan_t& part : messages::to_messages(scan)) write(channels::kScan, scan.end_utime(), part);
}

void SensorLog::add_truth(Utime utime, const sim::Motion& motion) {
  pose_t message = messages::ground_truth_message(utime, motion.T_world_body, motion.v_world);
  message.sequence = truth_sequence_++;
  write(channels::kGroundTruth, utime, message);
}

void SensorLog::commit() {
  if (std::fflush(log_.getFilePtr()) != 0) failed_ = true;
  if (failed_) throw runtime::UserError("cannot write the log: is the disk full?", runtime::kFailed);
  output_.commit();
}

template <class Message>
void SensorLog::write(const std::string& channel, Utime complete, const Message& message) {
  newest_ = std::max(newest_, complete);
  buffer_.resize(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
  lcm::LogEvent record{.eventnum = 0,  // LCM numbers its records itself
                       .timestamp = newest_,
                       .channel = channel,
                       .datalen = static_cast<std::int32_t>(buffer_.size()),
                       .data = buffer_.data()};
  failed_ |= log_.writeEvent(&record) != 0;
}

}  // namespace ignis
