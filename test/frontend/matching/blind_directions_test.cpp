// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/blind_directions.h"

#include <gtest/gtest.h>

#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "frontend/simulated_planes.h"

namespace ignis {
namespace {

using test::corridor_planes;
using test::Planes;
using test::tank_planes;

constexpr double kNormalSigma = 0.03;
constexpr DegeneracyLimits kLimits{4.0, 1e-5, 2.0};

/// [m] what ten seconds of a bare corridor leave of an unknown position along it (10 m), two seconds after its begin.
double sigma_along(const auto& projector_of) {
  Matrix6d information = 1e-2 * Matrix6d::Identity();
  for (int k = 0; k < 240; ++k) {
    const Planes planes = corridor_planes(kNormalSigma, 0, static_cast<std::uint32_t>(k));
    const Matrix6d projector = projector_of(planes, k);
    if (k < 40) continue;
    information += projector.transpose() * (800.0 / 1e-4 * planes.sensitivity) * projector;
  }
  return std::sqrt(information.inverse()(5, 5));
}

TEST(BlindDirections, WhatOneScanLeavesOpenTheNextDoesNotPin) {
  BlindDirections blind;
  const double held = sigma_along([&](const Planes& planes, int k) {
    // Another mean range each time: as a unit of attitude it would tilt the direction as well.
    const DegeneracyLimits limits{3.0 + 0.1 * (k % 20), kLimits.min_sensitivity, kLimits.min_signal_to_noise};
    return blind.add_scan(planes.sensitivity, planes.noise, true, limits).projector;
  });
  const double scan_by_scan = sigma_along([](const Planes& planes, int) {
    return analyse_degeneracy(planes.sensitivity, planes.noise, kLimits).projector;
  });
  EXPECT_LT(scan_by_scan, 0.1) << "the fault that is guarded against";
  EXPECT_GT(held, 5.0);
}

TEST(BlindDirections, AreReleasedWhenStructureComesIntoView) {
  BlindDirections blind;
  DegeneracyAnalysis analysis;
  for (std::uint32_t k = 0; k < 100; ++k) {
    const Planes planes = corridor_planes(kNormalSigma, 0, k);
    analysis = blind.add_scan(planes.sensitivity, planes.noise, true, kLimits);
    if (k > 20) {
      ASSERT_EQ(analysis.degenerate_directions, 1) << k;
      ASSERT_GT(std::abs(analysis.degenerate[0][5]), 0.99) << k;
    }
  }
  for (std::uint32_t k = 100; k < 140; ++k) {
    const Planes planes = corridor_planes(kNormalSigma, 60, k);
    analysis = blind.add_scan(planes.sensitivity, planes.noise, true, kLimits);
  }
  EXPECT_EQ(analysis.degenerate_directions, 0);
}

TEST(BlindDirections, FollowACorridorThatTurns) {
  BlindDirections blind;
  const auto feed = [&](bool turned, std::uint32_t k) {
    Planes planes = corridor_planes(kNormalSigma, 0, k);
    if (turned) {
      // A quarter turn about Y: what lay along Z lies along X.
      Eigen::Matrix3d R;
      R << 0, 0, 1, 0, 1, 0, -1, 0, 0;
      Matrix6d turn = Matrix6d::Zero();
      turn.topLeftCorner<3, 3>() = R;
      turn.bottomRightCorner<3, 3>() = R;
      planes.sensitivity = (turn * planes.sensitivity * turn.transpose()).eval();
      planes.noise = (turn * planes.noise * turn.transpose()).eval();
    }
    return blind.add_scan(planes.sensitivity, planes.noise, true, kLimits);
  };
  for (std::uint32_t k = 0; k < 60; ++k) (void)feed(false, k);
  DegeneracyAnalysis analysis;
  for (std::uint32_t k = 60; k < 160; ++k) analysis = feed(true, k);
  ASSERT_EQ(analysis.degenerate_directions, 1);
  EXPECT_GT(std::abs(analysis.degenerate[0][3]), 0.99);
}

/// Round in a circle of 3.3 m about the axis of a tank, 4 cm a scan, over ground on which the vehicle pitches.
Pose pose_in_tank(int scan) {
  const double angle = 0.04 / 3.3 * scan;
  const double pitch = 0.3 * std::sin(0.05 * scan);
  return {Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitX()),
          {3.3 * std::cos(angle), 0.0, -3.3 * std::sin(angle)}};
}

TEST(BlindDirections, AreCarriedAlongByAVehicleThatDrivesRoundInATank) {
  BlindDirections blind;
  for (int k = 0; k < 400; ++k) {
    const Pose T_odom_body = pose_in_tank(k);
    const Planes planes = tank_planes(T_odom_body, kNormalSigma, static_cast<std::uint32_t>(k));
    blind.move_to(T_odom_body);
    const DegeneracyAnalysis analysis = blind.add_scan(planes.sensitivity, planes.noise, true, kLimits);
    if (k < 40) continue;
    ASSERT_EQ(analysis.degenerate_directions, 1) << k;
    // All that is seen, turned about the axis of the tank.
    Vector6d turn;
    turn << kLimits.length_m * (T_odom_body.rotation.inverse() * Eigen::Vector3d::UnitY()),
        Eigen::Vector3d::UnitY().cross(T_odom_body.translation);
    ASSERT_GT(std::abs(analysis.degenerate[0].dot(turn.normalized())), 0.99) << k;
  }
}

/// What a corridor that bends to the left looks like from a pose that stands along it, in odom axes.
Planes bend_planes_at(const Pose& T_odom_body, double radius, std::uint32_t seed) {
  Planes planes = test::bend_planes(radius, kNormalSigma, seed);
  Matrix6d to_odom = Matrix6d::Identity();
  to_odom.bottomRightCorner<3, 3>() = T_odom_body.rotation.toRotationMatrix();
  planes.sensitivity = (to_odom * planes.sensitivity * to_odom.transpose()).eval();
  planes.noise = (to_odom * planes.noise * to_odom.transpose()).eval();
  return planes;
}

TEST(BlindDirections, AlongABendAreAShiftAndTheTurnThatGoesWithIt) {
  for (const double radius : {6.0, 12.0, 25.0}) {
    BlindDirections blind;
    for (int k = 0; k < 400; ++k) {
      const Eigen::AngleAxisd round(0.04 / radius * k, Eigen::Vector3d::UnitY());
      const Eigen::Vector3d axis(-radius, 0.0, 0.0);
      const Pose T_odom_body{Eigen::Quaterniond(round), axis - round * axis};
      const Planes planes = bend_planes_at(T_odom_body, radius, static_cast<std::uint32_t>(k));
      blind.move_to(T_odom_body);
      const DegeneracyAnalysis analysis = blind.add_scan(planes.sensitivity, planes.noise, true, kLimits);
      if (k < 40) continue;
      ASSERT_EQ(analysis.degenerate_directions, 1) << radius << " m, " << k;
      Vector6d along;
      along << kLimits.length_m * Eigen::Vector3d::UnitY(), radius * (round * -Eigen::Vector3d::UnitZ());
      ASSERT_GT(std::abs(analysis.degenerate[0].dot(along.normalized())), 0.999) << radius << " m, " << k;
    }
  }
}

TEST(BlindDirections, TakeTheNewestScanAloneWhileTheMapIsYoung) {
  BlindDirections blind;
  for (std::uint32_t k = 0; k < 10; ++k) {
    const Planes planes = corridor_planes(kNormalSigma, 0, k);
    (void)blind.add_scan(planes.sensitivity, planes.noise, true, kLimits);
  }
  const Planes structured = corridor_planes(kNormalSigma, 100, 50);
  EXPECT_EQ(blind.add_scan(structured.sensitivity, structured.noise, false, kLimits).degenerate_directions, 0);
}

}  // namespace
}  // namespace ignis
