// SPDX-License-Identifier: Apache-2.0
#include "frontend/lio_runner.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include <Eigen/Geometry>

#include "common/config_json.h"
#include "common/loop_gates.h"
#include "common/so3.h"

namespace ignis::test {

LioRun run_lio(const FrontendConfig& config, const Drive& drive, double scan_delay_s) {
  Lio lio(config);
  LioRun run;
  const auto take = [&](std::vector<ScanResult> results) {
    for (ScanResult& result : results) run.scans.push_back(std::move(result));
  };
  std::size_t next_scan = 0;
  for (const ImuSample& sample : drive.imu) {
    while (next_scan < drive.scans.size() &&
           drive.scans[next_scan].end_utime() + to_micros(scan_delay_s) <= sample.utime) {
      take(lio.add_scan(drive.scans[next_scan++]));
    }
    ImuResult result = lio.add_imu(sample);
    if (result.state) run.states.push_back(*result.state);
    take(std::move(result.scans));
  }
  run.status = lio.status();
  return run;
}

FrontendConfig tuned_config() {
  config::Json section =
      config::read_json(std::filesystem::path(IGNIS_CONFIG_DIR) / "ignis8_tuned.json").at("frontend");
  // The reference's one table holds the loop closer's gates too.
  const config::Json loop_gates = config::Printer::print(LoopGates());
  for (const auto& gate : loop_gates.items()) section.erase(gate.key());
  return config::load<FrontendConfig>(section);
}

double drive_seconds(const Drive& drive, Utime utime) { return seconds_between(drive.imu.front().utime, utime); }

double aligned_error(const LioRun& run, const Drive& drive) {
  std::vector<Eigen::Vector3d> estimated;
  std::vector<Eigen::Vector3d> truth;
  for (const ScanResult& scan : run.scans) {
    if (!scan.has_state) continue;
    estimated.push_back(scan.state.T_odom_body.translation);
    truth.push_back(drive.truth(drive_seconds(drive, scan.state.utime)).translation);
  }
  const auto n = static_cast<Eigen::Index>(estimated.size());
  const Eigen::Map<const Eigen::Matrix3Xd> from(estimated.front().data(), 3, n);
  const Eigen::Map<const Eigen::Matrix3Xd> to(truth.front().data(), 3, n);
  const Eigen::Matrix4d T = Eigen::umeyama(from, to, false);
  const Eigen::Matrix3Xd error = (T.topLeftCorner<3, 3>() * from).colwise() + T.topRightCorner<3, 1>() - to;
  return std::sqrt(error.colwise().squaredNorm().mean());
}

double end_error(const LioRun& run, const Drive& drive) {
  const NavState& last = run.scans.back().state;
  return (last.T_odom_body.translation - drive.truth(drive_seconds(drive, last.utime)).translation).norm();
}

double worst_silent_error(const LioRun& run, const Drive& drive) {
  double worst = -1.0;
  std::optional<Pose> T_odom_world;
  for (const ScanResult& scan : run.scans) {
    if (!scan.has_state) continue;
    const Pose truth = drive.truth(drive_seconds(drive, scan.state.utime));
    if (!T_odom_world) T_odom_world = scan.state.T_odom_body * truth.inverse();
    const double error = (*T_odom_world * truth.translation - scan.state.T_odom_body.translation).norm();
    if (scan.trust == Trust::kOk) worst = std::max(worst, error);
  }
  return worst;
}

PoseNees pose_nees(const LioRun& run, const Drive& drive) {
  const auto per_dimension = [](const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance) {
    return error.dot(covariance.inverse() * error) / 3.0;
  };
  PoseNees sum;
  int scans = 0;
  for (const ScanResult& scan : run.scans) {
    if (!scan.stats.applied()) continue;
    const Pose truth = drive.truth(drive_seconds(drive, scan.state.utime));
    const Eigen::Vector3d shift = truth.translation - scan.state.T_odom_body.translation;
    const Eigen::Vector3d turn = so3::log(scan.state.T_odom_body.rotation.conjugate() * truth.rotation);
    sum.position += per_dimension(shift, scan.covariance.block<3, 3>(kPosition, kPosition));
    sum.attitude += per_dimension(turn, scan.covariance.block<3, 3>(kAttitude, kAttitude));
    ++scans;
  }
  return {sum.position / scans, sum.attitude / scans};
}

int count(const LioRun& run, ScanReason reason) {
  return static_cast<int>(
      std::ranges::count_if(run.scans, [&](const ScanResult& scan) { return scan.stats.reason == reason; }));
}

}  // namespace ignis::test
