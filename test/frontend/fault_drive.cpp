// SPDX-License-Identifier: Apache-2.0
#include "frontend/fault_drive.h"

#include <algorithm>

namespace ignis::test {

const Drive& drive() {
  static const Drive simulated = simulate(furnished_hall(), ellipse_drive(2.0, 6.0, 4.0, 1.0), 16.0, Sensors{}, 7);
  return simulated;
}

std::vector<ImuSample>::iterator sample_at(Drive& input, double seconds) {
  return std::ranges::lower_bound(input.imu, input.imu.front().utime + to_micros(seconds), {}, &ImuSample::utime);
}

Watched::Watched(const Drive& input, const FrontendConfig& config, const std::function<void(Lio&)>& before,
                 const std::function<void(Lio&, std::size_t)>& before_scan)
    : lio(config) {
  before(lio);
  // Corrupt stamps must not decide what arrives when: nothing arrives more than a tenth of a second after the last.
  auto imu = input.imu.begin();
  Utime now = input.imu.front().utime;
  for (const Scan& scan : input.scans) {
    now = std::min(scan.end_utime(), now + 100'000);
    while (imu != input.imu.end() && (imu->utime <= now || imu->utime > now + 60 * kMicrosPerSecond)) {
      take(lio.add_imu(*imu++).scans);
    }
    before_scan(lio, trust.size());
    take(lio.add_scan(scan));
    trust.emplace_back(scan.end_utime(), lio.status().trust);
  }
}

void Watched::take(std::vector<ScanResult> results) {
  for (ScanResult& result : results) scans.push_back(std::move(result));
}

Trust Watched::trust_at(double seconds) const {
  const Utime utime = drive().imu.front().utime + to_micros(seconds);
  return std::ranges::lower_bound(trust, utime, {}, [](const auto& each) { return each.first; })->second;
}

double Watched::error_at_end() const {
  const NavState& last = scans.back().state;
  return (last.T_odom_body.translation - drive().truth(drive_seconds(drive(), last.utime)).translation).norm();
}

}  // namespace ignis::test
