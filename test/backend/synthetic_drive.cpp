// SPDX-License-Identifier: Apache-2.0
#include "backend/synthetic_drive.h"

#include <array>
#include <cmath>
#include <random>

#include "backend/keyframes/odometry_chain.h"
#include "common/so3.h"

namespace ignis::testing {
namespace {

constexpr double kGravity = 9.81;
constexpr double kSensorRange = 15.0;
constexpr double kSurfaceNoise = 0.01;

Eigen::Vector3d gaussian(std::mt19937& random, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  const double x = normal(random);
  const double y = normal(random);
  return {x, y, normal(random)};
}

Pose true_pose(const DriveOptions& o, double t) {
  const double yaw = o.turn_rate * t;
  const double radius = o.speed / o.turn_rate;
  return {so3::exp({0.0, yaw, 0.0}), {radius * (std::cos(yaw) - 1.0), 0.0, -radius * std::sin(yaw)}};
}

Eigen::Vector3d true_velocity(const DriveOptions& o, double t) {
  return so3::exp({0.0, o.turn_rate * t, 0.0}) * Eigen::Vector3d(0.0, 0.0, -o.speed);
}

std::vector<ImuSample> imu_between(const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel, Utime start, Utime end,
                                   const DriveOptions& o, std::mt19937& random) {
  const auto step = to_micros(1.0 / o.imu_rate_hz);
  const double per_sample = std::sqrt(o.imu_rate_hz);
  std::vector<ImuSample> samples;
  for (Utime utime = start; utime < end; utime += step) {
    ImuSample sample;
    sample.utime = utime;
    sample.gyro = gyro + gaussian(random, o.gyro_noise * per_sample);
    sample.accel = accel + gaussian(random, o.accel_noise * per_sample);
    samples.push_back(sample);
  }
  return samples;
}

Matrix6d information(const DriveOptions& o) {
  Vector6d diagonal;
  diagonal << Eigen::Vector3d::Constant(1.0 / (o.odometry_sigma_rad * o.odometry_sigma_rad)),
      Eigen::Vector3d::Constant(1.0 / (o.odometry_sigma_m * o.odometry_sigma_m));
  return diagonal.asDiagonal();
}

/// A rectangle corner + u edge_u + v edge_v with 0 <= u, v <= 1.
struct Surface {
  Eigen::Vector3d corner;
  Eigen::Vector3d edge_u;
  Eigen::Vector3d edge_v;
};

/// The circle's centre is (-10, 0, 0). No two views are alike: the hall is oblong and the pillars stand unevenly.
std::vector<Surface> hall() {
  std::vector<Surface> surfaces = {{{-28.0, -0.5, -20.0}, {34.0, 0.0, 0.0}, {0.0, 0.0, 41.0}},  // floor
                                   {{-28.0, -0.5, -20.0}, {34.0, 0.0, 0.0}, {0.0, 4.0, 0.0}},
                                   {{-28.0, -0.5, 21.0}, {34.0, 0.0, 0.0}, {0.0, 4.0, 0.0}},
                                   {{-28.0, -0.5, -20.0}, {0.0, 0.0, 41.0}, {0.0, 4.0, 0.0}},
                                   {{6.0, -0.5, -20.0}, {0.0, 0.0, 41.0}, {0.0, 4.0, 0.0}}};
  const std::array<std::array<double, 2>, 6> pillars = {
      {{-4.0, -3.0}, {-15.0, 2.0}, {-9.0, 5.0}, {2.5, 8.0}, {-24.0, -7.0}, {-12.0, -14.0}}};
  for (const auto& [x, z] : pillars) {
    for (const auto& [dx, dz] : {std::array{0.0, 0.0}, std::array{0.0, 1.5}}) {
      surfaces.push_back({{x + dx, -0.5, z + dz}, {2.0, 0.0, 0.0}, {0.0, 4.0, 0.0}});
    }
    for (const double dx : {0.0, 2.0}) surfaces.push_back({{x + dx, -0.5, z}, {0.0, 0.0, 1.5}, {0.0, 4.0, 0.0}});
  }
  return surfaces;
}

}  // namespace

std::vector<CloudPoint> hall_cloud(const Pose& T_world_body, int points, unsigned seed) {
  const std::vector<Surface> surfaces = hall();
  std::vector<double> areas;
  for (const Surface& s : surfaces) areas.push_back(s.edge_u.cross(s.edge_v).norm());
  std::mt19937 random(seed);
  std::discrete_distribution<std::size_t> pick(areas.begin(), areas.end());
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const Pose T_body_world = T_world_body.inverse();
  std::vector<CloudPoint> cloud;
  while (static_cast<int>(cloud.size()) < points) {
    const Surface& s = surfaces[pick(random)];
    const double u = unit(random);
    const double v = unit(random);
    const Eigen::Vector3d p_body =
        T_body_world * Eigen::Vector3d(s.corner + u * s.edge_u + v * s.edge_v + gaussian(random, kSurfaceNoise));
    if (p_body.norm() < kSensorRange) cloud.push_back({p_body.cast<float>(), 100.0F});
  }
  return cloud;
}

/// Of the last pose of a chain of independent steps, as a front end states it: attitude in body, position in odom axes.
void follow_step(Matrix15d& covariance, const Pose& T_previous_this, const Pose& T_odom_body, const DriveOptions& o) {
  const auto rotated = [](const Eigen::Quaterniond& rotation) {
    Matrix6d to_axes = Matrix6d::Identity();
    to_axes.bottomRightCorner<3, 3>() = rotation.toRotationMatrix();
    return to_axes;
  };
  const Eigen::Quaterniond R_odom_previous = T_odom_body.rotation * T_previous_this.rotation.conjugate();
  const Matrix6d step =
      rotated(T_odom_body.rotation) * adjoint(T_previous_this.inverse()) * rotated(R_odom_previous.conjugate());
  Vector6d noise;
  noise << Eigen::Vector3d::Constant(o.odometry_sigma_rad), Eigen::Vector3d::Constant(o.odometry_sigma_m);
  const Matrix6d pose = step * covariance.topLeftCorner<6, 6>() * step.transpose();
  covariance.topLeftCorner<6, 6>() = pose + Matrix6d(noise.cwiseAbs2().asDiagonal());
}

Drive make_drive(const DriveOptions& o) {
  std::mt19937 random(o.seed);
  Matrix15d covariance = 1e-4 * Matrix15d::Identity();
  covariance.topLeftCorner<6, 6>().setZero();
  const Eigen::Vector3d gyro(0.0, o.turn_rate, 0.0);
  const Eigen::Vector3d accel(-o.speed * o.turn_rate, kGravity, 0.0);
  Drive drive;
  Pose T_odom_body;
  for (int i = 0; i < o.keyframes; ++i) {
    const double t = i * o.interval_s;
    drive.T_world_body.push_back(true_pose(o, t));
    Keyframe keyframe;
    keyframe.id = i;
    keyframe.state.utime = 1'000'000 + to_micros(t);
    keyframe.previous_utime = keyframe.state.utime;
    if (i > 0) {
      Vector6d noise;
      noise << gaussian(random, o.odometry_sigma_rad), gaussian(random, o.odometry_sigma_m);
      const Pose T_previous_this =
          drive.T_world_body[static_cast<std::size_t>(i) - 1].inverse() * drive.T_world_body.back();
      // As a front end does: along the way that it believes in. Along the true one the covariance would seem to grow by
      // more than the steps' noise, and the chain of odometry would doubt itself the more the longer the drive.
      const Pose believed = perturbed_in_body(T_previous_this, noise);
      T_odom_body = T_odom_body * believed;
      follow_step(covariance, believed, T_odom_body, o);
      keyframe.previous_utime = drive.keyframes.back().state.utime;
      keyframe.imu = imu_between(gyro, accel, keyframe.previous_utime, keyframe.state.utime, o, random);
      keyframe.scan_information = information(o);
    }
    keyframe.covariance = covariance;
    keyframe.state.T_odom_body = T_odom_body;
    const Pose T_odom_world = T_odom_body * drive.T_world_body.back().inverse();
    keyframe.state.v_odom = T_odom_world.rotation * true_velocity(o, t);
    if (o.cloud_points > 0) {
      keyframe.cloud = hall_cloud(drive.T_world_body.back(), o.cloud_points, o.seed + 1000U + static_cast<unsigned>(i));
    }
    drive.keyframes.push_back(std::move(keyframe));
  }
  return drive;
}

std::vector<Keyframe> make_rest(int count, unsigned seed) {
  std::mt19937 random(seed);
  DriveOptions o;
  std::vector<Keyframe> keyframes;
  for (int i = 0; i < count; ++i) {
    Keyframe keyframe;
    keyframe.id = i;
    keyframe.stationary = true;
    keyframe.covariance = 1e-4 * Matrix15d::Identity();
    keyframe.state.utime = i * kMicrosPerSecond;
    keyframe.previous_utime = i > 0 ? keyframe.state.utime - kMicrosPerSecond : keyframe.state.utime;
    keyframe.imu = imu_between(Eigen::Vector3d::Zero(), {0.0, kGravity, 0.0}, keyframe.previous_utime,
                               keyframe.state.utime, o, random);
    keyframes.push_back(std::move(keyframe));
  }
  return keyframes;
}

double position_error(const std::vector<Pose>& estimate, const std::vector<Pose>& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    sum += (estimate[i].translation - truth[i].translation).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(estimate.size()));
}

}  // namespace ignis::testing
