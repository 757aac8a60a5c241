// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <lcm/lcm-cpp.hpp>

#include "common/file_output.h"
#include "common/measurements.h"
#include "drivers/sim/trajectory.h"
#include "messages/sensor_messages.h"

namespace ignis {

/// An LCM log with L1_IMU, L1_SCAN and GROUND_TRUTH: what lio_replay reads. Records carry the instant of their content,
/// not that of the writing, and never go back in time, so the same measurements give the same bytes. The file appears
/// only with commit().
class SensorLog {
 public:
  explicit SensorLog(const std::filesystem::path& path);

  void add(const ImuSample& sample, float temperature = messages::kUnknownTemperature);
  void add(const Scan& scan);
  void add_truth(Utime utime, const sim::Motion& motion);
  /// Throws runtime::UserError when a record could not be written.
  void commit();

 private:
  template <class Message>
  void write(const std::string& channel, Utime complete, const Message& message);

  FileOutput output_;
  lcm::LogFile log_;
  Utime newest_ = 0;
  std::int32_t truth_sequence_ = 0;
  bool failed_ = false;
  std::vector<char> buffer_;
};

}  // namespace ignis
