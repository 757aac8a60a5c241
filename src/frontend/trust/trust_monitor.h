// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "common/byte_codec.h"
#include "common/time.h"
#include "frontend/frontend_config.h"
#include "frontend/scan_stats.h"

namespace ignis {

/// How far the pose can be relied on. Values and order are those of lcmtypes/health_t.lcm.
enum class Trust : std::int8_t { kOk = 0, kDegraded = 1, kLost = 2 };

/// What one scan did to the filter, as far as trust is concerned.
struct ScanEvidence {
  ScanStats stats;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();             ///< [m] odom
  double position_sigma = 0.0;                                    ///< [m] largest of the position in the map
  double sigma_since_start = 0.0;                                 ///< [m] the same against the first pose
  Eigen::Vector3d velocity_correction = Eigen::Vector3d::Zero();  ///< [m/s] odom axes, zero when not applied
  double acceleration_sigma = 0.0;  ///< [m/s^2] of the acceleration that the IMU is believed to feel, largest axis
  bool restless = false;            ///< what few surfaces say is not believed, since some of them move
};

/// Judges from scans and stamps alone whether the pose may be trusted, and says why not.
///
/// A map that was shifted along with a pose while nothing held it fits as well as any, and the pose is known in it to a
/// centimetre. So what the position is uncertain by against the first pose counts as well. That grows with the way on
/// every drive, and a little with each metre is no reason for doubt.
///
/// One of the signals is a second opinion: returns that travel with the vehicle, or a tunnel that looks the same
/// everywhere, give well-conditioned scans that all say "no motion". Each such scan takes a little of the velocity that
/// the IMU has found. Corrections of a healthy filter cancel out; the sum over two seconds is compared with what
/// accelerometer noise and bias can explain. Where scans hardly observe the direction, Lio takes the IMU's side
/// (second_opinion.h).
class TrustMonitor {
 public:
  explicit TrustMonitor(const FrontendConfig& config) : config_(config) {}

  /// A real IMU sample arrived.
  void note_imu(Utime utime);
  /// A scan arrived, used or not.
  void note_arrival(Utime scan_end);
  /// A scan was processed.
  void note_scan(const ScanEvidence& evidence);
  /// The local map was given up; from here on the pose says nothing about where the vehicle was before. `reason` is for
  /// people.
  void note_loss(std::string reason);
  /// The filter goes on from a checkpoint. Until scans have confirmed it, the pose is dead reckoning over a gap.
  void note_resumption();
  [[nodiscard]] bool awaits_confirmation() const { return resumed_; }
  /// What scans had made of the last seconds was taken back (see second_opinion.h).
  void note_contradiction();
  /// A start in the middle of a drive, perhaps: to the IMU constant velocity looks like rest, and only scans tell. So
  /// many of them have to be applied. `reason` is for people.
  void note_uncertain_start(std::string reason, int scans);
  /// The scans were asked after all.
  void forget_uncertain_start();

  /// As of the newest scan.
  [[nodiscard]] Trust trust() const;
  /// The same with what inertial samples tell since then: that no scan comes any more.
  [[nodiscard]] Trust trust_now() const;
  /// Why that is not kOk; what happened last when it is.
  [[nodiscard]] std::string reason() const;
  /// [sigma] by which scans and IMU disagree about the last two seconds.
  [[nodiscard]] double disagreement() const;

 private:
  struct Correction {
    Utime utime;
    Eigen::Vector3d velocity;
  };

  [[nodiscard]] double seconds_without_imu() const;
  /// [s] of inertial samples since the newest scan, used or not.
  [[nodiscard]] double seconds_since_arrival() const;
  [[nodiscard]] bool scans_are_silent() const;
  /// For too long no scan has fitted.
  [[nodiscard]] bool is_out_of_sight(Utime at) const;
  void follow(const Eigen::Vector3d& position);
  [[nodiscard]] bool fits_as_before(const ScanEvidence& evidence) const;
  [[nodiscard]] double usual_sigma() const;

  FrontendConfig config_;
  std::optional<Utime> newest_imu_;
  std::optional<Utime> newest_scan_;
  double scan_period_ = 0.0;    ///< [s] the shorter one of the last two intervals between scans
  double last_interval_ = 0.0;  ///< [s]
  std::optional<Utime> last_applied_;
  std::string last_reason_;
  int scans_since_applied_ = 0;
  int scans_to_confirm_ = 0;     ///< that have to be applied before the trust comes back
  std::string lost_;             ///< why the map was given up; empty when it was not, or the place is found
  bool unseen_ = false;          ///< no scan has fitted for so long that one alone does not prove the place
  bool resumed_ = false;         ///< from a checkpoint, and not yet confirmed
  std::string uncertain_start_;  ///< why; empty when it is none
  bool contradicted_ = false;    ///< scans by the IMU, and not yet confirmed
  int losses_ = 0;
  double position_sigma_ = 0.0;
  double sigma_since_start_ = 0.0;
  double driven_m_ = 0.0;                           ///< metre by metre: what a vehicle that stands jitters by is no way
  Eigen::Vector3d mark_ = Eigen::Vector3d::Zero();  ///< [m] odom, where the last of them ended
  double usual_residual_ = 0.0;  ///< [m] of scans that were applied, a running mean; 0 before the first
  double acceleration_sigma_ = 0.0;
  bool restless_ = false;
  std::deque<Correction> corrections_;

  friend void transfer(auto& io, FieldsOf<Correction> auto& correction) {
    io.number(correction.utime);
    io.matrix(correction.velocity);
  }

  friend void transfer(auto& io, FieldsOf<TrustMonitor> auto& monitor) {
    io.maybe(monitor.newest_imu_);
    io.maybe(monitor.newest_scan_);
    io.number(monitor.scan_period_);
    io.number(monitor.last_interval_);
    io.maybe(monitor.last_applied_);
    io.text(monitor.last_reason_);
    io.number(monitor.scans_since_applied_);
    io.number(monitor.scans_to_confirm_);
    io.text(monitor.lost_);
    io.number(monitor.unseen_);
    io.text(monitor.uncertain_start_);
    io.number(monitor.contradicted_);
    io.number(monitor.losses_);
    io.number(monitor.position_sigma_);
    io.number(monitor.sigma_since_start_);
    io.number(monitor.driven_m_);
    io.matrix(monitor.mark_);
    io.number(monitor.usual_residual_);
    io.number(monitor.acceleration_sigma_);
    io.number(monitor.restless_);
    io.list(monitor.corrections_);
  }
};

}  // namespace ignis
