// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/planar_pose_factor.h"

#include <gtest/gtest.h>
#include <gtsam/linear/GaussianFactor.h>
#include <gtsam/linear/VectorValues.h>
#include <gtsam/nonlinear/NonlinearFactor.h>
#include <gtsam/nonlinear/Values.h>

#include "backend/pose_graph/planar_pose.h"

namespace ignis {
namespace {

Pose in_plane(double x, double y, double heading) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ())), {x, y, 0.0}};
}

gtsam::Values both(const gtsam::Pose2& from, const gtsam::Pose2& to) {
  gtsam::Values values;
  values.insert(1, PlanarPose{from});
  values.insert(2, PlanarPose{to});
  return values;
}

/// At other places the error itself, which the linear factor promises to first order.
double error_at(const gtsam::NonlinearFactor& factor, const gtsam::Values& values, gtsam::Key key, int axis,
                double by) {
  gtsam::Values moved = values;
  gtsam::Vector3 step = gtsam::Vector3::Zero();
  step(axis) = by;
  moved.update(key, gtsam::traits<PlanarPose>::Retract(values.at<PlanarPose>(key), step));
  return factor.error(moved);
}

TEST(PlanarPoseFactor, CostsWhatItsInformationSaysOfTheMeasuredPoseSeenFromIt) {
  Eigen::Matrix3d information;
  information << 10.0, 1.0, 2.0, 1.0, 20.0, 3.0, 2.0, 3.0, 30.0;
  const auto factor = make_planar_pose_factor(1, 2, in_plane(1.0, 2.0, 3.0), information, PlanarError::kCoordinates);
  const gtsam::Pose2 from(0.3, -0.2, 2.9);
  // The heading goes over half a turn.
  const gtsam::Vector3 error(0.1, -0.2, 0.4);
  const gtsam::Values values = both(from, from * gtsam::Pose2(1.0, 2.0, 3.0) * gtsam::Pose2(0.1, -0.2, 0.4));
  EXPECT_NEAR(factor->error(values), 0.5 * error.dot(information * error), 1e-12);
}

TEST(PlanarPoseFactor, GradientIsThatOfItsCost) {
  Eigen::Matrix3d information;
  information << 10.0, 1.0, 2.0, 1.0, 20.0, 3.0, 2.0, 3.0, 30.0;
  const gtsam::Values values = both(gtsam::Pose2(0.3, -0.2, 0.5), gtsam::Pose2(1.4, 2.6, 1.6));
  constexpr double kStep = 1e-6;
  for (const PlanarError error : {PlanarError::kLogarithm, PlanarError::kCoordinates}) {
    const auto factor = make_planar_pose_factor(1, 2, in_plane(1.0, 2.0, 0.7), information, error);
    const auto gradient = factor->linearize(values)->gradientAtZero();
    for (const gtsam::Key key : {1, 2}) {
      for (int axis = 0; axis < 3; ++axis) {
        const double ahead = error_at(*factor, values, key, axis, kStep);
        const double behind = error_at(*factor, values, key, axis, -kStep);
        EXPECT_NEAR(gradient.at(key)(axis), (ahead - behind) / (2.0 * kStep), 1e-6) << key << ", " << axis;
      }
    }
  }
}

TEST(PlanarPoseFactor, SaysNothingOfADirectionWithoutInformation) {
  const Eigen::Matrix3d information = Eigen::Vector3d(4.0, 0.0, 9.0).asDiagonal();
  const auto factor = make_planar_pose_factor(1, 2, in_plane(1.0, 0.0, 0.0), information, PlanarError::kLogarithm);
  EXPECT_EQ(factor->dim(), 2U);
  EXPECT_NEAR(factor->error(both(gtsam::Pose2(), gtsam::Pose2(1.0, 7.0, 0.0))), 0.0, 1e-15);
}

}  // namespace
}  // namespace ignis
