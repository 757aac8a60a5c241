// SPDX-License-Identifier: Apache-2.0
#include "backend/solver/conditioned_factor.h"

#include <gtest/gtest.h>
#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/linear/GaussianFactor.h>
#include <gtsam/linear/VectorValues.h>
#include <gtsam/navigation/ImuBias.h>
#include <gtsam/nonlinear/NonlinearFactor.h>
#include <gtsam/nonlinear/Values.h>
#include <gtsam/slam/BetweenFactor.h>

#include "backend/factors/motion_factor.h"

namespace ignis {
namespace {

using gtsam::Pose3;
using gtsam::imuBias::ConstantBias;
using gtsam::symbol_shorthand::B;
using gtsam::symbol_shorthand::V;
using gtsam::symbol_shorthand::X;

gtsam::Values two_poses() {
  gtsam::Values values;
  values.insert(X(0), Pose3(gtsam::Rot3::RzRyRx(0.1, -0.2, 0.3), {1.0, 2.0, 3.0}));
  values.insert(X(1), Pose3(gtsam::Rot3::RzRyRx(0.4, 0.1, -0.3), {2.0, 1.0, 2.0}));
  return values;
}

gtsam::NonlinearFactor::shared_ptr between() {
  return boost::make_shared<gtsam::BetweenFactor<Pose3>>(X(0), X(1),
                                                         Pose3(gtsam::Rot3::Ry(0.2), gtsam::Point3(0.5, -0.5, 1.0)),
                                                         gtsam::noiseModel::Isotropic::Sigma(6, 0.1));
}

gtsam::Values only(gtsam::Key key, const gtsam::Values& from) {
  gtsam::Values values;
  values.insert(key, from.at(key));
  return values;
}

TEST(ConditionedFactor, SaysOfTheOthersWhatTheWholeOneSays) {
  const gtsam::Values both = two_poses();
  for (const auto& [known, open] : {std::pair{X(0), X(1)}, std::pair{X(1), X(0)}}) {
    const auto factor = conditioned(between(), only(known, both));
    ASSERT_TRUE(factor);
    ASSERT_EQ(factor->keys(), gtsam::KeyVector{open});
    const gtsam::Values rest = only(open, both);
    EXPECT_NEAR(factor->error(rest), between()->error(both), 1e-12);
    // An offset of the open one costs the same in both when the other stays.
    gtsam::VectorValues offset;
    offset.insert(open, gtsam::Vector6(0.01, -0.02, 0.03, 0.1, 0.2, -0.1));
    gtsam::VectorValues whole = offset;
    whole.insert(known, gtsam::Vector6::Zero());
    EXPECT_NEAR(factor->linearize(rest)->error(offset), between()->linearize(both)->error(whole), 1e-12);
  }
}

TEST(ConditionedFactor, IsTheSameOneWhereNothingIsKnownAndNoneWhereAllIs) {
  const auto factor = between();
  EXPECT_EQ(conditioned(factor, {}), factor);
  EXPECT_EQ(conditioned(factor, two_poses()), nullptr);
}

TEST(ConditionedFactor, MayBeConditionedAgain) {
  const auto half = conditioned(between(), only(X(0), two_poses()));
  EXPECT_EQ(conditioned(half, two_poses()), nullptr);
}

TEST(MotionFactor, HoldsVelocityAndBiasesTogether) {
  Motion motion;
  motion.mean << 1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 0.01, 0.02, 0.03;
  const Eigen::Matrix<double, 9, 9> root =
      Eigen::Matrix<double, 9, 9>::Identity() + 0.3 * Eigen::Matrix<double, 9, 9>::Ones();
  motion.covariance = root * root.transpose();
  const auto factor = make_motion_factor(V(0), B(0), motion);
  const Eigen::Vector<double, 9> off = Eigen::Vector<double, 9>::LinSpaced(0.1, 0.9);
  gtsam::Values values;
  values.insert(V(0), gtsam::Vector3(motion.mean.head<3>() + off.head<3>()));
  values.insert(B(0), ConstantBias(gtsam::Vector3(motion.mean.segment<3>(3) + off.segment<3>(3)),
                                   gtsam::Vector3(motion.mean.tail<3>() + off.tail<3>())));
  EXPECT_NEAR(factor->error(values), 0.5 * off.dot(motion.covariance.inverse() * off), 1e-9);
  const auto linear = factor->linearize(values);
  gtsam::VectorValues offset;
  offset.insert(V(0), gtsam::Vector3(-off.head<3>()));
  offset.insert(B(0), gtsam::Vector6(-off.tail<6>()));
  EXPECT_NEAR(linear->error(offset), 0.0, 1e-12) << "linear, so one step is the whole way";
}

}  // namespace
}  // namespace ignis
