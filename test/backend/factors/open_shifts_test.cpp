// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/open_shifts.h"

#include <gtest/gtest.h>

#include <cmath>

#include "backend/factors/keyframe_factors.h"
#include "backend/synthetic_drive.h"
#include "common/so3.h"

namespace ignis {
namespace {

constexpr double kGravity = 9.81;

/// Position information of a corridor along z, whose axis is known `relative` as well as what lies across.
Eigen::Matrix3d corridor(double relative) { return Eigen::Vector3d(1e6, 0.5e6, relative * 1e6).asDiagonal(); }

NavState state_at(const Eigen::Vector3d& position, const Eigen::Vector3d& velocity, const Eigen::Vector3d& turn) {
  NavState state;
  state.T_odom_body = {so3::exp(turn), position};
  state.v_odom = velocity;
  return state;
}

const NavState kFrom = state_at({1.0, 0.2, -3.0}, {0.3, 0.0, -1.1}, {0.02, 0.9, -0.03});
const NavState kTo = state_at({1.5, 0.3, -4.2}, {0.2, 0.1, -0.9}, {0.0, 1.1, 0.0});

ImuSum some_sum() {
  ImuSum sum;
  sum.duration_s = 1.4;
  sum.increment << 0.01, 0.2, 0.02, 0.3, 9.4, -0.4, 0.1, 13.5, -0.2;
  sum.by_accel_bias.middleRows<3>(3) = -0.98 * Eigen::Matrix3d::Identity();
  sum.by_accel_bias.bottomRows<3>() = -1.4 * Eigen::Matrix3d::Identity();
  sum.by_gyro_bias.bottomRows<3>() << 0, 9, 1, -9, 0, 2, -1, -2, 0;
  sum.covariance = 1e-3 * Matrix15d::Identity();
  return sum;
}

/// Where the sum carries `from`, with its biases, by the equations of motion.
NavState carried(const NavState& from, ImuSum sum) {
  const double dt = sum.duration_s;
  sum.increment += sum.by_accel_bias * (from.accel_bias - sum.accel_bias);
  sum.increment += sum.by_gyro_bias * (from.gyro_bias - sum.gyro_bias);
  const Eigen::Vector3d g(0.0, -kGravity, 0.0);
  NavState end = from;
  end.T_odom_body.translation +=
      dt * from.v_odom + 0.5 * dt * dt * g + from.T_odom_body.rotation * sum.increment.segment<3>(3);
  end.v_odom += dt * g + from.T_odom_body.rotation * sum.increment.tail<3>();
  return end;
}

TEST(OpenShifts, IsTheAxisOfABareCorridorAndNothingElse) {
  EXPECT_LT((open_shifts(corridor(1e-8)) - Eigen::Matrix3d(Eigen::Vector3d(0, 0, 1).asDiagonal())).norm(), 1e-3);
  EXPECT_NEAR(open_shifts(corridor(1e-5))(2, 2), 0.5, 1e-3);
  EXPECT_LT(open_shifts(corridor(1e-3)).norm(), 2e-3);
}

TEST(OpenShifts, TurnsWithTheAxes) {
  const Eigen::Matrix3d R = so3::exp({0.3, -0.8, 0.5}).toRotationMatrix();
  const Eigen::Matrix3d turned = R * open_shifts(corridor(2e-5)) * R.transpose();
  EXPECT_LT((open_shifts(R * corridor(2e-5) * R.transpose()) - turned).norm(), 1e-9);
}

TEST(OpenShifts, IsNothingWhereScansSayNothingAtAll) {
  EXPECT_EQ(open_shifts(Eigen::Matrix3d::Zero()).norm(), 0.0);
  EXPECT_NEAR(open_shifts(corridor(-1e-9))(2, 2), 1.0, 1e-9);  // left over from a subtraction
}

TEST(OpenShifts, LetTheSumArriveWhereItShouldAndDoubtAsMuch) {
  NavState from = kFrom;
  from.accel_bias = {0.02, -0.03, 0.05};
  from.gyro_bias = {1e-3, 2e-3, -1e-3};
  const ImuSum moved = agreeing_along(Eigen::Matrix3d::Identity(), from, kTo, kGravity, some_sum());
  const NavState end = carried(from, moved);
  EXPECT_LT((end.T_odom_body.translation - kTo.T_odom_body.translation).norm(), 1e-12);
  EXPECT_LT((end.v_odom - kTo.v_odom).norm(), 1e-12);
  EXPECT_EQ(moved.increment.head<3>(), some_sum().increment.head<3>());
  EXPECT_EQ(moved.covariance, some_sum().covariance);
}

TEST(OpenShifts, LeaveTheOtherDirectionsToTheSamples) {
  const Eigen::Matrix3d open = open_shifts(corridor(0.0));
  const ImuSum moved = agreeing_along(open, kFrom, kTo, kGravity, some_sum());
  const Eigen::Vector<double, 9> change = moved.increment - some_sum().increment;
  EXPECT_LT(change.segment<2>(3).norm() + change.segment<2>(6).norm(), 1e-3);
  EXPECT_GT(std::abs(change(5)), 0.1);
  EXPECT_GT(std::abs(change(8)), 0.1);
}

TEST(OpenShifts, LinkKeyframesByTheFiltersMotionThere) {
  const BackendConfig config;
  testing::Drive drive = testing::make_drive({.keyframes = 2});
  Keyframe& keyframe = drive.keyframes[1];
  keyframe.state.v_odom += Eigen::Vector3d(0.3, 0.0, 0.4);  // whom the samples contradict
  const NavState& from = drive.keyframes[0].state;
  const Eigen::Quaterniond R_body_odom = from.T_odom_body.rotation.conjugate();
  const auto contradiction = [&] {
    const KeyframeLink link = next_link(keyframe, {0, from, from}, true, WhiteningRows(0, 6), config);
    const NavState end = carried(from, link.imu.value());
    return Eigen::Vector3d(R_body_odom * (end.v_odom - keyframe.state.v_odom));
  };
  const Eigen::Vector3d closed = contradiction();
  const Eigen::Matrix3d R = (from.T_odom_body.inverse() * keyframe.state.T_odom_body).rotation.toRotationMatrix();
  keyframe.scan_information.bottomRightCorner<3, 3>() = R.transpose() * corridor(0.0) * R;
  const Eigen::Vector3d open = contradiction();
  EXPECT_LT(std::abs(open.z()), 1e-6);
  EXPECT_GT(std::abs(closed.z()), 0.2);
  EXPECT_NEAR(open.x(), closed.x(), 1e-3);
}

}  // namespace
}  // namespace ignis
