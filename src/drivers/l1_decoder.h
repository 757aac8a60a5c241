// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <variant>

#include "drivers/body_mount.h"
#include "drivers/host_frames.h"
#include "drivers/packet_stream.h"
#include "drivers/scan_assembler.h"
#include "drivers/sensor_clock.h"

namespace ignis::l1 {

/// What leaves the driver: stamped, in the body frame, filtered.
using Event = std::variant<ImuSample, Scan>;

/// All counts since construction.
struct DecoderCounters : StreamCounters {
  std::int64_t imu_published = 0;
  std::int64_t scans_published = 0;
  std::int64_t points_published = 0;
  std::int64_t points_filtered = 0;  ///< by range or own structure
  std::int64_t clock_restarts = 0;   ///< the stamps' clock began anew: the counters did, or arrivals contradict them
};

/// Bytes of an L1 in, measurements out. No clock, no device: arrival instants come with the bytes, answers for the
/// sensor are handed to the caller. Not thread safe. Throws config::ConfigError at construction only.
class L1Decoder {
 public:
  L1Decoder(const DriverConfig& config, const Extrinsics& extrinsics);

  /// Decodes the bytes of one read that returned at `arrival` [us]. With time_source "counters" the first 200 ms of
  /// events come out late, and `arrival` only ages packets: a constant will do.
  [[nodiscard]] std::vector<Event> feed(std::span<const std::byte> bytes, Utime arrival);

  /// What is left at the end of the stream.
  [[nodiscard]] std::vector<Event> finish();

  /// Bytes to send to the sensor (answers to its time-sync requests); empties the store.
  [[nodiscard]] std::vector<std::byte> take_outgoing();

  /// A frame that asks the sensor for its version.
  [[nodiscard]] std::vector<std::byte> version_request() { return host_frames_.version_request(); }

  [[nodiscard]] DecoderCounters counters() const;
  [[nodiscard]] const Housekeeping& housekeeping() const { return stream_.housekeeping(); }
  [[nodiscard]] SensorHealth health() const { return stream_.health(); }
  [[nodiscard]] const SensorClock& clock() const { return clock_; }
  /// [us] stamp of the newest event; 0 before the first one.
  [[nodiscard]] Utime newest_utime() const { return newest_utime_; }

 private:
  struct ImuRecord {
    std::int64_t count;
    ImuSample sample;
  };
  struct PacketRecord {
    std::int64_t count;
    std::vector<BodyPoint> points;
  };
  using Record = std::variant<ImuRecord, PacketRecord>;

  [[nodiscard]] std::vector<Event> handle(const std::vector<Packet>& packets);
  void handle(const AuxiliarySeen& seen);
  void handle(const CountedPacket& packet);
  void handle(const CountedImu& imu);
  void handle(const TimeSync& message);
  void handle(const Version&) {}
  void handle(const CountersRestarted&) { clock_.restart(); }
  void publish_waiting(std::vector<Event>& events);
  void publish(const ImuRecord& record, std::vector<Event>& events);
  void publish(const PacketRecord& record, std::vector<Event>& events);
  void publish(Scan scan, std::vector<Event>& events);

  DriverConfig config_;
  BodyMount mount_;
  PacketStream stream_;
  SensorClock clock_;
  ScanAssembler assembler_;
  std::deque<Record> waiting_;  ///< until the clock is ready

  std::int32_t imu_sequence_ = 0;
  HostFrames host_frames_;
  std::vector<std::byte> outgoing_;
  DecoderCounters counters_;
  Utime newest_utime_ = 0;
};

}  // namespace ignis::l1
