// SPDX-License-Identifier: Apache-2.0
#include "frontend/trust/map_drift.h"

#include <algorithm>
#include <limits>

#include "common/so3.h"

namespace ignis {
namespace {

constexpr std::size_t kMostPlacements = 150;
// Both were looked for over twelve drives each of four scenes, with 550 points a scan, until the NEES of position and
// attitude were nearest to one (docs/results/honesty.md, What a scan leaves behind).
constexpr double kScansOfAlikeNoise = 12.0;  // the filter averages over some
// A plane of the map is met by many points of a scan, whose errors are then one.
constexpr double kPointsThatShareAnError = 14.0;

/// Takes an error of (attitude in body axes, position in odom axes) to one with both in odom axes.
Matrix6d attitude_to_odom(const Pose& T_odom_body) {
  Matrix6d turn = Matrix6d::Identity();
  turn.topLeftCorner<3, 3>() = T_odom_body.rotation.toRotationMatrix();
  return turn;
}

}  // namespace

void MapDrift::begin(const FilterState& first) {
  // Gravity (x, -1, z) is straight down in a frame that is turned by (z, 0, -x).
  Eigen::Matrix<double, 3, 2> turn_by_tilt = Eigen::Matrix<double, 3, 2>::Zero();
  turn_by_tilt(0, 1) = 1.0;
  turn_by_tilt(2, 0) = -1.0;
  covariance_.setZero();
  start_tilt_ = turn_by_tilt * first.covariance.block<2, 2>(kGravityTilt, kGravityTilt) * turn_by_tilt.transpose();
  covariance_.topLeftCorner<3, 3>() = start_tilt_;
  start_ = first.nominal.T_odom_body.translation;
  position_ = start_;
}

void MapDrift::add_scan(const Matrix6d& pose_covariance, const Matrix6d& disagreement, const Pose& T_odom_body,
                        double age_scans, std::span<const Eigen::Vector3d> blind) {
  Matrix6d measured = attitude_to_odom(T_odom_body);
  measured.bottomRightCorner<3, 3>() -= projector_on(blind);
  carry_to(T_odom_body.translation);
  const double age = std::max(age_scans, 1.0);
  const Matrix6d stays =
      std::min(kScansOfAlikeNoise / age, 1.0) * pose_covariance + kPointsThatShareAnError * disagreement;
  covariance_ += scale_ / age * measured * stays * measured.transpose();
}

Eigen::Matrix3d MapDrift::bend(const Matrix6d& pose_covariance, const Pose& T_odom_body, double age_scans) const {
  const Eigen::Matrix3d R = T_odom_body.rotation.toRotationMatrix();
  return scale_ / std::max(age_scans, 1.0) * R * pose_covariance.topLeftCorner<3, 3>() * R.transpose();
}

void MapDrift::remember(int scan, const Eigen::Matrix3d& position_covariance, const Eigen::Vector3d& position,
                        std::span<const Eigen::Vector3d> blind) {
  view_.remember(position_covariance, blind);
  if (!placements_.empty() && scan < placements_.back().scan) placements_.clear();
  if (!placements_.empty() && scan == placements_.back().scan) return;  // did not enter the map
  placements_.push_back({scan, position, position_covariance, position_covariance - shift_by_tilt(position)});
  if (placements_.size() > kMostPlacements) forget_one();
}

/// The one that leaves the smallest gap for its age, so that the older they are the fewer are left.
void MapDrift::forget_one() {
  const int newest = placements_.back().scan;
  std::size_t least = 1;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i + 1 < placements_.size(); ++i) {
    const double gap = placements_[i + 1].scan - placements_[i - 1].scan;
    const double share = gap / (newest - placements_[i].scan);
    if (share >= smallest) continue;
    smallest = share;
    least = i;
  }
  placements_.erase(placements_.begin() + static_cast<std::ptrdiff_t>(least));
}

int MapDrift::sure_since(const Eigen::Matrix3d& position_covariance, const Eigen::Vector3d& position,
                         double sigma_m) const {
  const Eigen::Matrix3d in_map = position_covariance - shift_by_tilt(position);
  const auto doubtful = [&](const Placement& then) {
    return (in_map - then.in_map).diagonal().maxCoeff() > sigma_m * sigma_m;
  };
  const auto last_doubtful = std::ranges::find_if(placements_.rbegin(), placements_.rend(), doubtful);
  if (last_doubtful == placements_.rend()) return 0;
  const auto first_sure = last_doubtful.base();
  return first_sure == placements_.end() ? placements_.back().scan + 1 : first_sure->scan;
}

int MapDrift::newest_beyond(double distance_m, const Eigen::Vector3d& position) const {
  const auto beyond = [&](const Placement& then) { return (then.position - position).norm() >= distance_m; };
  const auto newest = std::ranges::find_if(placements_.rbegin(), placements_.rend(), beyond);
  return newest == placements_.rend() ? -1 : newest->scan;
}

void MapDrift::hold_to(double scan, std::span<const Eigen::Vector3d> axes, const Pose& T_odom_body) {
  if (placements_.empty()) return;
  // The first one behind that scan: uncertainty grows on the way, so this errs towards too much.
  const auto behind = std::ranges::lower_bound(placements_, scan, {}, &Placement::scan);
  const Placement& then = behind == placements_.end() ? placements_.back() : *behind;
  carry_to(T_odom_body.translation);
  auto shift = covariance_.bottomRightCorner<3, 3>();
  shift = widened_to(then.position_covariance, shift, Eigen::Matrix3d::Zero(), axes);
}

void MapDrift::hand_over(std::span<const Eigen::Vector3d> blind, const Pose& T_odom_body,
                         const Eigen::Matrix3d& in_map) {
  carry_to(T_odom_body.translation);
  auto shift = covariance_.bottomRightCorner<3, 3>();
  shift = view_.widened(shift, blind, in_map);
}

void MapDrift::doubt(const Eigen::Matrix3d& position_covariance, std::span<const Eigen::Vector3d> axes,
                     const Pose& T_odom_body, const Eigen::Matrix3d& in_map) {
  carry_to(T_odom_body.translation);
  auto shift = covariance_.bottomRightCorner<3, 3>();
  shift = widened_to(position_covariance, shift, in_map, axes);
}

Eigen::Matrix3d MapDrift::shift_since_start(const Eigen::Vector3d& position) const {
  return at(position).bottomRightCorner<3, 3>() - shift_by_tilt(position);
}

Matrix6d MapDrift::pose_covariance(const Pose& T_odom_body) const {
  const Matrix6d turn = attitude_to_odom(T_odom_body);
  return turn.transpose() * at(T_odom_body.translation) * turn;
}

void MapDrift::carry_to(const Eigen::Vector3d& position) {
  covariance_ = at(position);
  position_ = position;
}

Matrix6d MapDrift::at(const Eigen::Vector3d& position) const {
  // A map that is turned by phi shifts what lies d further on by phi x d.
  Matrix6d carry = Matrix6d::Identity();
  carry.bottomLeftCorner<3, 3>() = -so3::skew(position - position_);
  return carry * covariance_ * carry.transpose();
}

Eigen::Matrix3d MapDrift::shift_by_tilt(const Eigen::Vector3d& position) const {
  const Eigen::Matrix3d lever = so3::skew(position - start_);
  return lever * start_tilt_ * lever.transpose();
}

}  // namespace ignis
