// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "common/byte_codec.h"
#include "common/time.h"
#include "frontend/filter/eskf.h"
#include "frontend/frontend_config.h"

namespace ignis {

/// Scans and standing took back a velocity that the IMU is sure of.
struct Contradiction {
  FilterState since;                                     ///< before they did
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  ///< odom axes
  double sigmas = 0.0;                                   ///< of what dead reckoning may be off by
};

/// What scans have made of the velocity for two seconds, held against what the IMU alone makes of it.
///
/// A few planes that are none, corners and smeared rings, can hold a vehicle still along a direction that nothing else
/// observes. Each scan fits, each correction is small, and the covariance shrinks. Only the sum of the corrections
/// tells: over two seconds dead reckoning is off by a decimetre per second, and no true map asks for five times that.
/// Where scans observe the direction well it is the IMU that is wrong, and this has nothing to say.
///
/// Averages over a window reveal slow faults that no single innovation does: as in J. Diesel, S. Luu, "GPS/IRS AIME:
/// calculation of thresholds and protection radius using chi-square methods", ION GPS-95.
class SecondOpinion {
 public:
  explicit SecondOpinion(const FrontendConfig& config) : config_(config) {}

  /// After a scan: the state with the covariance that is believed, what scan and standing did to the velocity [m/s,
  /// odom axes], and the mean of n n^T over the scan's planes.
  void note_scan(const FilterState& corrected, const Eigen::Vector3d& velocity_correction,
                 const Eigen::Matrix3d& facing);

  /// A start at this instant. To the IMU constant velocity looks like rest: whoever disagrees with scans in the first
  /// three seconds has begun in motion and is not heard for ten more.
  void begin(Utime start);

  /// Nothing before this instant can be dead reckoned.
  void forget() { marks_.clear(); }

  /// The largest along any direction that scans hardly observe. What dead reckoning may be off by: the noise of the
  /// samples, the acceleration that a wrong attitude or bias adds, and what was not known of the velocity to begin
  /// with.
  [[nodiscard]] std::optional<Contradiction> contradiction();

 private:
  [[nodiscard]] std::optional<Contradiction> largest() const;

  /// An instant from which the drive could be dead reckoned.
  struct Mark {
    FilterState state;
    Eigen::Vector3d corrected = Eigen::Vector3d::Zero();  ///< [m/s] of the velocity, since
  };

  FrontendConfig config_;
  std::vector<Mark> marks_;  ///< the last two seconds, ascending
  Utime start_ends_ = 0;
  Utime silent_until_ = 0;
  Utime newest_ = 0;                                  ///< of the last scan
  Eigen::Matrix3d facing_ = Eigen::Matrix3d::Zero();  ///< running mean over half a second of scans

  friend void transfer(auto& io, FieldsOf<Mark> auto& mark) {
    transfer(io, mark.state);
    io.matrix(mark.corrected);
  }

  friend void transfer(auto& io, FieldsOf<SecondOpinion> auto& opinion) {
    io.list(opinion.marks_);
    io.number(opinion.start_ends_);
    io.number(opinion.silent_until_);
    io.number(opinion.newest_);
    io.matrix(opinion.facing_);
  }
};

}  // namespace ignis
