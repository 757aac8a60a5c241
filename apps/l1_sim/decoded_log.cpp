// SPDX-License-Identifier: Apache-2.0
#include "decoded_log.h"

#include <algorithm>
#include <cmath>
#include <format>

#include "messages/odometry_messages.h"
#include "messages/sensor_messages.h"
#include "runtime/channels.h"

namespace ignis {
namespace {

namespace channels = runtime::channels;

DriverConfig by_counters(DriverConfig driver) {
  driver.time_source = "counters";
  return driver;
}

}  // namespace

DecodedLog::DecodedLog(const std::filesystem::path& path, const runtime::Application& application)
    : driver_(by_counters(application.config.driver)),
      decoder_(driver_, application.config.extrinsics),
      output_(path),
      log_(output_.temporary_path().string(), "w") {
  if (!log_.good()) throw runtime::UserError(std::format("cannot write {}", path.string()), runtime::kFailed);
}

void DecodedLog::add(const sim::Delivery& delivery) { write(decoder_.feed(delivery.bytes, delivery.utime)); }

void DecodedLog::add_truth(Utime utime, const sim::Motion& motion) {
  const Utime stamp = utime + std::llround(driver_.start_time_s * 1e6);
  pose_t message = messages::ground_truth_message(stamp, motion.T_world_body, motion.v_world);
  message.sequence = truth_sequence_++;
  write(channels::kGroundTruth, stamp, message);
}

void DecodedLog::commit() {
  write(decoder_.finish());
  if (std::fflush(log_.getFilePtr()) != 0) failed_ = true;
  if (failed_) throw runtime::UserError("cannot write the log: is the disk full?", runtime::kFailed);
  output_.commit();
}

void DecodedLog::write(const std::vector<l1::Event>& events) {
  for (const l1::Event& event : events) {
    if (const auto* sample = std::get_if<ImuSample>(&event)) {
      const imu_t message = messages::to_message(*sample, decoder_.housekeeping().imu_temperature);
      write(channels::kImu, sample->utime, message);
      continue;
    }
    const Scan& scan = std::get<Scan>(event);
    for (const scan_t& part : messages::to_messages(scan)) write(channels::kScan, scan.end_utime(), part);
  }
}

template <class Message>
void DecodedLog::write(const std::string& channel, Utime complete, const Message& message) {
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
