// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "common/byte_codec.h"
#include "common/measurement_bytes.h"
#include "common/pose.h"
#include "frontend/matching/degeneracy.h"

namespace ignis {

/// Degeneracy over the scans of a drive.
///
/// One scan is half a turn of an L1's head, and a few lucky normals make a blind direction look observed for a moment,
/// which is enough to pin the pose to the prediction: half a second of scans decides. Even then the blind direction is
/// known to a few degrees only, and a different one in each scan: what one scan leaves open, the next pins through the
/// tilt between the two, the harder the better the other directions are observed. So a blind direction is averaged over
/// two seconds and then stays what it is until it ends, and it takes more evidence to end it than to name it.
///
/// What is blind is a motion of all that is seen: of a corridor along itself, of a round tank or a corridor that bends
/// about its axis. To a vehicle that drives on, a turn about an axis is the same turn with another shift, so scans and
/// directions are carried along.
class BlindDirections {
 public:
  /// The next scan is matched at about this pose.
  void move_to(const Pose& T_odom_body);

  /// Takes what the next scan says (see analyse_degeneracy). `settled` is false while the map is so young that older
  /// scans say nothing about it.
  [[nodiscard]] DegeneracyAnalysis add_scan(const Matrix6d& sensitivity, const Matrix6d& noise, bool settled,
                                            const DegeneracyLimits& limits);

 private:
  void carry_directions(const Matrix6d& carry);
  void restart(double length_m);
  void average_direction(const Matrix6d& sensitivity);

  Matrix6d sensitivity_ = Matrix6d::Zero();       ///< running mean over half a second of scans
  Matrix6d noise_ = Matrix6d::Zero();             ///< the same
  Matrix6d held_sensitivity_ = Matrix6d::Zero();  ///< mean over the first scans of a blindness
  Matrix6d held_basis_ = Matrix6d::Identity();    ///< eigenvectors of that, in scaled coordinates
  std::array<bool, 6> blind_{};                   ///< which of them
  double held_length_ = 1.0;                      ///< [m] that scales attitude there: another one would tilt them
  int held_scans_ = 0;                            ///< in the mean; 0: nothing is blind
  int disagreeing_ = 0;                           ///< scans in a row that found more blind directions than are held
  Pose T_odom_body_;                              ///< where all of this is meant

  friend void transfer(auto& io, FieldsOf<BlindDirections> auto& directions) {
    io.matrix(directions.sensitivity_);
    io.matrix(directions.noise_);
    io.matrix(directions.held_sensitivity_);
    io.matrix(directions.held_basis_);
    for (auto& blind : directions.blind_) io.number(blind);
    io.number(directions.held_length_);
    io.number(directions.held_scans_);
    io.number(directions.disagreeing_);
    transfer(io, directions.T_odom_body_);
  }
};

}  // namespace ignis
