// SPDX-License-Identifier: Apache-2.0
#include "frontend/deskew.h"

#include <algorithm>
#include <cmath>

#include "common/so3.h"
#include "frontend/eskf.h"

namespace ignis {
namespace {

/// Motion over one interval between IMU samples, expressed in the body frame at the scan's end.
struct Segment {
  Utime begin = 0;
  Utime end = 0;
  Eigen::Matrix3d R_end_begin = Eigen::Matrix3d::Identity();
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();          ///< [rad/s] body axes
  Eigen::Vector3d position = Eigen::Vector3d::Zero();      ///< [m] at begin
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< [m/s] at begin
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< [m/s^2]

  [[nodiscard]] Eigen::Vector3d at(double dt, const Eigen::Vector3d& point) const {
    const Eigen::Vector3d phi = dt * rate;
    const bool is_little = phi.squaredNorm() < 0.25;
    const Eigen::Vector3d turned = is_little ? so3::rotate_a_little(phi, point) : so3::exp(phi) * point;
    return R_end_begin * turned + position + dt * velocity + (0.5 * dt * dt) * acceleration;
  }
};

Segment make_segment(const NavState& before, const NavState& after, const NavState& end, double dt) {
  const Eigen::Quaterniond q_end_odom = end.T_odom_body.rotation.conjugate();
  Segment segment;
  segment.begin = before.utime;
  segment.end = after.utime;
  segment.R_end_begin = (q_end_odom * before.T_odom_body.rotation).toRotationMatrix();
  segment.rate = before.angular_rate;
  segment.position = q_end_odom * (before.T_odom_body.translation - end.T_odom_body.translation);
  segment.velocity = q_end_odom * before.v_odom;
  segment.acceleration = q_end_odom * ((after.v_odom - before.v_odom) / dt);
  return segment;
}

/// The sample at an instant: interpolated, or the nearest one beyond the ends.
ImuSample sample_at(std::span<const ImuSample> samples, Utime utime) {
  const auto after = std::ranges::lower_bound(samples, utime, {}, &ImuSample::utime);
  ImuSample sample;
  if (after == samples.begin()) {
    sample = samples.front();
  } else if (after == samples.end()) {
    sample = samples.back();
  } else {
    return interpolate(*(after - 1), *after, utime);
  }
  sample.utime = utime;
  return sample;
}

/// Samples at the scan's two ends and all between, oldest first.
std::vector<ImuSample> knots(const Scan& scan, std::span<const ImuSample> samples) {
  std::vector<ImuSample> result = {sample_at(samples, scan.utime)};
  for (const ImuSample& sample : samples) {
    if (sample.utime > scan.utime && sample.utime < scan.end_utime()) result.push_back(sample);
  }
  result.push_back(sample_at(samples, scan.end_utime()));
  return result;
}

std::vector<Segment> motion(const Scan& scan, const NavState& end, std::span<const ImuSample> samples, double gravity) {
  const std::vector<ImuSample> inputs = knots(scan, samples);
  std::vector<Segment> segments;
  NavState after = end;
  after.utime = scan.end_utime();
  for (std::size_t i = inputs.size() - 1; i > 0; --i) {
    const double dt = seconds_between(inputs[i - 1].utime, inputs[i].utime);
    if (dt <= 0.0) continue;
    NavState before = predict_backward(after, midpoint(inputs[i - 1], inputs[i]), dt, gravity);
    before.utime = inputs[i - 1].utime;
    segments.push_back(make_segment(before, after, end, dt));
    after = before;
  }
  std::ranges::reverse(segments);
  return segments;
}

}  // namespace

std::vector<CloudPoint> deskew(const Scan& scan, const NavState& state_at_end, std::span<const ImuSample> samples,
                               double gravity_m) {
  std::vector<CloudPoint> cloud;
  cloud.reserve(scan.points.size());
  const std::vector<Segment> segments =
      samples.empty() ? std::vector<Segment>{} : motion(scan, state_at_end, samples, gravity_m);
  std::size_t current = 0;
  for (const ScanPoint& point : scan.points) {
    Eigen::Vector3f position = point.position;
    if (!segments.empty()) {
      const Utime utime = scan.utime + std::clamp(point.dt_us, 0, scan.duration_us);
      while (current > 0 && utime < segments[current].begin) --current;
      while (current + 1 < segments.size() && utime > segments[current].end) ++current;
      const double dt = seconds_between(segments[current].begin, utime);
      position = segments[current].at(dt, position.cast<double>()).cast<float>();
    }
    cloud.push_back({position, point.intensity});
  }
  return cloud;
}

}  // namespace ignis
