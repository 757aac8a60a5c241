// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/trajectory.h"

#include <algorithm>
#include <cmath>
#include <format>
#include <numbers>

#include "common/config_check.h"
#include "common/frames.h"
#include "drivers/sim/jet.h"

namespace ignis::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
/// Wavelengths of the floor's unevenness along the path [m]; no small multiple of one another.
constexpr double kPitchWave = 7.3;
constexpr double kRollWave = 5.1;
constexpr int kControlsPerPoint = 6;

Eigen::Vector3d to_vector(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

using Weights = Eigen::Matrix<double, kControlsPerPoint, 1>;

/// Weights of the six control points around the spline's parameter, and of their derivatives, x in 0..1.
std::array<Weights, 4> quintic_weights(double x) {
  // Row: control point; column: power of x. Uniform quintic basis times 120.
  static const Eigen::Matrix<double, 6, 6> kBasis = (Eigen::Matrix<double, 6, 6>() << 1, -5, 10, -10, 5, -1,  //
                                                     26, -50, 20, 20, -20, 5,                                 //
                                                     66, 0, -60, 0, 30, -10,                                  //
                                                     26, 50, 20, -20, -20, 10,                                //
                                                     1, 5, 10, 10, 5, -5,                                     //
                                                     0, 0, 0, 0, 0, 1)
                                                        .finished() /
                                                    120.0;
  std::array<Weights, 4> weights;
  for (int order = 0; order < 4; ++order) {
    Weights powers = Weights::Zero();
    double power = 1.0;
    for (int k = order; k < kControlsPerPoint; ++k) {
      double factor = 1.0;
      for (int m = 0; m < order; ++m) factor *= k - m;
      powers[k] = factor * power;
      power *= x;
    }
    weights[static_cast<std::size_t>(order)] = kBasis * powers;
  }
  return weights;
}

/// Angular rate in body axes for R = Ry(yaw) Rx(pitch) Rz(-roll), with its derivative.
std::array<Jet, 3> body_rate(const Jet& yaw, const Jet& pitch, const Jet& roll) {
  const Jet turn = -roll;
  const Jet right = rate_of(pitch);
  const Jet up = cos(pitch) * rate_of(yaw);
  const Jet back = -(sin(pitch) * rate_of(yaw));
  return {cos(turn) * right + sin(turn) * up, cos(turn) * up - sin(turn) * right, back + rate_of(turn)};
}

}  // namespace

void TrajectoryConfig::check(config::Offences& offences, const std::string& path) const {
  if (waypoints.empty()) return;
  if (waypoints.size() == 1) offences.push_back({path + ".waypoints", "1 entry", "none, or two or more"});
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    if ((to_vector(waypoints[i].position_m) - to_vector(waypoints[i - 1].position_m)).norm() >= 0.5) continue;
    offences.push_back({std::format("{}.waypoints[{}].position_m", path, i), "nearer than 0.5 m to the one before",
                        "at least 0.5 m apart"});
  }
}

Trajectory::Trajectory(const TrajectoryConfig& config) : config_(config) {
  config::require_valid(config_, "trajectory");
  if (config_.waypoints.empty()) throw config::ConfigError("trajectory.waypoints is empty: two or more are needed");
  lay_control_points();
  refuse_turning_on_the_spot();
  plan_phases();
}

void Trajectory::lay_control_points() {
  std::vector<Eigen::Vector3d> corners;
  for (const Waypoint& waypoint : config_.waypoints) {
    const Eigen::Vector3d corner = to_vector(waypoint.position_m);
    waypoint_s_.push_back(corners.empty() ? 0.0 : waypoint_s_.back() + (corner - corners.back()).norm());
    corners.push_back(corner);
  }
  const double total = waypoint_s_.back();
  const int intervals = std::max(1, static_cast<int>(std::lround(total / config_.corner_m)));
  spacing_ = total / intervals;
  // Controls beyond the ends continue the first and the last leg, so the spline begins and ends on its waypoints.
  for (int i = -2; i <= intervals + 2; ++i) {
    const double s = i * spacing_;
    const auto next = std::upper_bound(waypoint_s_.begin() + 1, waypoint_s_.end() - 1, s) - waypoint_s_.begin();
    const auto leg = static_cast<std::size_t>(next);
    const double ratio = (s - waypoint_s_[leg - 1]) / (waypoint_s_[leg] - waypoint_s_[leg - 1]);
    controls_.push_back(corners[leg - 1] + ratio * (corners[leg] - corners[leg - 1]));
  }
}

void Trajectory::refuse_turning_on_the_spot() const {
  constexpr double kSteps = 8.0;
  const double last = waypoint_s_.back() / spacing_ * kSteps;
  for (double step = 0.0; step <= last; step += 1.0) {
    const PathPoint point = path(step / kSteps);
    const double forward = std::hypot(point.derivative[1].x(), point.derivative[1].z()) / spacing_;
    if (forward > 0.2) continue;
    throw config::ConfigError(
        std::format("trajectory: the path doubles back or climbs straight up near ({:.1f}, {:.1f}, {:.1f}) m; "
                    "put the waypoints further apart or make corner_m = {} smaller",
                    point.derivative[0].x(), point.derivative[0].y(), point.derivative[0].z(), config_.corner_m));
  }
}

void Trajectory::change_speed(double to) {
  const Phase last = phases_.back();
  const double begin_t = last.begin_t + last.duration;
  const double begin_s = last.begin_s + 0.5 * (last.from + last.to) * last.duration;
  if (to != last.to) {
    phases_.push_back({begin_t, std::abs(to - last.to) / config_.acceleration_m_s2, begin_s, last.to, to});
  }
}

