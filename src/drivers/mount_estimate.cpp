// SPDX-License-Identifier: Apache-2.0
#include "drivers/mount_estimate.h"

#include <cmath>
#include <format>
#include <numbers>
#include <random>

#include <Eigen/Eigenvalues>

#include "common/frames.h"

namespace ignis::l1 {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kTrials = 400;
constexpr double kInlierM = 0.05;
constexpr double kLeastHeightM = 0.05;
constexpr std::int64_t kLeastPoints = 200;
constexpr double kGravity = 9.81;
/// Of a consumer unit with its scale and bias errors; the L1's own spread was 9.70 to 10.38 m/s^2 on three units.
constexpr double kGravityBand = 0.7;
constexpr double kRestGyroMean = 0.05;   // rad/s
constexpr double kRestGyroSigma = 0.1;   // rad/s
constexpr double kRestAccelSigma = 1.5;  // m/s^2; the rotor shakes the housing
constexpr double kWrongAxesDeg = 60.0;

/// Points n . p = offset of the candidate plane.
struct Candidate {
  Eigen::Vector3d normal;
  double offset;
};

bool on_plane(const Candidate& plane, const Eigen::Vector3d& point) {
  return std::abs(plane.normal.dot(point) - plane.offset) < kInlierM;
}

std::int64_t consensus(const Candidate& plane, const std::vector<Eigen::Vector3d>& points) {
  std::int64_t count = 0;
  for (const Eigen::Vector3d& point : points) count += on_plane(plane, point) ? 1 : 0;
  return count;
}

/// Turned upward; nothing when it is too steep or not below the sensor.
std::optional<Candidate> as_floor(Eigen::Vector3d normal, const Eigen::Vector3d& point, const Eigen::Vector3d& up,
                                  double least_cosine) {
  if (normal.norm() < 1e-6) return std::nullopt;
  normal.normalize();
  if (normal.dot(up) < 0.0) normal = -normal;
  const double offset = normal.dot(point);
  if (normal.dot(up) < least_cosine || offset > -kLeastHeightM) return std::nullopt;
  return Candidate{normal, offset};
}

Floor refined(const Candidate& plane, const std::vector<Eigen::Vector3d>& points) {
  Floor floor;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points) {
    if (!on_plane(plane, point)) continue;
    ++floor.points;
    mean += point;
    moment += point * point.transpose();
  }
  const auto count = static_cast<double>(floor.points);
  mean /= count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moment / count - mean * mean.transpose());
  floor.up_sensor = solver.eigenvectors().col(0);
  if (floor.up_sensor.dot(plane.normal) < 0.0) floor.up_sensor = -floor.up_sensor;
  floor.height_m = -floor.up_sensor.dot(mean);
  floor.roughness_m = std::sqrt(std::max(solver.eigenvalues().x(), 0.0));
  return floor;
}

Eigen::Vector3d to_vector(const std::array<float, 3>& values) {
  return Eigen::Vector3f(values[0], values[1], values[2]).cast<double>();
}

}  // namespace

RestingImu resting_imu(const std::vector<ImuAttitude>& samples) {
  RestingImu imu;
  imu.samples = std::ssize(samples);
  const auto count = static_cast<double>(std::max<std::int64_t>(imu.samples, 1));
  for (const ImuAttitude& sample : samples) {
    imu.mean_accel += to_vector(sample.accel) / count;
    imu.mean_gyro += to_vector(sample.gyro) / count;
  }
  Eigen::Array3d accel_variance = Eigen::Array3d::Zero();
  Eigen::Array3d gyro_variance = Eigen::Array3d::Zero();
  for (const ImuAttitude& sample : samples) {
    accel_variance += (to_vector(sample.accel) - imu.mean_accel).array().square() / count;
    gyro_variance += (to_vector(sample.gyro) - imu.mean_gyro).array().square() / count;
  }
  imu.sigma_accel = accel_variance.sqrt();
  imu.sigma_gyro = gyro_variance.sqrt();
  return imu;
}

Tilt tilt_from_up(const Eigen::Vector3d& up_sensor, const Mount& mount) {
  Mount level = mount;
  level.yaw_deg = level.pitch_deg = level.roll_deg = 0.0;
  const Eigen::Vector3d up_level = level.T_body_sensor().rotation * up_sensor;
  const frames::YawPitchRoll turn =
      frames::to_yaw_pitch_roll(Eigen::Quaterniond::FromTwoVectors(up_level, frames::up()));
  return {turn.pitch / kDegree, turn.roll / kDegree};
}

std::optional<Floor> find_floor(const std::vector<Eigen::Vector3d>& points_sensor, const Eigen::Vector3d& up_hint,
                                double most_tilt_deg) {
  if (std::ssize(points_sensor) < kLeastPoints) return std::nullopt;
  const Eigen::Vector3d up = up_hint.normalized();
  const double least_cosine = std::cos(most_tilt_deg * kDegree);
  std::mt19937 random(1);
  const auto pick = [&] { return points_sensor[random() % points_sensor.size()]; };
  std::optional<Candidate> best;
  std::int64_t most = kLeastPoints - 1;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Eigen::Vector3d a = pick();
    const Eigen::Vector3d b = pick();
    const Eigen::Vector3d c = pick();
    const auto plane = as_floor((b - a).cross(c - a), a, up, least_cosine);
    if (!plane) continue;
    const std::int64_t count = consensus(*plane, points_sensor);
    if (count <= most) continue;
    most = count;
    best = plane;
  }
  if (!best) return std::nullopt;
  return refined(*best, points_sensor);
}

std::vector<std::string> suspicions(const RestingImu& imu, const Mount& mount) {
  std::vector<std::string> found;
  const double norm = imu.mean_accel.norm();
  if (norm > 0.9 && norm < 1.1) {
    found.push_back(std::format("the accelerometer reads {:.3f} at rest: g instead of m/s^2?", norm));
  } else if (std::abs(norm - kGravity) > kGravityBand) {
    found.push_back(
        std::format("the accelerometer reads {:.2f} m/s^2 at rest, not {:.2f} +- {:.1f}: wrong scale, or a "
                    "damaged unit",
                    norm, kGravity, kGravityBand));
  }
  if (imu.mean_gyro.norm() > kRestGyroMean || imu.sigma_gyro.maxCoeff() > kRestGyroSigma) {
    found.push_back(
        std::format("the gyroscope reads {:.3f} +- {:.3f} rad/s: the vehicle moves, or the unit is degrees "
                    "per second",
                    imu.mean_gyro.norm(), imu.sigma_gyro.maxCoeff()));
  }
  if (imu.sigma_accel.maxCoeff() > kRestAccelSigma) {
    found.push_back(std::format("the accelerometer scatters by {:.2f} m/s^2: the vehicle moves or shakes",
                                imu.sigma_accel.maxCoeff()));
  }
  const Eigen::Vector3d up_body = mount.T_body_sensor().rotation * imu.mean_accel.normalized();
  const double off_deg = std::acos(std::clamp(up_body.y(), -1.0, 1.0)) / kDegree;
  if (off_deg > 180.0 - kWrongAxesDeg) {
    found.push_back(
        std::format("gravity points {:.0f} degrees away from the configured up: the accelerometer's sign is "
                    "turned round (it must read upward at rest), or the sensor hangs upside down",
                    off_deg));
  } else if (off_deg > kWrongAxesDeg) {
    found.push_back(
        std::format("gravity points {:.0f} degrees away from the configured up: axes are swapped, or the "
                    "sensor is mounted otherwise",
                    off_deg));
  }
  return found;
}

}  // namespace ignis::l1
