// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "common/byte_codec.h"
#include "common/keyframe.h"

/// Bytes of what the sensors and the filter hand on: one function per struct, in the order of its members, for both
/// directions (byte_codec.h).
namespace ignis {

void transfer(auto& io, FieldsOf<Pose> auto& pose) {
  io.matrix(pose.rotation.coeffs());
  io.matrix(pose.translation);
}

void transfer(auto& io, FieldsOf<NavState> auto& state) {
  io.number(state.utime);
  transfer(io, state.T_odom_body);
  io.matrix(state.v_odom);
  io.matrix(state.gyro_bias);
  io.matrix(state.accel_bias);
  io.matrix(state.angular_rate);
  io.matrix(state.gravity_tilt);
}

void transfer(auto& io, FieldsOf<CloudPoint> auto& point) {
  io.matrix(point.position);
  io.number(point.intensity);
}

void transfer(auto& io, FieldsOf<std::vector<CloudPoint>> auto& cloud) { io.list(cloud); }

void transfer(auto& io, FieldsOf<ImuSample> auto& sample) {
  io.number(sample.utime);
  io.number(sample.sequence);
  io.matrix(sample.gyro);
  io.matrix(sample.accel);
  io.number(sample.saturated);
}

void transfer(auto& io, FieldsOf<SightedSpeed> auto& sighted) {
  io.matrix(sighted.axis);
  io.number(sighted.speed);
  io.number(sighted.variance);
}

void transfer(auto& io, FieldsOf<Keyframe> auto& keyframe) {
  io.number(keyframe.id);
  io.number(keyframe.session);
  transfer(io, keyframe.state);
  io.matrix(keyframe.covariance);
  io.matrix(keyframe.scan_information);
  io.maybe(keyframe.sighted);
  io.number(keyframe.previous_utime);
  io.number(keyframe.stationary);
  io.number(keyframe.imu_complete);
  io.list(keyframe.imu);
  io.list(keyframe.cloud);
}

}  // namespace ignis
