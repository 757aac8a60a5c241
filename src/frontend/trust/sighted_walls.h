// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "common/byte_codec.h"
#include "common/measurements.h"

namespace ignis {

/// The velocity that the filter believes in, minus the true one.
struct VelocityError {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit, horizontal, odom axes
  double along = 0.0;                                   ///< [m/s]
  double variance = 0.0;                                ///< [m^2/s^2] of the measurement
};

/// Walls that are in sight but not in the map, and what they tell of a velocity that scans do not observe.
///
/// Behind a corridor the velocity may be wrong by half a metre a second. A wall far ahead, of which each scan sees a
/// dozen points, then never becomes a plane of the map: each scan puts it elsewhere, and no neighbourhood is ever
/// smooth enough. What is told by a few points nearby instead may be the trail that earlier scans have left, which
/// moves along with the pose. But all points of that wall lie on one plane which goes through odom at just that error.
/// Plane and speed are looked for together by random sampling (M. Fischler, R. Bolles, "Random sample consensus", CACM
/// 24(6), 1981) among the points of the last second that met no plane, and taken when they stand out from what
/// surrounds them. Only upright planes that face along the blind direction and are wide: what moves is seldom wider
/// than a truck.
class SightedWalls {
 public:
  /// Points of a scan that met no plane, where the pose after it puts them [m, odom axes]. Stamps ascend.
  void add_scan(Utime utime, std::span<const Eigen::Vector3d> points);

  /// The pose has moved otherwise than by its velocity, or what was said has been used.
  void clear();

  /// Enough scans for a judgement have come since the last one.
  [[nodiscard]] bool is_due() const { return scans_since_judged_ >= kScansBetween; }

  /// Along a unit `axis` (odom), along which the velocity has `sigma` [m/s]. The mean over the last second; its
  /// variance holds what an accelerometer of `accel_noise` [m/s^2/sqrt(Hz)] makes of the error within that time.
  [[nodiscard]] std::optional<VelocityError> judge(const Eigen::Vector3d& axis, double sigma, double accel_noise);

 private:
  static constexpr std::uint32_t kScansBetween = 5;

  struct Sighting {
    Utime utime = 0;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();

    friend void transfer(auto& io, FieldsOf<Sighting> auto& sighting) {
      io.number(sighting.utime);
      io.matrix(sighting.point);
    }
  };

  std::deque<Sighting> sightings_;  ///< of the last second, oldest first
  std::uint32_t scans_since_judged_ = 0;

  friend void transfer(auto& io, FieldsOf<SightedWalls> auto& walls) {
    io.list(walls.sightings_);
    io.number(walls.scans_since_judged_);
  }
};

}  // namespace ignis
