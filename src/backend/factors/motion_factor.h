// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/shared_ptr.hpp>
#include <cstdint>

#include <Eigen/Core>

namespace gtsam {
class NonlinearFactor;
}

namespace ignis {

/// What is known of a keyframe's velocity and biases together. Order: velocity [m/s, map axes], accelerometer bias
/// [m/s^2], gyro bias [rad/s], body axes.
struct Motion {
  Eigen::Vector<double, 9> mean = Eigen::Vector<double, 9>::Zero();
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Identity();
};

/// Holds a velocity and a bias variable to it. Exact: both are vectors. The covariance must be positive definite.
[[nodiscard]] boost::shared_ptr<gtsam::NonlinearFactor> make_motion_factor(std::uint64_t velocity_key,
                                                                           std::uint64_t bias_key,
                                                                           const Motion& motion);

}  // namespace ignis
