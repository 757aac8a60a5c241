// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/l1_stream.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/config_check.h"
#include "common/frames.h"
#include "drivers/mavlink_frame.h"
#include "drivers/sim/surface_return.h"

namespace ignis::sim {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
/// From the end of a measurement to its first byte; invented, the real sensor's is not known.
constexpr double kProcessingUs = 300.0;
constexpr double kScanActiveUs = 1e6 / 360.0;
constexpr double kFirstTimeSyncUs = 0.5e6;
constexpr double kTimeSyncPeriodUs = 1e6;
/// From power-up, or from the request, to the first byte; invented.
constexpr double kVersionUs = 1e3;
/// Reported until the host has answered once.
constexpr std::uint32_t kRoundTripUs = 9000;
/// Found in every real recording of the sensor's attitude.
constexpr double kQuaternionNorm = 0.998312;
constexpr double kImuPeriodS = l1::kImuPeriodUs * 1e-6;
constexpr std::uint64_t kLidarSeedOffset = 0x9E3779B97F4A7C15ULL;

const DeviceConfig& checked(const DeviceConfig& device) {
  config::require_valid(device, "device");
  return device;
}

const L1BeamConfig& checked(const LidarConfig& lidar) {
  if (lidar.is_spinning()) {
    throw config::ConfigError(config::Offences{{"lidar.model", '"' + lidar.model + '"', "\"l1\""}});
  }
  return lidar.l1;
}

std::array<float, 3> to_floats(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

Utime StreamFrame::end_utime() const {
  return send_utime + std::llround(l1::kByteTimeUs * static_cast<double>(bytes.size()));
}

L1Stream::L1Stream(const SceneConfig& scene, const Extrinsics& extrinsics, std::uint64_t seed,
                   std::optional<double> max_duration_s, const DeviceConfig& device)
    : lidar_(checked(scene.lidar)),
      device_(checked(device)),
      scene_(make_ray_scene(scene)),
      trajectory_(scene.trajectory),
      T_body_lidar_(extrinsics.lidar.T_body_sensor()),
      T_body_imu_(extrinsics.imu.T_body_sensor()),
      duration_(std::min(trajectory_.duration(), max_duration_s.value_or(kNever))),
      imu_(scene.imu, T_body_imu_, kImuPeriodS, seed),
      random_(seed ^ kLidarSeedOffset),
      power_fails_us_(device.power_cycle_at_s > 0.0 ? device.power_cycle_at_s * 1e6 : kNever),
      sync_delay_us_(kRoundTripUs) {
  schedule_first_frames();
}

void L1Stream::schedule_first_frames() {
  restart_scans(powered_up_us_);
  schedule(kImu, powered_up_us_, powered_up_us_ + kProcessingUs);
  schedule(kTimeSync, powered_up_us_ + kFirstTimeSyncUs, powered_up_us_ + kFirstTimeSyncUs);
  const double version_us = device_.announces_version ? powered_up_us_ + kVersionUs : kNever;
  schedule(kVersion, version_us, version_us);
}

void L1Stream::restart_scans(double first_us) {
  first_scan_ = scan_count_ + (pending_distance_ ? 1 : 0);
  first_scan_us_ = first_us;
  if (!pending_distance_) schedule_scan();
}

void L1Stream::schedule_scan() {
  const double begin_us = first_scan_us_ + static_cast<double>(scan_count_ - first_scan_) * l1::kScanPeriodUs;
  schedule(kScan, begin_us, begin_us + kScanActiveUs + kProcessingUs);
}

void L1Stream::schedule(Source source, double measured_us, double ready_us) {
  measured_us_[source] = measured_us;
  const double end_us = measured_us + (source == kScan ? kScanActiveUs : 0.0);
  ready_us_[source] = end_us <= duration_ * 1e6 ? ready_us : kNever;
}

Motion L1Stream::truth_at(Utime utime) const { return trajectory_.at(static_cast<double>(utime) * 1e-6); }

std::optional<StreamFrame> L1Stream::next_frame() {
  if (power_fails_first()) power_up_again();
  if (pending_distance_) return send_distance();
  const auto earliest = std::min_element(ready_us_.begin(), ready_us_.end());
  if (*earliest == kNever) return std::nullopt;
  switch (static_cast<Source>(earliest - ready_us_.begin())) {
    case kScan:
      return send_auxiliary();
    case kImu:
      return send_imu();
    case kTimeSync:
      return send_time_sync();
    default:
      return send_version();
  }
}

bool L1Stream::power_fails_first() const {
  const double ready_us = pending_distance_ ? ready_us_[kScan] : *std::ranges::min_element(ready_us_);
  return ready_us != kNever && std::max(ready_us, wire_free_us_) >= power_fails_us_;
}

void L1Stream::power_up_again() {
  powered_up_us_ = power_fails_us_ + device_.power_off_s * 1e6;
  power_fails_us_ = kNever;
  pending_distance_.reset();
  frame_sequence_ = 0;
  scan_count_ = 0;
  imu_count_ = 0;
  sync_count_ = 0;
  sync_delay_us_ = kRoundTripUs;
  mode_ = l1::WorkingMode::kNormal;
  schedule_first_frames();
}

void L1Stream::obey(const HostCommand& command, Utime now) {
  if (static_cast<double>(now) < powered_up_us_) return;
  std::visit([&](const auto& each) { obey_one(each, static_cast<double>(now)); }, command);
}

void L1Stream::obey_one(const VersionQuery&, double now_us) {
  if (ready_us_[kVersion] == kNever) schedule(kVersion, now_us, now_us + kVersionUs);
}

void L1Stream::obey_one(const SyncQuery&, double now_us) { schedule(kTimeSync, now_us, now_us); }

void L1Stream::obey_one(const SyncAnswer& answer, double now_us) {
  if (sync_count_ == 0 || answer.count != sync_count_ - 1 || now_us < sync_sent_us_) return;
  sync_delay_us_ = static_cast<std::uint32_t>(std::lround(now_us - sync_sent_us_));
}

void L1Stream::obey_one(const ModeCommand& command, double now_us) {
  if (command.mode == mode_) return;
  mode_ = command.mode;
  if (mode_ == l1::WorkingMode::kNormal) {
    restart_scans(now_us + device_.spin_up_s * 1e6);
  } else if (!pending_distance_) {
    schedule(kScan, kNever, kNever);
  }
}

void L1Stream::obey_one(const LedCommand& command, double) {
  work_status_ = command.mode == l1::LedRing::kTableMode ? 0 : l1::kLedPatternBit;
}

std::uint16_t L1Stream::wire_id(std::int64_t count) const {
  return static_cast<std::uint16_t>(count % device_.id_modulus);
}

StreamFrame L1Stream::send(std::uint32_t id, const l1::Payload& payload, double ready_us, double measured_us) {
  const double begin_us = std::max(ready_us, wire_free_us_);
  const l1::Trim trim = lidar_.trim_payloads ? l1::Trim::kYes : l1::Trim::kNo;
  StreamFrame frame{id, std::llround(begin_us), std::llround(measured_us),
                    l1::encode_frame(id, payload, frame_sequence_++, trim)};
  wire_free_us_ = begin_us + l1::kByteTimeUs * static_cast<double>(frame.bytes.size());
  return frame;
}

StreamFrame L1Stream::send_auxiliary() {
  l1::Auxiliary packet = packet_angles();
  cast_scan(packet);
  if (lidar_.yaw_error_deg > 0.0) {
    packet.yaw_start_deg += static_cast<float>(lidar_.yaw_error_deg * normal_(random_));
  }
  return send(l1::kAuxiliaryId, l1::encode(packet), ready_us_[kScan], measured_us_[kScan]);
}

StreamFrame L1Stream::send_distance() {
  StreamFrame frame = send(l1::kDistanceId, l1::encode(*pending_distance_), ready_us_[kScan], measured_us_[kScan]);
  pending_distance_.reset();
  ++scan_count_;
  if (mode_ == l1::WorkingMode::kNormal) {
    schedule_scan();
  } else {
    schedule(kScan, kNever, kNever);
  }
  return frame;
}

StreamFrame L1Stream::send_imu() {
  const Motion motion = trajectory_.at(measured_us_[kImu] * 1e-6);
  const ImuReading reading = imu_.sample(motion);
  // The unit reports its attitude against a world with Z up and an arbitrary heading.
  const Eigen::Quaterniond q_zup_imu =
      frames::q_body_from_forward_left_up().conjugate() * motion.T_world_body.rotation * T_body_imu_.rotation;
  l1::ImuAttitude message;
  message.quaternion = {
      static_cast<float>(kQuaternionNorm * q_zup_imu.w()), static_cast<float>(kQuaternionNorm * q_zup_imu.x()),
      static_cast<float>(kQuaternionNorm * q_zup_imu.y()), static_cast<float>(kQuaternionNorm * q_zup_imu.z())};
  message.gyro = to_floats(reading.gyro);
  message.accel = to_floats(reading.accel);
  message.packet_id = wire_id(imu_count_);
  StreamFrame frame = send(l1::kImuId, l1::encode(message), ready_us_[kImu], measured_us_[kImu]);
  ++imu_count_;
  const double next_us = powered_up_us_ + static_cast<double>(imu_count_) * l1::kImuPeriodUs;
  schedule(kImu, next_us, next_us + kProcessingUs);
  return frame;
}

StreamFrame L1Stream::send_time_sync() {
  const l1::TimeSync request{.count = sync_count_++, .type = l1::TimeSync::kRequest};
  StreamFrame frame = send(l1::kTimeSyncId, l1::encode(request), ready_us_[kTimeSync], measured_us_[kTimeSync]);
  sync_sent_us_ = static_cast<double>(frame.send_utime);
  const double next_us = measured_us_[kTimeSync] + kTimeSyncPeriodUs;
  schedule(kTimeSync, next_us, next_us);
  return frame;
}

StreamFrame L1Stream::send_version() {
  const l1::Version version{"1.0.1+230601", "1.0.1+230601", "1.0.0", "1.0.0"};
  StreamFrame frame = send(l1::kVersionId, l1::encode(version), ready_us_[kVersion], measured_us_[kVersion]);
  schedule(kVersion, kNever, kNever);
  return frame;
}

l1::Auxiliary L1Stream::packet_angles() const {
  const double t = measured_us_[kScan] * 1e-6;
  const Utime run_time = std::llround(measured_us_[kScan] - powered_up_us_);
  l1::Auxiliary packet;
  packet.sync_delay_us = sync_delay_us_;
  packet.time_s = static_cast<std::uint32_t>(run_time / kMicrosPerSecond);
  packet.time_us = static_cast<std::uint32_t>(run_time % kMicrosPerSecond);
  packet.sys_rotation_period_us = static_cast<std::uint32_t>(std::lround(l1::kScanPeriodUs));
  packet.com_rotation_period_us = static_cast<std::uint32_t>(std::lround(1e6 / lidar_.yaw_rate_hz));
  packet.yaw_start_deg = static_cast<float>(std::fmod(lidar_.yaw_start_deg + 360.0 * lidar_.yaw_rate_hz * t, 360.0));
  packet.yaw_step_deg = static_cast<float>(lidar_.yaw_rate_hz);
  packet.vertical_start_deg = 0.1875F * static_cast<float>(1 + scan_count_ % 8);
  packet.vertical_step_deg = 1.5F;
  packet.apd_temperature = 40.0F;
  packet.imu_temperature = 45.0F;
  packet.up_optical_q = 99.0F;
  packet.down_optical_q = 99.0F;
  packet.apd_voltage = 135.0F;
  packet.b_axis_mm = static_cast<float>(lidar_.b_axis_mm);
  packet.theta_rad = static_cast<float>(lidar_.theta_rad);
  packet.ksi_rad = static_cast<float>(lidar_.ksi_rad);
  packet.packet_id = wire_id(scan_count_);
  packet.work_status = work_status_;
  return packet;
}

void L1Stream::cast_scan(l1::Auxiliary& packet) {
  pending_distance_.emplace();
  pending_distance_->packet_id = packet.packet_id;
  for (std::size_t j = 0; j < l1::kPointsPerPacket; ++j) cast_point(packet, j);
}

void L1Stream::cast_point(l1::Auxiliary& packet, std::size_t j) {
  // Drawn for every point, hit or not, so that a change of the scene does not shift the noise of other points.
  const double noise = lidar_.range_noise_m * normal_(random_);
  const bool lost = uniform_(random_) < lidar_.invalid_fraction;

  const double t = (measured_us_[kScan] + static_cast<double>(j) * l1::kPointPeriodUs) * 1e-6;
  const Pose T_world_lidar = trajectory_.at(t).T_world_body * T_body_lidar_;
  const Ray ray_lidar = beam(packet, j);
  const Ray ray_world{T_world_lidar * ray_lidar.origin, T_world_lidar.rotation * ray_lidar.direction};
  const std::optional<Hit> hit = scene_.cast(ray_world, lidar_.range_at_90_percent_m * 1.05, t);
  if (!hit || lost) return;

  const double brightness = hit->reflectivity * std::abs(hit->normal.dot(ray_world.direction));
  if (hit->distance > visible_range(lidar_.range_at_10_percent_m, lidar_.range_at_90_percent_m, brightness)) return;
  const std::uint16_t range_mm = range_on_grid(lidar_, hit->distance + noise);
  pending_distance_->ranges_mm[j] = range_mm;
  if (range_mm > 0) packet.reflectivity[j] = grey_value(brightness);
}

}  // namespace ignis::sim
