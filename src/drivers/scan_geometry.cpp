// SPDX-License-Identifier: Apache-2.0
#include "drivers/scan_geometry.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ignis::l1 {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// Angles and calibration of a packet, in radians and metres.
class PacketGeometry {
 public:
  PacketGeometry(const Auxiliary& auxiliary, const DriverConfig& config)
      : alpha_start_(auxiliary.vertical_start_deg * kDegree),
        alpha_step_(auxiliary.vertical_step_deg * kDegree),
        beta_start_((auxiliary.yaw_start_deg + config.yaw_bias_deg) * kDegree),
        beta_step_(auxiliary.yaw_step_deg / static_cast<double>(kPointsPerPacket) * kDegree),
        sin_theta_(std::sin(static_cast<double>(auxiliary.theta_rad))),
        cos_theta_(std::cos(static_cast<double>(auxiliary.theta_rad))),
        sin_ksi_(std::sin(static_cast<double>(auxiliary.ksi_rad))),
        cos_ksi_(std::cos(static_cast<double>(auxiliary.ksi_rad))),
        b_(auxiliary.b_axis_mm * 1e-3),
        z_bias_(config.z_bias_m) {}

  [[nodiscard]] Eigen::Vector3d point(int index, double range) const {
    const double alpha = alpha_start_ + index * alpha_step_;
    const double beta = beta_start_ + index * beta_step_;
    const double sin_alpha = std::sin(alpha);
    const double along = range * (-cos_theta_ * sin_ksi_ + sin_theta_ * sin_alpha * cos_ksi_) + b_;
    const double across = range * std::cos(alpha) * cos_ksi_;
    const double up = range * (sin_theta_ * sin_ksi_ + cos_theta_ * sin_alpha * cos_ksi_) + z_bias_;
    const double sin_beta = std::sin(beta);
    const double cos_beta = std::cos(beta);
    return {cos_beta * along - sin_beta * across, sin_beta * along + cos_beta * across, up};
  }

 private:
  double alpha_start_, alpha_step_, beta_start_, beta_step_;
  double sin_theta_, cos_theta_, sin_ksi_, cos_ksi_;
  double b_, z_bias_;
};

}  // namespace

std::vector<SensorPoint> points_of(const PacketPair& packet, const DriverConfig& config) {
  const PacketGeometry geometry(packet.auxiliary, config);
  const auto scale = static_cast<float>(config.range_scale);
  const auto bias = static_cast<float>(config.range_bias_m);
  const auto nearest = static_cast<float>(config.range_min_m);
  const auto farthest = static_cast<float>(config.range_max_m);
  std::vector<SensorPoint> points;
  points.reserve(kPointsPerPacket);
  for (std::size_t j = 0; j < kPointsPerPacket; ++j) {
    const std::uint16_t raw = packet.distance.ranges_mm[j];
    const float range = scale * static_cast<float>(raw) + bias;
    if (raw == 0 || range < nearest || range > farthest) continue;
    const double exact_range = config.range_scale * raw + config.range_bias_m;
    const int index = static_cast<int>(j);
    points.push_back({geometry.point(index, exact_range), static_cast<float>(packet.auxiliary.reflectivity[j]), index});
  }
  return points;
}

int returns_of(const Distance& distance) {
  return static_cast<int>(std::ranges::count_if(distance.ranges_mm, [](std::uint16_t raw) { return raw != 0; }));
}

}  // namespace ignis::l1
