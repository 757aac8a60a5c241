// SPDX-License-Identifier: Apache-2.0
#include "messages/keyframe_messages.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "common/compact_cloud.h"
#include "messages/field_copy.h"

namespace ignis::messages {
namespace {

// 28 bytes a sample and 7 bytes a point: both slices together stay below 56 kB beside the 2.3 kB of plain fields.
constexpr std::int64_t kMaxImuPerPart = 800;
constexpr std::int64_t kMaxCloudPerPart = 4500;
constexpr std::size_t kMostOpen = 32;  // the answers to two requests

std::int64_t parts_for(std::size_t items, std::int64_t per_part) {
  return (static_cast<std::int64_t>(items) + per_part - 1) / per_part;
}

void store_sighted(const std::optional<SightedSpeed>& sighted, keyframe_t& message) {
  const SightedSpeed nothing{.axis = Eigen::Vector3d::Zero()};
  const SightedSpeed& told = sighted ? *sighted : nothing;
  store(told.axis, message.sighted_axis);
  message.sighted_speed = told.speed;
  message.sighted_sigma = std::sqrt(told.variance);
}

std::optional<SightedSpeed> load_sighted(const keyframe_t& message) {
  SightedSpeed told;
  told.axis = load(message.sighted_axis);
  if (told.axis.isZero(0.0)) return std::nullopt;
  told.speed = message.sighted_speed;
  const double sigma = message.sighted_sigma;
  told.variance = sigma > 0.0 ? sigma * sigma : std::numeric_limits<double>::quiet_NaN();
  return told;
}

keyframe_t plain_fields(const Keyframe& keyframe) {
  keyframe_t message;
  message.utime = keyframe.state.utime;
  message.sequence = keyframe.id;
  message.id = keyframe.id;
  message.session = keyframe.session;
  message.previous_utime = keyframe.previous_utime;
  message.stationary = keyframe.stationary ? 1 : 0;
  message.imu_complete = keyframe.imu_complete ? 1 : 0;
  store(keyframe.state.T_odom_body.translation, message.position);
  store(keyframe.state.T_odom_body.rotation, message.quaternion);
  store(keyframe.state.v_odom, message.velocity);
  store(keyframe.state.gyro_bias, message.gyro_bias);
  store(keyframe.state.accel_bias, message.accel_bias);
  for (int row = 0; row < 15; ++row) {
    for (int column = 0; column < 15; ++column)
      message.covariance[15 * row + column] = keyframe.covariance(row, column);
  }
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      message.scan_information[6 * row + column] = keyframe.scan_information(row, column);
    }
  }
  store_sighted(keyframe.sighted, message);
  message.num_imu = 0;
  message.num_points = 0;
  message.resolution = resolution_for(keyframe.cloud);
  return message;
}

/// Exactly as much room as a part needs: whoever sends keyframes again keeps many of them.
void reserve_slices(std::size_t imu, std::size_t points, keyframe_t& message) {
  message.imu_dt_us.reserve(imu);
  for (auto* values :
       {&message.gyro_x, &message.gyro_y, &message.gyro_z, &message.accel_x, &message.accel_y, &message.accel_z}) {
    values->reserve(imu);
  }
  for (auto* values : {&message.x, &message.y, &message.z}) values->reserve(points);
  message.intensity.reserve(points);
}

/// How many of `items` belong to part i.
std::size_t slice_of(std::size_t items, std::int64_t per_part, std::size_t i) {
  const std::size_t begin = std::min(items, i * static_cast<std::size_t>(per_part));
  return std::min(items - begin, static_cast<std::size_t>(per_part));
}

void append_imu(const ImuSample& sample, keyframe_t& message) {
  ++message.num_imu;
  message.imu_dt_us.push_back(static_cast<std::int32_t>(sample.utime - message.previous_utime));
  message.gyro_x.push_back(static_cast<float>(sample.gyro.x()));
  message.gyro_y.push_back(static_cast<float>(sample.gyro.y()));
  message.gyro_z.push_back(static_cast<float>(sample.gyro.z()));
  message.accel_x.push_back(static_cast<float>(sample.accel.x()));
  message.accel_y.push_back(static_cast<float>(sample.accel.y()));
  message.accel_z.push_back(static_cast<float>(sample.accel.z()));
}

void append_point(const CloudPoint& point, keyframe_t& message) {
  const auto count = [&](float metres) { return static_cast<std::int16_t>(std::lround(metres / message.resolution)); };
  ++message.num_points;
  message.x.push_back(count(point.position.x()));
  message.y.push_back(count(point.position.y()));
  message.z.push_back(count(point.position.z()));
  message.intensity.push_back(static_cast<std::uint8_t>(std::clamp(point.intensity, 0.0F, 255.0F)));
}

