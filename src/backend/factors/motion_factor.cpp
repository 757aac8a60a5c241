// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/motion_factor.h"

#include <gtsam/navigation/ImuBias.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

namespace ignis {
namespace {

using gtsam::imuBias::ConstantBias;

class MotionFactor : public gtsam::NoiseModelFactorN<gtsam::Vector3, ConstantBias> {
 public:
  MotionFactor(gtsam::Key velocity, gtsam::Key bias, const Motion& motion)
      : NoiseModelFactorN(gtsam::noiseModel::Gaussian::Covariance(motion.covariance), velocity, bias),
        mean_(motion.mean) {}

  gtsam::NonlinearFactor::shared_ptr clone() const override { return boost::make_shared<MotionFactor>(*this); }

  gtsam::Vector evaluateError(const gtsam::Vector3& velocity, const ConstantBias& bias,
                              boost::optional<gtsam::Matrix&> H_velocity,
                              boost::optional<gtsam::Matrix&> H_bias) const override {
    if (H_velocity) *H_velocity = gtsam::Matrix::Identity(9, 3);
    if (H_bias) {
      H_bias->setZero(9, 6);
      H_bias->bottomRows<6>().setIdentity();
    }
    gtsam::Vector9 motion;
    motion << velocity, bias.vector();
    return motion - mean_;
  }

 private:
  gtsam::Vector9 mean_;
};

}  // namespace

boost::shared_ptr<gtsam::NonlinearFactor> make_motion_factor(std::uint64_t velocity_key, std::uint64_t bias_key,
                                                             const Motion& motion) {
  return boost::make_shared<MotionFactor>(velocity_key, bias_key, motion);
}

}  // namespace ignis