void Trajectory::cruise_to(double s) {
  const Phase last = phases_.back();
  const double begin_s = last.begin_s + 0.5 * (last.from + last.to) * last.duration;
  if (s < begin_s - 1e-9) {
    throw config::ConfigError(std::format(
        "trajectory: a change of speed that begins {:.2f} m along the path does not fit before {:.2f} m; put "
        "the waypoints further apart, or choose a lower speed or a higher acceleration_m_s2",
        last.begin_s, s));
  }
  if (s > begin_s) {
    phases_.push_back({last.begin_t + last.duration, (s - begin_s) / last.to, begin_s, last.to, last.to});
  }
}

void Trajectory::plan_phases() {
  double speed = config_.speed_m_s;
  for (std::size_t i = 0; i < config_.waypoints.size(); ++i) {
    const Waypoint& waypoint = config_.waypoints[i];
    const bool last = i + 1 == config_.waypoints.size();
    const bool stop = waypoint.rest_s > 0.0 || last;
    if (i == 0) {
      phases_.push_back({.from = stop ? 0.0 : speed, .to = stop ? 0.0 : speed});
    } else {
      const double current = phases_.back().to;
      const double braking = stop ? 0.5 * current * current / config_.acceleration_m_s2 : 0.0;
      cruise_to(waypoint_s_[i] - braking);
    }
    if (stop) {
      change_speed(0.0);
      const Phase& braked = phases_.back();
      phases_.push_back({braked.begin_t + braked.duration, waypoint.rest_s, waypoint_s_[i], 0.0, 0.0});
    }
    if (waypoint.speed_m_s > 0.0) speed = waypoint.speed_m_s;
    if (!last) change_speed(speed);
  }
}

double Trajectory::duration() const { return phases_.back().begin_t + phases_.back().duration; }

double Trajectory::length() const {
  constexpr double kStep = 0.05;
  double sum = 0.0;
  const double last = waypoint_s_.back() / spacing_;
  for (double u = 0.0; u < last; u += kStep) {
    sum += (path(std::min(u + kStep, last)).derivative[0] - path(u).derivative[0]).norm();
  }
  return sum;
}

Trajectory::Progress Trajectory::progress(double t) const {
  const auto after = std::upper_bound(phases_.begin(), phases_.end(), t,
                                      [](double time, const Phase& phase) { return time < phase.begin_t; });
  const Phase& phase = after == phases_.begin() ? phases_.front() : *(after - 1);
  const double elapsed = std::clamp(t - phase.begin_t, 0.0, phase.duration);
  if (phase.from == phase.to) return {phase.begin_s + phase.from * elapsed, phase.from, 0.0};
  const double x = elapsed / phase.duration;
  const double step = phase.to - phase.from;
  const double x3 = x * x * x;
  return {phase.begin_s + phase.from * elapsed + step * phase.duration * x3 * x * (2.5 + x * (-3.0 + x)),
          phase.from + step * x3 * (10.0 + x * (-15.0 + x * 6.0)),
          step / phase.duration * 30.0 * x * x * (1.0 - x) * (1.0 - x)};
}

Trajectory::PathPoint Trajectory::path(double u) const {
  const double last = static_cast<double>(controls_.size()) - kControlsPerPoint;
  const double segment = std::clamp(std::floor(u), 0.0, last);
  const std::array<Weights, 4> weights = quintic_weights(u - segment);
  PathPoint point;
  for (std::size_t order = 0; order < 4; ++order) {
    point.derivative[order].setZero();
    for (int k = 0; k < kControlsPerPoint; ++k) {
      point.derivative[order] +=
          weights[order][k] * controls_[static_cast<std::size_t>(segment) + static_cast<std::size_t>(k)];
    }
  }
  return point;
}

Motion Trajectory::at(double t) const {
  const Progress along = progress(t);
  const PathPoint point = path(along.s / spacing_);
  const double u_rate = along.rate / spacing_;
  const double u_acceleration = along.acceleration / spacing_;

  const Eigen::Vector3d& tangent = point.derivative[1];
  const Eigen::Vector3d tangent_rate = point.derivative[2] * u_rate;
  const Eigen::Vector3d tangent_acceleration =
      point.derivative[3] * (u_rate * u_rate) + point.derivative[2] * u_acceleration;
  const auto component = [&](int axis) { return Jet{tangent[axis], tangent_rate[axis], tangent_acceleration[axis]}; };
  const Jet x = component(0);
  const Jet y = component(1);
  const Jet z = component(2);
  const Jet s{along.s, along.rate, along.acceleration};
  const double tilt = config_.tilt_deg * kDegree;

  const Jet yaw = atan2(-x, -z);
  const Jet pitch = atan2(y, sqrt(x * x + z * z)) + tilt * sin(2.0 * std::numbers::pi / kPitchWave * s);
  const Jet roll = tilt * sin(2.0 * std::numbers::pi / kRollWave * s);
  const std::array<Jet, 3> rate = body_rate(yaw, pitch, roll);

  Motion motion;
  motion.T_world_body = {frames::from_yaw_pitch_roll({yaw.value, pitch.value, roll.value}), point.derivative[0]};
  motion.v_world = tangent * u_rate;
  motion.a_world = point.derivative[2] * (u_rate * u_rate) + tangent * u_acceleration;
  motion.rate_body = {rate[0].value, rate[1].value, rate[2].value};
  motion.rate_derivative_body = {rate[0].rate, rate[1].rate, rate[2].rate};
  return motion;
}

}  // namespace ignis::sim
