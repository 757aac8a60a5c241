// SPDX-License-Identifier: Apache-2.0
#include "backend/slipped_drive.h"

#include <utility>

namespace ignis::testing {
namespace {

constexpr double kInterval = 1.5;  // [s]
constexpr int kCloudPoints = 4000;

Drive lap(const SlipOptions& o, unsigned seed) {
  return make_drive({.seed = seed,
                     .keyframes = o.keyframes,
                     .speed = o.speed,
                     .turn_rate = o.turn_rate,
                     .interval_s = kInterval,
                     .cloud_points = kCloudPoints});
}

Keyframe blind(const Pose& T_odom_body) {
  Keyframe keyframe;
  keyframe.state.T_odom_body = T_odom_body;
  keyframe.covariance = 1e-4 * Matrix15d::Identity();
  keyframe.imu_complete = false;
  return keyframe;
}

void append(Keyframe keyframe, const Pose& T_world_body, Drive& drive) {
  const Keyframe& last = drive.keyframes.back();
  keyframe.id = last.id + 1;
  keyframe.previous_utime = last.state.utime;
  const Utime shift = last.state.utime + to_micros(kInterval) - keyframe.state.utime;
  keyframe.state.utime += shift;
  for (ImuSample& sample : keyframe.imu) sample.utime += shift;
  drive.keyframes.push_back(std::move(keyframe));
  drive.T_world_body.push_back(T_world_body);
}

}  // namespace

Drive make_slipped_drive(const SlipOptions& o) {
  Drive drive = lap(o, o.seed);
  Drive second = lap(o, o.seed + 500U);
  Pose T_world_hall;
  T_world_hall.translation = o.second_hall;
  const Pose T_world_left = drive.T_world_body.back();
  const Pose T_world_entered = T_world_hall * second.T_world_body.front();
  const Pose T_odom_world = drive.keyframes.back().state.T_odom_body * T_world_left.inverse();
  Pose T_odom_slipped = T_odom_world;
  for (int i = 1; i <= o.blind_keyframes; ++i) {
    const double ratio = static_cast<double>(i) / o.blind_keyframes;
    const Pose T_world_body = interpolate(T_world_left, T_world_entered, ratio);
    T_odom_slipped.translation = T_odom_world.translation + T_odom_world.rotation * (ratio * o.slip);
    Keyframe keyframe = blind(T_odom_slipped * T_world_body);
    if (i == o.blind_keyframes) {  // the first of the second lap
      keyframe.cloud = second.keyframes.front().cloud;
      keyframe.state.v_odom = T_odom_slipped.rotation * second.keyframes.front().state.v_odom;
    }
    append(std::move(keyframe), T_world_body, drive);
  }
  const Pose T_odom_start = drive.keyframes.back().state.T_odom_body;
  for (std::size_t i = 1; i < second.keyframes.size(); ++i) {
    Keyframe keyframe = std::move(second.keyframes[i]);
    keyframe.state.T_odom_body = T_odom_start * keyframe.state.T_odom_body;
    keyframe.state.v_odom = T_odom_start.rotation * keyframe.state.v_odom;
    append(std::move(keyframe), T_world_hall * second.T_world_body[i], drive);
  }
  return drive;
}

}  // namespace ignis::testing
