// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "common/config_fields.h"
#include "common/pose.h"

namespace ignis::sim {

struct Waypoint {
  std::array<double, 3> position_m = {0.0, 0.6, 0.0};
  double speed_m_s = 0.0;
  double rest_s = 0.0;

  void visit_fields(this auto& self, auto& visit) {
    visit.vector("position_m", self.position_m, {-1000.0, 1000.0}, "m", "corner of the path, body origin in the world");
    visit.number("speed_m_s", self.speed_m_s, {0.0, 10.0}, "m/s", "speed from here on; 0 keeps the speed so far");
    visit.number("rest_s", self.rest_s, {0.0, 600.0}, "s", "time to stand still here; 0 drives through");
  }
};

struct TrajectoryConfig {
  double speed_m_s = 1.0;
  double acceleration_m_s2 = 0.5;
  double corner_m = 2.5;
  double tilt_deg = 0.2;
  std::vector<Waypoint> waypoints;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("speed_m_s", self.speed_m_s, {0.05, 10.0}, "m/s", "speed until a waypoint sets another");
    visit.number("acceleration_m_s2", self.acceleration_m_s2, {0.05, 5.0}, "m/s^2", "mean of each change of speed");
    visit.number("corner_m", self.corner_m, {0.2, 20.0}, "m", "how far before and after it a corner is felt, over two");
    visit.number("tilt_deg", self.tilt_deg, {0.0, 5.0}, "deg", "how far the uneven floor tilts the vehicle");
    visit.list("waypoints", self.waypoints, 1000, "corners of the path, in order");
  }
  void check(config::Offences& offences, const std::string& path) const;
};

/// Everything an ideal inertial unit could know at one instant. Body: +X right, +Y up, -Z forward.
struct Motion {
  Pose T_world_body;
  Eigen::Vector3d v_world = Eigen::Vector3d::Zero();               ///< [m/s] of the body origin
  Eigen::Vector3d a_world = Eigen::Vector3d::Zero();               ///< [m/s^2] of the body origin
  Eigen::Vector3d rate_body = Eigen::Vector3d::Zero();             ///< [rad/s] angular rate
  Eigen::Vector3d rate_derivative_body = Eigen::Vector3d::Zero();  ///< [rad/s^2] its derivative in body axes
};

/// A drive along the waypoints with exact derivatives at any time.
///
/// The path is a uniform quintic B-spline (C4; C. de Boor, "A Practical Guide to Splines", 1978) whose control points
/// lie `corner_m` apart on the line through the waypoints: straight where that is straight, rounded at its corners.
/// Progress along it is a time law with quintic ramps between speeds (C3), so jerk is continuous and standing phases
/// are truly still. The vehicle points along its travel, pitches with the slope, and tilts a little as the floor is
/// uneven. A first waypoint without rest means that the drive begins at full speed; it always ends standing.
class Trajectory {
 public:
  /// Throws config::ConfigError, also when a leg is too short for its changes of speed or the path turns on the spot.
  explicit Trajectory(const TrajectoryConfig& config);

  [[nodiscard]] Motion at(double t) const;  ///< t [s]
  [[nodiscard]] double duration() const;    ///< [s]
  [[nodiscard]] double length() const;      ///< [m] of the driven path

 private:
  /// Speed goes from `from` to `to` in `duration`; progress is measured along the line through the waypoints.
  struct Phase {
    double begin_t = 0.0;
    double duration = 0.0;
    double begin_s = 0.0;
    double from = 0.0;
    double to = 0.0;
  };
  struct Progress {
    double s = 0.0;
    double rate = 0.0;
    double acceleration = 0.0;
  };
  struct PathPoint {
    Eigen::Vector3d derivative[4];  ///< by the spline's parameter, order 0 to 3
  };

  void lay_control_points();
  void plan_phases();
  void change_speed(double to);
  void cruise_to(double s);
  void refuse_turning_on_the_spot() const;
  [[nodiscard]] Progress progress(double t) const;
  [[nodiscard]] PathPoint path(double u) const;

  TrajectoryConfig config_;
  double spacing_ = 1.0;                   ///< [m] between control points along the line
  std::vector<double> waypoint_s_;         ///< [m] of each waypoint along the line
  std::vector<Eigen::Vector3d> controls_;  ///< begins two before the start
  std::vector<Phase> phases_;
};

}  // namespace ignis::sim
