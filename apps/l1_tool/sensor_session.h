// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <memory>

#include "drivers/byte_link.h"
#include "drivers/host_frames.h"
#include "drivers/packet_stream.h"
#include "runtime/ignis_config.h"

namespace ignis {

/// A conversation with a live sensor: reads its packets, answers its time-sync requests, sends commands. Throws
/// runtime::UserError when the link cannot be opened or is lost.
class SensorSession {
 public:
  explicit SensorSession(const DriverConfig& config);

  /// The packets that came within at most 20 ms.
  [[nodiscard]] std::vector<l1::Packet> read();
  void write(const std::vector<std::byte>& frame);

  [[nodiscard]] l1::HostFrames& frames() { return frames_; }
  [[nodiscard]] const l1::PacketStream& stream() const { return stream_; }
  /// Says what the link has brought so far, for messages about a sensor that does not answer.
  [[nodiscard]] std::string what_came() const;

 private:
  DriverConfig config_;
  std::unique_ptr<l1::ByteLink> link_;
  l1::PacketStream stream_;
  l1::HostFrames frames_;
  std::array<std::byte, 4096> buffer_{};
};

}  // namespace ignis
