// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/LU>

#include "frontend/filter/eskf.h"

namespace ignis {

/// Kalman update with a few measured numbers, in Joseph form, so that the covariance stays positive (R. Bucy, P.
/// Joseph, "Filtering for stochastic processes", 1968). `residual`: what the filter believes minus what was measured;
/// rows of `derivative` by the error of the state; independent `variance` of each number. What `learns` is zero for is
/// considered and learns nothing (S. Schmidt, "Application of state-space methods to navigation problems", 1966).
template <int kRows>
void kalman_step(FilterState& filter, const Eigen::Matrix<double, kRows, 1>& residual,
                 const Eigen::Matrix<double, kRows, kErrorSize>& derivative,
                 const Eigen::Matrix<double, kRows, 1>& variance, const ErrorVector& learns = ErrorVector::Ones()) {
  const auto& H = derivative;
  const Eigen::Matrix<double, kRows, kRows> R = variance.asDiagonal();
  const ErrorCovariance& P = filter.covariance;
  const Eigen::Matrix<double, kErrorSize, kRows> K =
      learns.asDiagonal() * P * H.transpose() * (H * P * H.transpose() + R).inverse();
  const ErrorCovariance kept = ErrorCovariance::Identity() - K * H;
  filter.covariance = kept * P * kept.transpose() + K * R * K.transpose();
  filter.covariance = (0.5 * (filter.covariance + filter.covariance.transpose())).eval();
  filter.nominal = perturbed(filter.nominal, (-K * residual).eval());
}

}  // namespace ignis
