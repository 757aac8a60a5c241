// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "common/keyframe.h"
#include "frontend/filter/eskf.h"
#include "frontend/frontend_config.h"
#include "frontend/keyframes/interval_information.h"

namespace ignis {

/// A speed that a wall in sight told, and what the filter was once it had taken it.
struct TakenSpeed {
  SightedSpeed sighted;                              ///< odom axes
  Eigen::Vector3d v_odom = Eigen::Vector3d::Zero();  ///< [m/s]
  double velocity_variance = 0.0;                    ///< [m^2/s^2] along the axis
};

void transfer(auto& io, FieldsOf<TakenSpeed> auto& taken) {
  transfer(io, taken.sighted);
  io.matrix(taken.v_odom);
  io.number(taken.velocity_variance);
}

/// kSeldom: at most one a second. How far a lost vehicle went is not known: one that seems to go at 80 m/s would make
/// every scan a keyframe, which costs back end, journal and map without end.
enum class KeyframePace : std::int8_t { kAsDriven, kSeldom, kNone };

/// Decides when a keyframe is due (distance, turn, or time since the last one; the first scan always) and assembles it:
/// the last second of deskewed scans as one cloud, the IMU samples and the scan-matching information of the interval.
class Keyframer {
 public:
  Keyframer(const FrontendConfig& config, std::int32_t session);

  /// Each IMU sample once, in time order, before the first scan that ends after it.
  void add_imu(const ImuSample& sample);

  /// The interval since the last keyframe has an IMU gap.
  void note_gap() { imu_complete_ = false; }

  /// The filter has taken that the vehicle stood, at the scan that comes next.
  void add_standstill(const Standstill& standstill);

  /// The filter has taken a speed that a wall in sight told (odom axes), at the scan that comes next, and is
  /// `corrected`. Of several in an interval the newest is handed on.
  void add_sighted(const SightedSpeed& sighted, const FilterState& corrected);

  /// The filter was replaced by one that has not taken it.
  void forget_sighted() { taken_.reset(); }

  /// A scan at the filter's state after it. `information_body` is zero for scans that were not applied; shifts along
  /// the unit axes `blind` (odom) it does not observe. `cloud` is in the body frame at that state. A keyframe that is
  /// due waits until the `pace` allows for it.
  std::optional<Keyframe> add_scan(const FilterState& filter, const Matrix6d& information_body,
                                   std::span<const Eigen::Vector3d> blind, std::vector<CloudPoint> cloud,
                                   KeyframePace pace = KeyframePace::kAsDriven);

 private:
  struct RegisteredScan {
    Utime utime;
    Pose T_odom_body;
    std::vector<CloudPoint> cloud;  ///< body frame
  };

  void note_motion(const NavState& state);
  [[nodiscard]] bool due(const NavState& state) const;
  [[nodiscard]] bool allows(KeyframePace pace, const NavState& state) const;
  [[nodiscard]] bool stood_still(const NavState& state) const;
  [[nodiscard]] std::optional<SightedSpeed> sighted_now(const FilterState& filter) const;
  [[nodiscard]] std::vector<CloudPoint> merged_cloud(const Pose& T_odom_body) const;
  [[nodiscard]] Keyframe make(const FilterState& filter);

  FrontendConfig config_;
  std::int32_t session_;
  std::int32_t next_id_ = 0;
  NavState last_;  ///< of the last keyframe
  std::deque<RegisteredScan> recent_;
  std::vector<ImuSample> imu_;
  bool imu_complete_ = true;
  IntervalInformation information_;
  std::optional<TakenSpeed> taken_;  ///< in the interval
  int scans_ = 0;                    ///< in the interval
  double speed2_sum_ = 0.0;          ///< [m^2/s^2] over the scans of the interval
  double max_displacement_ = 0.0;    ///< [m] from the last keyframe

  friend void transfer(auto& io, FieldsOf<RegisteredScan> auto& scan) {
    io.number(scan.utime);
    transfer(io, scan.T_odom_body);
    io.list(scan.cloud);
  }

  friend void transfer(auto& io, FieldsOf<Keyframer> auto& keyframer) {
    io.number(keyframer.session_);
    io.number(keyframer.next_id_);
    transfer(io, keyframer.last_);
    io.list(keyframer.recent_);
    io.list(keyframer.imu_);
    io.number(keyframer.imu_complete_);
    transfer(io, keyframer.information_);
    io.maybe(keyframer.taken_);
    io.number(keyframer.scans_);
    io.number(keyframer.speed2_sum_);
    io.number(keyframer.max_displacement_);
  }
};

}  // namespace ignis
