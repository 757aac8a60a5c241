// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <variant>

#include "drivers/counter_unwrapper.h"
#include "drivers/frame_parser.h"
#include "drivers/scan_assembler.h"
#include "drivers/sensor_clock.h"

namespace ignis::l1 {

/// What leaves the driver: stamped, in the body frame, filtered.
using Event = std::variant<ImuSample, Scan>;

/// All counts since construction.
struct DecoderCounters {
  FrameCounters framing;
  PairCounters pairing;
  std::int64_t unknown_messages = 0;  ///< valid frames of the dialect that we do not decode
  std::int64_t rejected_values = 0;   ///< valid frames with absurd content
  std::int64_t duplicates = 0;        ///< packets and samples seen twice, those of `pairing` included
  std::int64_t scan_gaps = 0;         ///< packet pairs missing by their counter
  std::int64_t imu_gaps = 0;          ///< inertial samples missing by their counter
  std::int64_t imu_published = 0;
  std::int64_t scans_published = 0;
  std::int64_t points_published = 0;
  std::int64_t points_filtered = 0;  ///< by range or own structure
};

/// Latest figures that the sensor tells about itself.
struct Housekeeping {
  float apd_temperature = -1000.0F;  ///< [deg C]; -1000 until known
  float imu_temperature = -1000.0F;  ///< [deg C]; -1000 until known
  float dirty_index = 0.0F;          ///< [%]
  std::uint8_t work_status = 0;
  std::string firmware;  ///< empty until the sensor answered
};

/// Signs of a sick sensor behind valid frames.
struct SensorHealth {
  int rejected_in_a_row = 0;   ///< frames with absurd content since the last good one
  std::string rejected_field;  ///< the field that was refused last
  int equal_imu_samples = 0;   ///< inertial samples in a row with identical values
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
  [[nodiscard]] std::vector<std::byte> version_request();

  [[nodiscard]] DecoderCounters counters() const;
  [[nodiscard]] const Housekeeping& housekeeping() const { return housekeeping_; }
  [[nodiscard]] const SensorHealth& health() const { return health_; }
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

  void handle(const Frame& frame);
  void handle(const Auxiliary& message, double sent_before);
  void handle(const Distance& message, double sent_before);
  void handle(const ImuAttitude& message, double sent_before);
  void handle(const TimeSync& message);
  [[nodiscard]] bool accept(std::string_view fault);
  void note_values(const ImuAttitude& message);
  [[nodiscard]] double elapsed_for_scan(double sent_before) const;
  [[nodiscard]] double elapsed_for_imu(double sent_before) const;
  void publish_waiting(std::vector<Event>& events);
  void publish(const ImuRecord& record, std::vector<Event>& events);
  void publish(const PacketRecord& record, std::vector<Event>& events);
  void publish(Scan scan, std::vector<Event>& events);

  DriverConfig config_;
  BodyMount mount_;
  FrameParser parser_;
  PacketPairer pairer_;
  SensorClock clock_;
  CounterUnwrapper scan_counter_;
  CounterUnwrapper imu_counter_;
  ScanAssembler assembler_;
  std::deque<Record> waiting_;  ///< until the clock is ready

  // Where the other stream stood when this one last moved: tells how much time a step of a counter may span.
  double last_scan_sent_ = 0.0;
  double last_imu_sent_ = 0.0;
  std::int64_t imu_count_at_scan_ = 0;
  std::int64_t scan_count_at_imu_ = 0;

  std::optional<std::int64_t> last_packet_count_;
  std::optional<ImuAttitude> last_imu_;
  std::int32_t imu_sequence_ = 0;
  std::uint8_t outgoing_sequence_ = 0;
  std::vector<std::byte> outgoing_;
  DecoderCounters counters_;
  Housekeeping housekeeping_;
  SensorHealth health_;
  Utime newest_utime_ = 0;
};

}  // namespace ignis::l1
