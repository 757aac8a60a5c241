// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/blind_directions.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

#include "common/so3.h"

namespace ignis {
namespace {

constexpr double kShareOfNewestScan = 0.1;
constexpr int kFirstHeldScans = 10;  // the running mean's own length
constexpr int kMostHeldScans = 40;   // two seconds
constexpr int kMostDisagreeing = 10;
constexpr double kRelease = 1.5;  // evidence that ends blindness, relative to what would have prevented it

/// Takes what a small motion of all that is seen is to a vehicle at one pose to what it is to one at another: attitude
/// in body axes, position in odom axes.
Matrix6d carry_of(const Pose& from, const Pose& to) {
  const Eigen::Matrix3d R = from.rotation.toRotationMatrix();
  Matrix6d carry = Matrix6d::Identity();
  carry.topLeftCorner<3, 3>() = to.rotation.toRotationMatrix().transpose() * R;
  carry.bottomLeftCorner<3, 3>() = -so3::skew(to.translation - from.translation) * R;
  return carry;
}

}  // namespace

void BlindDirections::move_to(const Pose& T_odom_body) {
  if (held_scans_ > 0) carry_directions(carry_of(T_odom_body_, T_odom_body));
  const Matrix6d back = carry_of(T_odom_body, T_odom_body_);
  for (Matrix6d* sum : {&sensitivity_, &noise_, &held_sensitivity_}) *sum = (back.transpose() * *sum * back).eval();
  T_odom_body_ = T_odom_body;
}

/// A shift is the same everywhere, and what counts as a pure one stays that: the bit of turn that noise mixes in would
/// tilt it by more the farther the vehicle goes.
void BlindDirections::carry_directions(const Matrix6d& carry) {
  Vector6d scale = Vector6d::Ones();
  scale.head<3>().setConstant(held_length_);
  const Matrix6d scaled = scale.asDiagonal() * carry * scale.cwiseInverse().asDiagonal();
  const auto is_blind = [&](Eigen::Index k) { return blind_[static_cast<std::size_t>(k)]; };
  const std::array<bool, 6> turning =
      turning_among(held_basis_, blind_, ScaledSensitivity(sensitivity_, noise_, held_length_));
  const auto is_shift = [&](Eigen::Index k) {
    return is_mostly_shift(held_basis_.col(k)) && !turning[static_cast<std::size_t>(k)];
  };
  std::array<Eigen::Index, 6> order{0, 1, 2, 3, 4, 5};
  // The first ones stay what they are, the others make room.
  const auto observed = std::ranges::stable_partition(order, is_blind);
  const auto turns = std::ranges::stable_partition(order.begin(), observed.begin(), is_shift);
  if (turns.empty()) return;
  Matrix6d basis = Matrix6d::Zero();
  for (const Eigen::Index k : order) {
    const Vector6d held = held_basis_.col(k);
    Vector6d direction = !is_blind(k) ? held : is_shift(k) ? without_small_turn(held) : scaled * held;
    direction -= basis * (basis.transpose() * direction).eval();
    basis.col(k) = direction.normalized();
  }
  held_basis_ = basis;
}

DegeneracyAnalysis BlindDirections::add_scan(const Matrix6d& sensitivity, const Matrix6d& noise, bool settled,
                                             const DegeneracyLimits& limits) {
  const double share = settled ? kShareOfNewestScan : 1.0;
  sensitivity_ += share * (sensitivity - sensitivity_);
  noise_ += share * (noise - noise_);
  DegeneracyAnalysis newest = analyse_degeneracy(sensitivity_, noise_, limits);
  if (!settled || (newest.degenerate_directions == 0 && held_scans_ == 0)) return newest;

  if (held_scans_ == 0 || disagreeing_ > kMostDisagreeing) restart(limits.length_m);
  const ScaledSensitivity recent(sensitivity_, noise_, held_length_);
  if (held_scans_ < kMostHeldScans) average_direction(sensitivity);
  std::array<double, 6> needed;
  for (std::size_t i = 0; i < 6; ++i) needed[i] = limits.min_signal_to_noise * (blind_[i] ? kRelease : 1.0);
  blind_ = blind_among(held_basis_, recent, needed, limits);
  const std::array<bool, 6> turning = turning_among(held_basis_, blind_, recent);
  const DegeneracyAnalysis held = without_blind(held_basis_, recent, blind_, turning, limits.min_sensitivity);
  disagreeing_ = newest.degenerate_directions > held.degenerate_directions ? disagreeing_ + 1 : 0;
  if (newest.degenerate_directions == 0 && held.degenerate_directions == 0) held_scans_ = 0;
  return held;
}

void BlindDirections::restart(double length_m) {
  held_length_ = length_m;
  held_sensitivity_ = sensitivity_;
  held_scans_ = kFirstHeldScans;
  blind_.fill(false);
  disagreeing_ = 0;
}

void BlindDirections::average_direction(const Matrix6d& sensitivity) {
  ++held_scans_;
  held_sensitivity_ += (sensitivity - held_sensitivity_) / held_scans_;
  const ScaledSensitivity mean(held_sensitivity_, noise_, held_length_);
  held_basis_ = Eigen::SelfAdjointEigenSolver<Matrix6d>(mean.value).eigenvectors();
}

}  // namespace ignis
