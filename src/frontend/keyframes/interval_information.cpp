// SPDX-License-Identifier: Apache-2.0
#include "frontend/keyframes/interval_information.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "frontend/filter/steady_motion.h"
#include "frontend/matching/scan_update.h"

namespace ignis {
namespace {

/// From attitude in body axes and position in odom axes to both in body axes, at the attitude of `state`.
Matrix6d to_body(const NavState& state) {
  Matrix6d turn = Matrix6d::Identity();
  turn.bottomRightCorner<3, 3>() = state.T_odom_body.rotation.conjugate().toRotationMatrix();
  return turn;
}

Matrix6d inverse_of(const Matrix6d& pose_covariance) { return pose_covariance.ldlt().solve(Matrix6d::Identity()); }

/// The nearest positive semidefinite matrix, in units in which `reference` is the identity.
Matrix6d without_negative_part(const Matrix6d& difference, const Matrix6d& reference) {
  const Matrix6d root = reference.llt().matrixL();
  const Matrix6d half = root.triangularView<Eigen::Lower>().solve(difference);
  const Matrix6d scaled = root.triangularView<Eigen::Lower>().solve(half.transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(0.5 * (scaled + scaled.transpose()));
  const Matrix6d vectors = root * eigen.eigenvectors();
  return vectors * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * vectors.transpose();
}

}  // namespace

void IntervalInformation::begin(const FilterState& filter) {
  state_ = filter.nominal;
  with_scans_ = filter.covariance;
  with_scans_.topRows<6>().setZero();
  with_scans_.leftCols<6>().setZero();
  without_scans_ = with_scans_;
  view_.begin_here();
  map_shift_.setZero();
  sum_ = {};
  samples_ = 0;
  informed_ = false;
}

void IntervalInformation::add_imu(const ImuSample& sample) {
  sum_.gyro += sample.gyro;
  sum_.accel += sample.accel;
  ++samples_;
}

InertialInput IntervalInformation::mean_input() const {
  if (samples_ == 0) return steady_input(state_, config_.gravity_m);
  return {sum_.gyro / samples_, sum_.accel / samples_};
}

void IntervalInformation::add_scan(const NavState& state, const Matrix6d& information_body,
                                   std::span<const Eigen::Vector3d> blind) {
  const double dt = seconds_between(state_.utime, state.utime);
  for (ErrorCovariance* covariance : {&with_scans_, &without_scans_}) {
    FilterState filter{state_, *covariance};
    predict(filter, mean_input(), dt, config_);
    *covariance = filter.covariance;
  }
  state_ = state;
  sum_ = {};
  samples_ = 0;
  if (!information_body.isZero(0.0)) take(information_body, blind);
  view_.remember(position_in_map() + map_shift_, blind);
}

void IntervalInformation::add_standstill(const Standstill& standstill) {
  FilterState filter{state_, with_scans_};
  correct_to_standstill(filter, standstill);
  with_scans_ = filter.covariance;
  informed_ = true;
}

void IntervalInformation::take(const Matrix6d& information_body, std::span<const Eigen::Vector3d> blind) {
  PoseInformation scan;
  scan.information = to_body(state_).transpose() * information_body * to_body(state_);
  const UpdateStep update = information_update(with_scans_, ErrorVector::Zero(), scan);
  if (!update.ok) return;
  const Eigen::Matrix3d before = position_in_map() + map_shift_;
  with_scans_ = update.covariance;
  informed_ = true;
  map_shift_ = widened_to(before, map_shift_, position_in_map(), blind);
  map_shift_ = view_.widened(map_shift_, blind, position_in_map());
}

Eigen::Matrix3d IntervalInformation::position_in_map() const { return with_scans_.block<3, 3>(kPosition, kPosition); }

Matrix6d IntervalInformation::information() const {
  if (!informed_) return Matrix6d::Zero();
  Matrix6d with_scans = with_scans_.topLeftCorner<6, 6>();
  with_scans.bottomRightCorner<3, 3>() += map_shift_;
  const Matrix6d known = inverse_of(with_scans);
  const Matrix6d added = without_negative_part(known - inverse_of(without_scans_.topLeftCorner<6, 6>()), known);
  const Matrix6d turn = to_body(state_);
  return turn * added * turn.transpose();
}

}  // namespace ignis
