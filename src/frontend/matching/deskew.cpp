// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/deskew.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/so3.h"
#include "frontend/filter/eskf.h"

namespace ignis {
namespace {

constexpr double kLittle2 = 0.25;  // rad^2: see so3::rotate_a_little

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

}  // namespace

Deskewer::Segment Deskewer::Segment::between(const NavState& before, const NavState& after, const NavState& end,
                                             double dt) {
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

Eigen::Vector3d Deskewer::Segment::moved(double dt) const {
  return position + dt * velocity + (0.5 * dt * dt) * acceleration;
}

Eigen::Matrix3d Deskewer::Segment::turned(double dt) const {
  return R_end_begin * so3::exp(dt * rate).toRotationMatrix();
}

Eigen::Vector3d Deskewer::Segment::at(double dt, const Eigen::Vector3d& point) const {
  const Eigen::Vector3d phi = dt * rate;
  const bool is_little = phi.squaredNorm() < kLittle2;
  const Eigen::Vector3d turned = is_little ? so3::rotate_a_little(phi, point) : so3::exp(phi) * point;
  return R_end_begin * turned + moved(dt);
}

void Deskewer::find_knots(const Scan& scan, std::span<const ImuSample> samples) {
  knots_.clear();
  knots_.push_back(sample_at(samples, scan.utime));
  const auto first = std::ranges::upper_bound(samples, scan.utime, {}, &ImuSample::utime);
  for (auto sample = first; sample != samples.end() && sample->utime < scan.end_utime(); ++sample) {
    knots_.push_back(*sample);
  }
  knots_.push_back(sample_at(samples, scan.end_utime()));
}

void Deskewer::find_motion(const Scan& scan, const NavState& end, double gravity_m) {
  segments_.clear();
  NavState after = end;
  after.utime = scan.end_utime();
  for (std::size_t i = knots_.size() - 1; i > 0; --i) {
    const double dt = seconds_between(knots_[i - 1].utime, knots_[i].utime);
    if (dt <= 0.0) continue;
    NavState before = predict_backward(after, midpoint(knots_[i - 1], knots_[i]), dt, gravity_m);
    before.utime = knots_[i - 1].utime;
    segments_.push_back(Segment::between(before, after, end, dt));
    after = before;
  }
  std::ranges::reverse(segments_);
}

void Deskewer::deskew(const Scan& scan, const NavState& state_at_end, std::span<const ImuSample> samples,
                      double gravity_m, std::vector<CloudPoint>& cloud) {
  cloud.clear();
  cloud.reserve(scan.points.size());
  segments_.clear();
  if (!samples.empty()) {
    find_knots(scan, samples);
    find_motion(scan, state_at_end, gravity_m);
  }
  if (segments_.empty()) {
    for (const ScanPoint& point : scan.points) cloud.push_back({point.position, point.intensity});
    return;
  }
  // A spinning LiDAR measures a column at once: its points share the motion, which is then worth a matrix.
  std::optional<Utime> column;
  Eigen::Matrix3d R_column = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t_column = Eigen::Vector3d::Zero();
  std::size_t current = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const ScanPoint& point = scan.points[i];
    const Utime utime = scan.utime + std::clamp(point.dt_us, 0, scan.duration_us);
    if (utime != column) {
      while (current > 0 && utime < segments_[current].begin) --current;
      while (current + 1 < segments_.size() && utime > segments_[current].end) ++current;
      const double dt = seconds_between(segments_[current].begin, utime);
      if (i + 1 == scan.points.size() || scan.points[i + 1].dt_us != point.dt_us) {
        cloud.push_back({segments_[current].at(dt, point.position.cast<double>()).cast<float>(), point.intensity});
        continue;
      }
      column = utime;
      R_column = segments_[current].turned(dt);
      t_column = segments_[current].moved(dt);
    }
    const Eigen::Vector3d moved = R_column * point.position.cast<double>() + t_column;
    cloud.push_back({moved.cast<float>(), point.intensity});
  }
}

std::vector<CloudPoint> deskew(const Scan& scan, const NavState& state_at_end, std::span<const ImuSample> samples,
                               double gravity_m) {
  std::vector<CloudPoint> cloud;
  Deskewer().deskew(scan, state_at_end, samples, gravity_m, cloud);
  return cloud;
}

}  // namespace ignis
