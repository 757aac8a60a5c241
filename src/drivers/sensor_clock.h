// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "common/time.h"
#include "drivers/clock_line.h"
#include "drivers/driver_config.h"

namespace ignis::l1 {

/// Stamps that never go back and never jitter: each follows the previous one by the nominal period times the count,
/// bent towards the target by at most 2 % of that. A target more than 20 ms away is taken at once, forwards only.
class SteadyStamps {
 public:
  explicit SteadyStamps(double period_us) : period_us_(period_us) {}
  [[nodiscard]] double stamp(std::int64_t count, double target_us);

 private:
  double period_us_;
  bool started_ = false;
  std::int64_t last_count_ = 0;
  double last_us_ = 0.0;
};

/// Gives packets and inertial samples their instants. The wire carries counters only.
///
/// Source "arrival": each stream has its own minimum-delay line through the host's arrival times.
/// Source "counters" (no usable arrivals): scan count 0 is at `start_time_s` and the mirror turns at exactly 180 Hz;
/// the inertial clock is found from the order of frames in the stream: a sample was not ready before the AUX frame
/// ahead of it was (else it would have gone first), but before the AUX or DISTANCE frame behind it. The beat of 4 ms
/// against 5.56 ms moves samples through all phases, which narrows that to about 0.3 ms. DISTANCE gives no bound from
/// below, since nobody knows whether the sensor lets a sample in between AUX and DISTANCE.
class SensorClock {
 public:
  explicit SensorClock(const DriverConfig& config);

  /// An AUX frame of scan `count` that began on the wire no later than `sent_before_us`.
  void on_auxiliary(std::int64_t count, double sent_before_us);
  /// The DISTANCE frame that follows it.
  void on_distance(std::int64_t count);
  void on_imu(std::int64_t count, double sent_before_us);

  /// The counters lost their phase: what was learnt of them is forgotten. Stamps go on without stepping back.
  void restart();

  /// False while the two streams of a capture are not yet aligned: events should wait.
  [[nodiscard]] bool ready() const;
  /// [us] first point of packet `count`. Call once per packet, in order.
  [[nodiscard]] double packet_time(std::int64_t count);
  /// [us] of inertial sample `count`. Call once per sample, in order.
  [[nodiscard]] double imu_time(std::int64_t count);

  /// How often arrivals contradicted what was learnt, so that it was learnt anew: stamps may have leapt.
  [[nodiscard]] std::int64_t restarts() const;

  /// [us] fitted arrival time of packet counter 0, [1e-6], [us]: for the status message. Zero for captures.
  [[nodiscard]] double offset_us() const;
  [[nodiscard]] double drift_ppm() const;
  [[nodiscard]] double jitter_us() const;

 private:
  [[nodiscard]] double nominal_packet_time(std::int64_t count) const;
  void bound_imu_from_above(double sent_us);

  bool by_arrival_;
  double start_us_;
  double scan_latency_us_;
  double imu_latency_us_;
  ClockLine scan_line_;
  ClockLine imu_upper_;
  ClockLine imu_lower_;
  SteadyStamps packet_stamps_;
  SteadyStamps imu_stamps_;
  std::optional<double> last_auxiliary_us_;   ///< [us] when the latest AUX frame was ready
  std::vector<std::int64_t> awaiting_upper_;  ///< inertial counts since then
};

}  // namespace ignis::l1