NavState state_of(const keyframe_t& message) {
  NavState state;
  state.utime = message.utime;
  state.T_odom_body = {load(message.quaternion), load(message.position)};
  state.v_odom = load(message.velocity);
  state.gyro_bias = load(message.gyro_bias);
  state.accel_bias = load(message.accel_bias);
  return state;
}

void append_slices(const keyframe_t& part, Keyframe& keyframe) {
  for (std::size_t i = 0; i < part.imu_dt_us.size(); ++i) {
    ImuSample& sample = keyframe.imu.emplace_back();
    sample.utime = part.previous_utime + part.imu_dt_us[i];
    sample.gyro = {part.gyro_x[i], part.gyro_y[i], part.gyro_z[i]};
    sample.accel = {part.accel_x[i], part.accel_y[i], part.accel_z[i]};
  }
  for (std::size_t i = 0; i < part.x.size(); ++i) {
    const Eigen::Vector3f counts(part.x[i], part.y[i], part.z[i]);
    keyframe.cloud.push_back(
        {.position = counts * part.resolution, .intensity = static_cast<float>(part.intensity[i])});
  }
}

}  // namespace

std::vector<keyframe_t> to_messages(const Keyframe& keyframe) {
  const std::int64_t part_count = std::max({std::int64_t{1}, parts_for(keyframe.imu.size(), kMaxImuPerPart),
                                            parts_for(keyframe.cloud.size(), kMaxCloudPerPart)});
  std::vector<keyframe_t> parts(static_cast<std::size_t>(part_count), plain_fields(keyframe));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    parts[i].part = static_cast<std::int16_t>(i);
    parts[i].part_count = static_cast<std::int16_t>(part_count);
    reserve_slices(slice_of(keyframe.imu.size(), kMaxImuPerPart, i),
                   slice_of(keyframe.cloud.size(), kMaxCloudPerPart, i), parts[i]);
  }
  for (std::size_t i = 0; i < keyframe.imu.size(); ++i) append_imu(keyframe.imu[i], parts[i / kMaxImuPerPart]);
  for (std::size_t i = 0; i < keyframe.cloud.size(); ++i) append_point(keyframe.cloud[i], parts[i / kMaxCloudPerPart]);
  return parts;
}

KeyframeAssembler::Open& KeyframeAssembler::open_for(const keyframe_t& part) {
  const auto found =
      std::ranges::find_if(open_, [&](const Open& open) { return open.session == part.session && open.id == part.id; });
  if (found == open_.end()) {
    open_.push_back({part.session, part.id, {}});
  } else {
    std::rotate(found, found + 1, open_.end());
  }
  return open_.back();
}

void KeyframeAssembler::drop_one() {
  const auto repeat = std::ranges::find_if(open_, &Open::was_whole);
  if (repeat == open_.end()) ++incomplete_;
  open_.erase(repeat == open_.end() ? open_.begin() : repeat);
}

std::size_t KeyframeAssembler::parts_waiting() const {
  return std::transform_reduce(open_.begin(), open_.end(), std::size_t{0}, std::plus{},
                               [](const Open& open) { return open.parts.waiting(); });
}

std::optional<Keyframe> KeyframeAssembler::add(const keyframe_t& part) {
  Open& open = open_for(part);
  const std::int64_t given_up = open.parts.incomplete();
  const std::optional<std::vector<keyframe_t>> parts = open.parts.add(part);
  incomplete_ += open.parts.incomplete() - given_up;
  if (open.was_whole) ++repeated_;
  open.was_whole |= parts.has_value();
  if (open.parts.waiting() == 0 && !open.was_whole) open_.pop_back();
  while (open_.size() > kMostOpen || parts_waiting() > kMostParts) drop_one();
  if (!parts) return std::nullopt;
  const keyframe_t& first = parts->front();
  Keyframe keyframe;
  keyframe.id = first.id;
  keyframe.session = first.session;
  keyframe.state = state_of(first);
  for (int row = 0; row < 15; ++row) {
    for (int column = 0; column < 15; ++column) keyframe.covariance(row, column) = first.covariance[15 * row + column];
  }
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      keyframe.scan_information(row, column) = first.scan_information[6 * row + column];
    }
  }
  keyframe.sighted = load_sighted(first);
  keyframe.previous_utime = first.previous_utime;
  keyframe.stationary = first.stationary != 0;
  keyframe.imu_complete = first.imu_complete != 0;
  for (const keyframe_t& each : *parts) append_slices(each, keyframe);
  return keyframe;
}

}  // namespace ignis::messages
