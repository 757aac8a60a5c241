// SPDX-License-Identifier: Apache-2.0
#include "messages/odometry_messages.h"

#include <algorithm>

#include "common/frames.h"
#include "messages/field_copy.h"

namespace ignis::messages {
namespace {

void store_attitude_for_people(const NavState& state, state_t& message) {
  const frames::YawPitchRoll attitude = frames::to_yaw_pitch_roll(state.T_odom_body.rotation);
  message.yaw = attitude.yaw;
  message.pitch = attitude.pitch;
  message.roll = attitude.roll;
  const Eigen::Vector3d velocity = frames::right_up_forward(state.T_odom_body.rotation, state.v_odom);
  message.velocity_right = velocity.x();
  message.velocity_up = velocity.y();
  message.velocity_forward = velocity.z();
}

}  // namespace

state_t to_message(const NavState& state, std::int32_t session, const std::string& frame, const Matrix15d* covariance) {
  state_t message{};
  message.utime = state.utime;
  message.session = session;
  message.frame = frame;
  store(state.T_odom_body.translation, message.position);
  store(state.T_odom_body.rotation, message.quaternion);
  store(state.v_odom, message.velocity);
  store_attitude_for_people(state, message);
  store(state.angular_rate, message.angular_rate);
  store(state.gyro_bias, message.gyro_bias);
  store(state.accel_bias, message.accel_bias);
  if (covariance != nullptr) {
    message.covariance_valid = 1;
    message.num_covariance = static_cast<std::int32_t>(covariance->size());
    for (int row = 0; row < 15; ++row) {
      for (int column = 0; column < 15; ++column) message.covariance.push_back((*covariance)(row, column));
    }
  }
  return message;
}

NavState from_message(const state_t& message) {
  NavState state;
  state.utime = message.utime;
  state.T_odom_body = {load(message.quaternion), load(message.position)};
  state.v_odom = load(message.velocity);
  state.gyro_bias = load(message.gyro_bias);
  state.accel_bias = load(message.accel_bias);
  state.angular_rate = load(message.angular_rate);
  return state;
}

scan_stats_t to_message(const ScanStats& stats) {
  scan_stats_t message{};
  message.utime = stats.utime;
  message.scan_sequence = stats.scan_sequence;
  message.session = stats.session;
  message.applied = stats.applied() ? 1 : 0;
  message.reason = static_cast<std::int8_t>(stats.reason);
  message.reason_text = explanation(stats);
  message.points = stats.points;
  message.matched = stats.matched;
  message.used = stats.used;
  message.mean_innovation = stats.mean_innovation;
  message.mean_residual = stats.mean_residual;
  message.correction_m = stats.correction_m;
  message.correction_rad = stats.correction_rad;
  message.velocity_correction = stats.velocity_correction;
  store(stats.observability, message.observability);
  message.degenerate_directions = static_cast<std::int8_t>(stats.degenerate_directions);
  message.nis = stats.nis;
  message.nis_directions = static_cast<std::int8_t>(stats.nis_directions);
  message.standing = stats.standing ? 1 : 0;
  message.imu_disagreement = stats.imu_disagreement;
  store(stats.T_odom_body.translation, message.position);
  store(stats.T_odom_body.rotation, message.quaternion);
  message.map_points = stats.map_points;
  return message;
}

ScanStats from_message(const scan_stats_t& message) {
  ScanStats stats;
  stats.utime = message.utime;
  stats.scan_sequence = message.scan_sequence;
  stats.session = message.session;
  stats.reason = static_cast<ScanReason>(message.reason);
  stats.points = message.points;
  stats.matched = message.matched;
  stats.used = message.used;
  stats.mean_innovation = message.mean_innovation;
  stats.mean_residual = message.mean_residual;
  stats.correction_m = message.correction_m;
  stats.correction_rad = message.correction_rad;
  stats.velocity_correction = message.velocity_correction;
  stats.observability = load(message.observability);
  stats.degenerate_directions = message.degenerate_directions;
  stats.nis = message.nis;
  stats.nis_directions = message.nis_directions;
  stats.standing = message.standing != 0;
  stats.imu_disagreement = message.imu_disagreement;
  stats.T_odom_body = {load(message.quaternion), load(message.position)};
  stats.map_points = message.map_points;
  return stats;
}

std::vector<cloud_t> to_messages(const PosedCloud& cloud) {
  const std::int64_t total = std::ssize(cloud.points);
  const std::int64_t part_count = std::max<std::int64_t>(1, (total + kMaxPointsPerPart - 1) / kMaxPointsPerPart);
  std::vector<cloud_t> parts;
  parts.reserve(static_cast<std::size_t>(part_count));
  for (std::int64_t part = 0; part < part_count; ++part) {
    cloud_t& message = parts.emplace_back();
    message.utime = cloud.utime;
    message.sequence = cloud.sequence;
    message.part = static_cast<std::int16_t>(part);
    message.part_count = static_cast<std::int16_t>(part_count);
    message.session = cloud.session;
    message.applied = cloud.applied ? 1 : 0;
    store(cloud.T_odom_body.translation, message.position);
    store(cloud.T_odom_body.rotation, message.quaternion);
    const std::int64_t begin = part * kMaxPointsPerPart;
    const std::int64_t end = std::min(total, begin + kMaxPointsPerPart);
    message.num_points = static_cast<std::int32_t>(end - begin);
    for (std::int64_t i = begin; i < end; ++i) {
      const CloudPoint& point = cloud.points[static_cast<std::size_t>(i)];
      message.x.push_back(point.position.x());
      message.y.push_back(point.position.y());
      message.z.push_back(point.position.z());
      message.intensity.push_back(point.intensity);
    }
  }
  return parts;
}

std::optional<PosedCloud> CloudAssembler::add(const cloud_t& part) {
  const std::optional<std::vector<cloud_t>> parts = parts_.add(part);
  if (!parts) return std::nullopt;
  const cloud_t& first = parts->front();
  PosedCloud cloud{.utime = first.utime,
                   .sequence = first.sequence,
                   .session = first.session,
                   .applied = first.applied != 0,
                   .T_odom_body = {load(first.quaternion), load(first.position)},
                   .points = {}};
  for (const cloud_t& each : *parts) {
    for (std::size_t i = 0; i < each.x.size(); ++i) {
      cloud.points.push_back({.position = {each.x[i], each.y[i], each.z[i]}, .intensity = each.intensity[i]});
    }
  }
  return cloud;
}

pose_t ground_truth_message(Utime utime, const Pose& T_world_body, const Eigen::Vector3d& v_world) {
  pose_t message{};
  message.utime = utime;
  store(T_world_body.translation, message.position);
  store(T_world_body.rotation, message.quaternion);
  store(v_world, message.velocity);
  return message;
}

}  // namespace ignis::messages
