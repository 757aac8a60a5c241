// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "driver_publisher.h"
#include "drivers/byte_link.h"
#include "raw_recording.h"
#include "runtime/steady_time.h"

namespace ignis::runtime {

/// The sensor on its link: reads, publishes, answers, and opens the link again when it was lost.
class LiveDriver {
 public:
  /// `recording`: file for the raw bytes; empty: none. Throws UserError when that cannot be made, and
  /// l1::LinkError when the link cannot be opened and no supervisor looks at what this process tells.
  LiveDriver(const Application& application, const std::string& recording);

  /// Until a stop is asked for.
  [[nodiscard]] ExitCode run();

 private:
  void step();
  void close(const std::string& reason);
  void exchange();
  void reopen();
  void ask_for_version();
  void report();

  DriverConfig driver_;
  l1::L1Decoder decoder_;
  LcmLink bus_;
  DriverPublisher publisher_;
  HostClock host_clock_;
  std::optional<RawRecording> recording_;
  std::unique_ptr<l1::ByteLink> link_;
  std::string closed_because_;  // newest reason; empty while the link is open
  std::array<std::byte, 4096> buffer_{};
  Utime last_request_ = 0;
  Utime last_flush_ = 0;
};

}  // namespace ignis::runtime
