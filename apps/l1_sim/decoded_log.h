// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <lcm/lcm-cpp.hpp>

#include "common/file_output.h"
#include "drivers/l1_decoder.h"
#include "runtime/application.h"
#include "stream_file.h"

namespace ignis {

/// An LCM log with L1_IMU and L1_SCAN as the driver decodes the bytes, and GROUND_TRUTH: what lio_replay reads. Stamps
/// come from the sensor's counters, as for a capture. The same stream gives the same file, byte for byte: records carry
/// the instant of their content, not that of the writing.
class DecodedLog final : public StreamFile {
 public:
  DecodedLog(const std::filesystem::path& path, const runtime::Application& application);

  void add(const sim::Delivery& delivery) override;
  void add_truth(Utime utime, const sim::Motion& motion) override;
  /// Throws runtime::UserError when a record could not be written.
  void commit() override;

 private:
  void write(const std::vector<l1::Event>& events);
  template <class Message>
  void write(const std::string& channel, Utime complete, const Message& message);

  DriverConfig driver_;
  l1::L1Decoder decoder_;
  FileOutput output_;
  lcm::LogFile log_;
  Utime newest_ = 0;
  std::int32_t truth_sequence_ = 0;
  bool failed_ = false;
  std::vector<char> buffer_;
};

}  // namespace ignis
