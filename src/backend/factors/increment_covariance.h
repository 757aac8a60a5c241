// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "backend/factors/preintegration.h"
#include "common/pose.h"

namespace ignis {

/// Derivatives of a preintegrated increment (rotation vector, position, velocity) over one sample.
struct IncrementStep {
  Eigen::Matrix<double, 9, 9> by_increment;
  Eigen::Matrix<double, 9, 3> by_accel;
  Eigen::Matrix<double, 9, 3> by_gyro;
};

/// Covariance of increment, accelerometer bias and gyro bias, in this order, carried over one sample: F P F^T + noise
/// as gtsam::PreintegratedCombinedMeasurements has it, without the products with zeros, which are most of them. At
/// 250 samples a second these were half of the back end's cost until loops come. `bias_variance` is that of the biases
/// while they integrate.
void carry_over_sample(Matrix15d& covariance, const IncrementStep& step, double dt, const ImuNoise& noise,
                       double bias_variance);

}  // namespace ignis
