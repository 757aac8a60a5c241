// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "drivers/counter_unwrapper.h"
#include "drivers/driver_config.h"
#include "drivers/frame_parser.h"
#include "drivers/packet_pairer.h"

namespace ignis::l1 {

/// An AUX frame came: the best evidence of when a scan ended, whether or not its DISTANCE follows.
struct AuxiliarySeen {
  std::int64_t count = 0;  ///< of packets; never wraps
  double sent_before = 0;  ///< [us] see Frame::sent_before
  bool is_new = true;      ///< false when the sensor repeated the frame
};

/// AUX and DISTANCE that belong together.
struct CountedPacket {
  std::int64_t count = 0;
  PacketPair pair;
};

struct CountedImu {
  std::int64_t count = 0;
  double sent_before = 0;  ///< [us]
  ImuAttitude attitude;
};

/// The sensor's counters started anew: power cycle, or a stretch without data too long to be counted through.
struct CountersRestarted {};

using Packet = std::variant<AuxiliarySeen, CountedPacket, CountedImu, TimeSync, Version, CountersRestarted>;

/// All counts since construction.
struct StreamCounters {
  FrameCounters framing;
  PairCounters pairing;
  std::int64_t unknown_messages = 0;  ///< valid frames of the dialect that we do not decode
  std::int64_t rejected_values = 0;   ///< valid frames with absurd content
  std::int64_t duplicates = 0;        ///< packets and samples seen twice, those of `pairing` included
  std::int64_t scan_gaps = 0;         ///< packet pairs missing by their counter
  std::int64_t imu_gaps = 0;          ///< inertial samples missing by their counter
  std::int64_t restarts = 0;          ///< CountersRestarted
};

/// What of a recorded stream is lost or was not sound, for people; empty when it is whole.
[[nodiscard]] std::string damage_in(const StreamCounters& counters);

/// Latest figures that the sensor tells about itself.
struct Housekeeping {
  float apd_temperature = -1000.0F;  ///< [deg C]; -1000 until known
  float imu_temperature = -1000.0F;  ///< [deg C]; -1000 until known
  float dirty_index = 0.0F;          ///< [%]
  std::uint8_t work_status = 0;
  double sensor_time_s = 0.0;  ///< [s] since power-on, as the sensor has it
  std::string firmware;        ///< empty until the sensor answered
};

/// Signs of a sick sensor behind valid frames.
struct SensorHealth {
  int rejected_in_a_row = 0;        ///< frames of one message with absurd content since its last good one: the most
  std::string rejected_field = {};  ///< the field of that message that was refused last
  int equal_gyro_samples = 0;       ///< inertial samples in a row with the turn rates of the one before
  int equal_accel_samples = 0;
};

/// Bytes of an L1 in; checked, paired and counted packets out, in sensor axes and without stamps. The counters of the
/// wire have an unknown modulus: each stream tells how much time a step of the other one's counter may span.
class PacketStream {
 public:
  explicit PacketStream(const DriverConfig& config);

  /// The packets in the bytes of one read that returned at `arrival` [us].
  [[nodiscard]] std::vector<Packet> feed(std::span<const std::byte> bytes, Utime arrival);
  /// What is left at the end of the stream.
  [[nodiscard]] std::vector<Packet> finish();

  [[nodiscard]] StreamCounters counters() const;
  [[nodiscard]] const Housekeeping& housekeeping() const { return housekeeping_; }
  [[nodiscard]] SensorHealth health() const;

 private:
  /// One of the two running counters of the wire.
  struct Counter {
    explicit Counter(double period) : unwrapper(period), period_us(period) {}
    CounterUnwrapper unwrapper;
    double period_us;
    double last_sent = 0.0;           ///< [us] of its newest frame
    std::int64_t count_of_other = 0;  ///< where the other counter stood then
  };

  /// Frames of one message type with absurd content, since its last good one: good scans say nothing about a sick
  /// inertial unit.
  struct Rejections {
    int in_a_row = 0;
    std::string_view field;
  };

  [[nodiscard]] std::vector<Packet> drain();
  void handle(const Frame& frame);
  void handle(const Auxiliary& message, double sent_before);
  void handle(const Distance& message, double sent_before);
  void handle(const ImuAttitude& message, double sent_before);
  [[nodiscard]] bool accept(std::string_view fault, Rejections& rejections);
  void note_values(const ImuAttitude& message);
  void note_sensor_time(const Auxiliary& message, std::int64_t packets_since);
  void restart();
  [[nodiscard]] std::int64_t advance(Counter& counter, const Counter& other, std::uint16_t id, double sent_before);

  DriverConfig config_;
  FrameParser parser_;
  PacketPairer pairer_;
  Counter scans_;
  Counter samples_;
  std::optional<std::int64_t> last_packet_count_;
  std::optional<ImuAttitude> last_imu_;
  std::optional<double> last_sensor_time_s_;
  std::vector<Packet> packets_;
  StreamCounters counters_;
  Housekeeping housekeeping_;
  Rejections auxiliaries_rejected_;
  Rejections distances_rejected_;
  Rejections samples_rejected_;
  int equal_gyro_samples_ = 0;
  int equal_accel_samples_ = 0;
};

}  // namespace ignis::l1
