// SPDX-License-Identifier: Apache-2.0
#include "mount_check.h"

#include <array>
#include <cmath>
#include <format>
#include <fstream>
#include <iostream>

#include "drivers/mount_estimate.h"
#include "runtime/stop_signal.h"
#include "sensor_session.h"

namespace ignis {
namespace {

constexpr double kSamplesPerSecond = 250.0;
/// An accelerometer's bias of 0.1 m/s^2 is 0.6 degrees of tilt, and 0.8 of the roll of a mount that is pitched by 45.
constexpr double kWarnDeg = 2.0;
constexpr std::size_t kMostPoints = 200'000;
/// Nearer returns are the vehicle.
constexpr double kNearestM = 0.3;

/// What the sensor saw while the vehicle stood.
struct Observations {
  std::vector<l1::ImuAttitude> samples;
  std::vector<Eigen::Vector3d> points;

  void add(const std::vector<l1::Packet>& packets, const DriverConfig& config) {
    for (const l1::Packet& packet : packets) {
      if (const auto* imu = std::get_if<l1::CountedImu>(&packet)) samples.push_back(imu->attitude);
      const auto* pair = std::get_if<l1::CountedPacket>(&packet);
      if (pair == nullptr || points.size() > kMostPoints) continue;
      for (const l1::SensorPoint& point : l1::points_of(pair->pair, config)) points.push_back(point.position);
    }
  }
};

Observations observe_live(const DriverConfig& config, std::size_t wanted) {
  SensorSession session(config);
  Observations seen;
  std::cerr << std::format("l1_tool: keep the vehicle still for {:.0f} s\n",
                           static_cast<double>(wanted) / kSamplesPerSecond);
  int silent_reads = 0;
  constexpr int kSilentReads = 100;  // two seconds
  while (seen.samples.size() < wanted && !runtime::stop_requested()) {
    const auto packets = session.read();
    seen.add(packets, config);
    silent_reads = packets.empty() ? silent_reads + 1 : 0;
    if (silent_reads > kSilentReads) throw runtime::UserError(session.what_came(), runtime::kFailed);
  }
  return seen;
}

Observations observe_capture(const std::filesystem::path& file, DriverConfig config, std::size_t wanted) {
  std::ifstream capture(file, std::ios::binary);
  if (!capture || std::filesystem::is_directory(file)) {
    throw runtime::UserError(std::format("cannot read {}: name a recorded byte stream", file.string()));
  }
  config.time_source = "counters";
  l1::PacketStream stream(config);
  Observations seen;
  std::array<char, 4096> buffer{};
  while (seen.samples.size() < wanted && (capture.read(buffer.data(), std::ssize(buffer)) || capture.gcount() > 0)) {
    const auto bytes = std::as_bytes(std::span(buffer)).first(static_cast<std::size_t>(capture.gcount()));
    seen.add(stream.feed(bytes, 0), config);
  }
  return seen;
}

/// One row of the table; false when it is further off than kWarnDeg.
bool print_tilt(const char* source, const l1::Tilt& found, const Mount& mount) {
  const double pitch_off = std::remainder(found.pitch_deg - mount.pitch_deg, 360.0);
  const double roll_off = std::remainder(found.roll_deg - mount.roll_deg, 360.0);
  const bool good = std::abs(pitch_off) < kWarnDeg && std::abs(roll_off) < kWarnDeg;
  std::cout << std::format("{:<22} {:>9.2f} {:>9.2f}   configured {:>7.2f} {:>7.2f}   off by {:>+6.2f} {:>+6.2f}  {}\n",
                           source, found.pitch_deg, found.roll_deg, mount.pitch_deg, mount.roll_deg, pitch_off,
                           roll_off, good ? "ok" : "CHECK");
  return good;
}

bool print_floor(const Observations& seen, const Extrinsics& extrinsics) {
  // Where the inertial unit says up is, in the axes of the LiDAR.
  const l1::RestingImu imu = l1::resting_imu(seen.samples);
  const Eigen::Quaterniond q_lidar_imu =
      extrinsics.lidar.T_body_sensor().rotation.conjugate() * extrinsics.imu.T_body_sensor().rotation;
  const auto floor = l1::find_floor(seen.points, q_lidar_imu * imu.mean_accel);
  if (!floor) {
    std::cout << std::format("floor: none found among {} points below the sensor, so only gravity speaks\n",
                             seen.points.size());
    return true;
  }
  const bool good =
      print_tilt("floor (LiDAR mount)", l1::tilt_from_up(floor->up_sensor, extrinsics.lidar), extrinsics.lidar);
  std::cout << std::format("the floor lies {:.3f} m below the sensor's base ({} points, roughness {:.3f} m)\n",
                           floor->height_m, floor->points, floor->roughness_m);
  return good;
}

}  // namespace

runtime::ExitCode check_mount(const MountCheckOptions& options, const DriverConfig& driver,
                              const Extrinsics& extrinsics) {
  DriverConfig config = driver;
  config.range_min_m = std::max(config.range_min_m, kNearestM);
  const auto wanted = static_cast<std::size_t>(options.seconds * kSamplesPerSecond);
  const Observations seen =
      options.capture.empty() ? observe_live(config, wanted) : observe_capture(options.capture, config, wanted);
  if (seen.samples.size() < wanted) {
    throw runtime::UserError(std::format("only {} of {} inertial samples came", seen.samples.size(), wanted),
                             runtime::kFailed);
  }

  const l1::RestingImu imu = l1::resting_imu(seen.samples);
  std::cout << std::format("specific force at rest {:.3f} m/s^2, gyroscope {:.4f} rad/s\n\n", imu.mean_accel.norm(),
                           imu.mean_gyro.norm());
  std::cout << std::format("{:<22} {:>9} {:>9}\n", "mount by", "pitch deg", "roll deg");
  bool good =
      print_tilt("gravity (IMU mount)", l1::tilt_from_up(imu.mean_accel.normalized(), extrinsics.imu), extrinsics.imu);
  good = print_floor(seen, extrinsics) && good;
  for (const std::string& suspicion : l1::suspicions(imu, extrinsics.imu)) {
    std::cout << "CHECK: " << suspicion << '\n';
    good = false;
  }
  std::cout << (good ? "\nmount, units and signs agree with the configuration\n"
                     : "\nsomething does not agree: mend the mount or extrinsics.*.pitch_deg and roll_deg\n");
  return good ? runtime::kDone : runtime::kFailed;
}

}  // namespace ignis
