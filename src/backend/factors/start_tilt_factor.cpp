// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/start_tilt_factor.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/navigation/ImuBias.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

#include <Eigen/Geometry>

#include "backend/factors/gtsam_conversion.h"

namespace ignis {
namespace {

using gtsam::imuBias::ConstantBias;

class StartTiltFactor : public gtsam::NoiseModelFactorN<gtsam::Pose3, ConstantBias> {
 public:
  StartTiltFactor(gtsam::Key pose, gtsam::Key bias, const NavState& start, double gravity, double sigma)
      : NoiseModelFactorN(gtsam::noiseModel::Isotropic::Sigma(2, sigma), pose, bias),
        up_map_(0.0, gravity, 0.0),
        force_(start.T_odom_body.rotation.conjugate() * up_map_ + start.accel_bias) {
    const Eigen::Vector3d up_body = start.T_odom_body.rotation.conjugate() * Eigen::Vector3d::UnitY();
    across_.row(0) = up_body.unitOrthogonal().transpose();
    across_.row(1) = up_body.cross(up_body.unitOrthogonal()).transpose();
  }

  gtsam::NonlinearFactor::shared_ptr clone() const override { return boost::make_shared<StartTiltFactor>(*this); }

  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_body, const ConstantBias& bias,
                              boost::optional<gtsam::Matrix&> H_pose,
                              boost::optional<gtsam::Matrix&> H_bias) const override {
    gtsam::Matrix3 by_turn;
    const gtsam::Vector3 up_body = T_map_body.rotation().unrotate(up_map_, by_turn);
    if (H_pose) {
      H_pose->setZero(2, 6);
      H_pose->leftCols<3>() = across_ * by_turn;
    }
    if (H_bias) {
      H_bias->setZero(2, 6);
      H_bias->leftCols<3>() = across_;  // GTSAM's order: accelerometer, gyroscope
    }
    return across_ * (up_body + bias.accelerometer() - force_);
  }

 private:
  gtsam::Vector3 up_map_;               ///< [m/s^2] specific force at rest
  gtsam::Vector3 force_;                ///< [m/s^2] what the start read, body axes
  Eigen::Matrix<double, 2, 3> across_;  ///< unit vectors across the start's vertical, body axes
};

}  // namespace

boost::shared_ptr<gtsam::NonlinearFactor> make_start_tilt_factor(std::uint64_t pose_key, std::uint64_t bias_key,
                                                                 const NavState& start, double gravity, double sigma) {
  return boost::make_shared<StartTiltFactor>(pose_key, bias_key, start, gravity, sigma);
}

}  // namespace ignis
