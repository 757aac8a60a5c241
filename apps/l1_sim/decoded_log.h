// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "drivers/l1_decoder.h"
#include "runtime/application.h"
#include "sensor_log.h"
#include "stream_file.h"

namespace ignis {

/// The log of what the driver decodes from an L1's bytes. Stamps come from the sensor's counters, as for a capture. The
/// same stream gives the same file, byte for byte.
class DecodedLog final : public StreamFile {
 public:
  DecodedLog(const std::filesystem::path& path, const runtime::Application& application);

  void add(const sim::Delivery& delivery) override;
  void add_truth(Utime utime, const sim::Motion& motion) override;
  /// Throws runtime::UserError when a record could not be written.
  void commit() override;

 private:
  void write(const std::vector<l1::Event>& events);

  DriverConfig driver_;
  l1::L1Decoder decoder_;
  SensorLog log_;
};

}  // namespace ignis
