// SPDX-License-Identifier: Apache-2.0
#include "decoded_log.h"

#include <cmath>

namespace ignis {
namespace {

DriverConfig by_counters(DriverConfig driver) {
  driver.time_source = "counters";
  return driver;
}

}  // namespace

DecodedLog::DecodedLog(const std::filesystem::path& path, const runtime::Application& application)
    : driver_(by_counters(application.config.driver)), decoder_(driver_, application.config.extrinsics), log_(path) {}

void DecodedLog::add(const sim::Delivery& delivery) { write(decoder_.feed(delivery.bytes, delivery.utime)); }

void DecodedLog::add_truth(Utime utime, const sim::Motion& motion) {
  log_.add_truth(utime + std::llround(driver_.start_time_s * 1e6), motion);
}

void DecodedLog::commit() {
  write(decoder_.finish());
  log_.commit();
}

void DecodedLog::write(const std::vector<l1::Event>& events) {
  for (const l1::Event& event : events) {
    if (const auto* sample = std::get_if<ImuSample>(&event)) {
      log_.add(*sample, decoder_.housekeeping().imu_temperature);
    } else {
      log_.add(std::get<Scan>(event));
    }
  }
}

}  // namespace ignis
