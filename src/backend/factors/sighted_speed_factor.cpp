// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/sighted_speed_factor.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

#include <cmath>

namespace ignis {
namespace {

class SightedSpeedFactor : public gtsam::NoiseModelFactorN<gtsam::Pose3, gtsam::Vector3> {
 public:
  SightedSpeedFactor(gtsam::Key pose, gtsam::Key velocity, const SightedSpeed& sighted)
      : NoiseModelFactorN(gtsam::noiseModel::Isotropic::Sigma(1, std::sqrt(sighted.variance)), pose, velocity),
        axis_(sighted.axis),
        speed_(sighted.speed) {}

  gtsam::NonlinearFactor::shared_ptr clone() const override { return boost::make_shared<SightedSpeedFactor>(*this); }

  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_body, const gtsam::Vector3& v_map,
                              boost::optional<gtsam::Matrix&> H_pose,
                              boost::optional<gtsam::Matrix&> H_velocity) const override {
    gtsam::Matrix3 by_turn;
    gtsam::Matrix3 by_velocity;
    const gtsam::Vector3 v_body = T_map_body.rotation().unrotate(v_map, by_turn, by_velocity);
    if (H_pose) {
      H_pose->setZero(1, 6);
      H_pose->leftCols<3>() = axis_.transpose() * by_turn;
    }
    if (H_velocity) *H_velocity = axis_.transpose() * by_velocity;
    return gtsam::Vector1(axis_.dot(v_body) - speed_);
  }

 private:
  gtsam::Vector3 axis_;  ///< unit, body axes
  double speed_;         ///< [m/s]
};

}  // namespace

boost::shared_ptr<gtsam::NonlinearFactor> make_sighted_speed_factor(std::uint64_t pose_key, std::uint64_t velocity_key,
                                                                    const SightedSpeed& sighted) {
  return boost::make_shared<SightedSpeedFactor>(pose_key, velocity_key, sighted);
}

}  // namespace ignis
