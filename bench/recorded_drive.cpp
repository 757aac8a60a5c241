// SPDX-License-Identifier: Apache-2.0
#include "recorded_drive.h"

#include <filesystem>

#include "drivers/l1_decoder.h"
#include "drivers/sim/l1_stream.h"
#include "drivers/sim/spinning_stream.h"
#include "frontend/local_map/voxel_downsample.h"
#include "frontend/matching/deskew.h"
#include "runtime/ignis_config.h"

namespace ignis::bench {
namespace {

/// The drives rest for 4 or 5 s; then there is motion to undo.
constexpr double kSeconds = 9.0;
const std::filesystem::path kConfigs = IGNIS_CONFIG_DIR;

sim::SceneConfig perfect_imu(sim::SceneConfig scene) {
  scene.imu = {
      .gyro_noise = 0, .accel_noise = 0, .gyro_bias = 0, .accel_bias = 0, .gyro_bias_walk = 0, .accel_bias_walk = 0};
  return scene;
}

NavState true_state(const sim::Motion& motion, Utime utime) {
  return {
      .utime = utime, .T_odom_body = motion.T_world_body, .v_odom = motion.v_world, .angular_rate = motion.rate_body};
}

template <class Event>
void keep(const Event& event, const auto& stream, RecordedDrive& drive) {
  if (const auto* sample = std::get_if<ImuSample>(&event)) {
    drive.imu.push_back(*sample);
  } else {
    const Scan& scan = std::get<Scan>(event);
    drive.scans.push_back(scan);
    drive.states.push_back(true_state(stream.truth_at(scan.end_utime()), scan.end_utime()));
  }
}

RecordedDrive record_l1() {
  const sim::SceneConfig scene = perfect_imu(sim::load_scene(kConfigs / "scenes" / "battery_hall.json"));
  runtime::IgnisConfig config = runtime::load_config(kConfigs / "ignis8_tuned.json");
  config.driver.time_source = "counters";
  RecordedDrive drive{.config = config.frontend.filter};
  sim::L1Stream stream(scene, config.extrinsics, 1, kSeconds);
  l1::L1Decoder decoder(config.driver, config.extrinsics);
  while (const auto frame = stream.next_frame()) {
    for (const l1::Event& event : decoder.feed(frame->bytes, frame->end_utime())) keep(event, stream, drive);
  }
  return drive;
}

RecordedDrive record_spinning() {
  const sim::SceneConfig scene = perfect_imu(sim::load_scene(kConfigs / "scenes" / "warehouse_spinning128.json"));
  const runtime::IgnisConfig config = runtime::load_config(kConfigs / "spinning.json");
  RecordedDrive drive{.config = config.frontend.filter};
  sim::SpinningStream stream(scene, config.extrinsics, 1, kSeconds);
  while (const auto event = stream.next()) keep(*event, stream, drive);
  return drive;
}

}  // namespace

const RecordedDrive& recorded_drive(std::string_view sensor) {
  static const RecordedDrive l1 = record_l1();
  if (sensor == "l1") return l1;
  static const RecordedDrive spinning = record_spinning();
  return spinning;
}

LocalMap map_before_last(const RecordedDrive& drive) {
  LocalMap map(drive.config);
  for (std::size_t i = 0; i + 1 < drive.scans.size(); ++i) {
    const std::vector<CloudPoint> cloud = deskew(drive.scans[i], drive.states[i], drive.imu, drive.config.gravity_m);
    map.insert(cloud, drive.states[i].T_odom_body, true);
  }
  return map;
}

std::vector<CloudPoint> last_cloud(const RecordedDrive& drive) {
  return deskew(drive.scans.back(), drive.states.back(), drive.imu, drive.config.gravity_m);
}

std::vector<Eigen::Vector3f> last_thinned(const RecordedDrive& drive) {
  const std::vector<CloudPoint> cloud = last_cloud(drive);
  const bool is_large = std::ssize(cloud) > drive.config.max_scan_points;
  std::vector<Eigen::Vector3f> points;
  every_nth(is_large ? voxel_downsample(cloud, drive.config.voxel_size_m) : cloud, drive.config.max_scan_points,
            points);
  return points;
}

}  // namespace ignis::bench
