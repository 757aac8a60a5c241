// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "common/config_check.h"
#include "common/config_fields.h"

namespace ignis {

/// Parameters of the front end. The first block is the reference's table under its names and with its defaults (the
/// loop_* rows live in common/loop_gates.h); the second block is ours.
///
/// Ranges admit both ends of the family: an L1 in a hall (defaults) and a car with a 64-beam LiDAR.
struct FrontendConfig {
  double gravity_m = 9.81;
  double imu_noise_gyro = 0.003;
  double imu_noise_accel = 0.06;
  double gyro_bias_walk = 0.0001;
  double accel_bias_walk = 0.001;
  double measurement_noise = 0.01;
  double min_range_m = 0.2;
  double max_range_m = 15.0;
  double voxel_size_m = 0.2;
  double match_radius_m = 0.5;
  double map_window_m = 20.0;
  double map_window_y = 8.0;
  int min_plane_points = 5;
  double max_curvature = 0.1;
  double min_spread = 0.1;
  double max_centroid_offset = 0.2;
  double max_surface_roughness = 0.02;
  double min_observability = 0.02;
  double max_scan_correction_m = 0.05;
  double max_scan_velocity_corr = 0.05;
  int iterations = 2;
  double max_innovation_sigma = 4.0;
  double max_mean_innovation = 0.05;
  double keyframe_dist_m = 4.0;
  double keyframe_yaw_rad = 0.6;
  bool use_scan_matching = true;

  std::string start = "at_rest";
  double start_seconds = 1.5;
  double rest_gyro_sigma = 0.15;
  double rest_gyro_mean = 0.05;
  double rest_accel_sigma = 1.5;
  double rest_accel_band = 0.5;
  double max_start_tilt_rad = 1.05;
  double gyro_bias_sigma = 0.02;
  double accel_bias_sigma = 0.15;
  double moving_velocity_sigma = 15.0;
  double moving_accel_sigma = 1.0;
  double velocity_known_sigma = 0.5;
  double full_observability = 1e-4;
  bool adapt_measurement_noise = true;
  double noise_prior_points = 20.0;
  double residual_inflation = 4.0;
  double blind_residual_inflation = 4.0;
  double degeneracy_threshold = 1e-5;
  double degeneracy_signal_to_noise = 1.6;
  double salient_sigma = 4.0;
  double salient_share = 0.0015;
  double contradiction_sigma = 4.2;
  double moving_surface_sigma = 3.0;
  int map_average_points = 1;
  bool map_two_faces = false;
  double map_drift = 1.0;
  double wide_match_radius_m = 0.0;
  double line_match_radius_m = 0.0;
  double imu_timeout_s = 0.5;
  double resume_max_gap_s = 3.0;
  double degraded_sigma_m = 0.15;
  double lost_sigma_m = 1.0;
  int min_scan_points = 50;
  int min_matches = 20;
  double min_plane_width_m = 0.0;
  double smooth_plane_m = 0.0;
  double enough_smooth_planes = 0.0;
  double range_noise_m = 0.0;
  double shock_accel_m_s2 = 30.0;
  double shock_gyro_rad_s = 5.0;
  double map_memory_m = 20.0;
  double map_memory_sigma_m = 0.05;
  int max_scan_points = 3000;
  int reanchor_scans = 20;
  double keyframe_max_seconds = 5.0;
  double keyframe_cloud_seconds = 1.0;
  double max_scan_delay_s = 2.0;
  double scan_voxel_m = 0.0;
  bool deskew = true;
  bool project_degenerate = true;
  bool quarantine = true;
  double zero_velocity_sigma = 0.01;
  double stationary_speed = 0.05;

  void visit_fields(this auto& self, auto& visit) {
    visit_reference_filter(self, visit);
    visit_reference_gates(self, visit);
    visit_start(self, visit);
    visit_extensions(self, visit);
  }

  /// Rules across fields.
  void check(config::Offences& offences, const std::string& path) const {
    const std::string prefix = path.empty() ? "" : path + ".";
    const auto refuse = [&](const char* field, double value, std::string allowed) {
      offences.push_back({prefix + field, std::format("{}", value), std::move(allowed)});
    };
    if (!(max_range_m > min_range_m)) refuse("max_range_m", max_range_m, "more than min_range_m");
    if (!(match_radius_m >= voxel_size_m)) refuse("match_radius_m", match_radius_m, "at least voxel_size_m");
    const auto require_wider = [&](const char* field, double radius) {
      if (radius == 0.0 || (radius > match_radius_m && radius <= 10.0 * voxel_size_m)) return;
      refuse(field, radius, "0, or more than match_radius_m and at most 10 x voxel_size_m");
    };
    require_wider("wide_match_radius_m", wide_match_radius_m);
    require_wider("line_match_radius_m", line_match_radius_m);
    if (!(match_radius_m <= 10.0 * voxel_size_m)) {
      refuse("match_radius_m", match_radius_m, "at most 10 x voxel_size_m (the search is over voxels)");
    }
  }

 private:
  static void visit_reference_filter(auto& self, auto& visit) {
    visit.number("gravity_m", self.gravity_m, {9.7, 9.9}, "m/s^2", "local gravity, along -Y of the world");
    visit.number("imu_noise_gyro", self.imu_noise_gyro, {1e-6, 1.0}, "rad/s/sqrt(Hz)", "gyroscope noise density");
    visit.number("imu_noise_accel", self.imu_noise_accel, {1e-5, 10.0}, "m/s^2/sqrt(Hz)",
                 "accelerometer noise density");
    visit.number("gyro_bias_walk", self.gyro_bias_walk, {0.0, 0.1}, "rad/s/sqrt(s)", "random walk of the gyro bias");
    visit.number("accel_bias_walk", self.accel_bias_walk, {0.0, 1.0}, "m/s^2/sqrt(s)",
                 "random walk of the accelerometer bias");
    visit.number("measurement_noise", self.measurement_noise, {1e-6, 10.0}, "m^2",
                 "variance of one point-to-plane distance");
    visit.number("min_range_m", self.min_range_m, {0.0, 20.0}, "m", "nearest accepted point");
    visit.number("max_range_m", self.max_range_m, {0.5, 300.0}, "m", "farthest accepted point");
    visit.number("voxel_size_m", self.voxel_size_m, {0.02, 5.0}, "m", "edge of a local map voxel");
    visit.number("match_radius_m", self.match_radius_m, {0.05, 10.0}, "m", "neighbour radius of the plane fit");
    visit.number("map_window_m", self.map_window_m, {1.0, 500.0}, "m", "horizontal half extent of the local map");
    visit.number("map_window_y", self.map_window_y, {1.0, 200.0}, "m", "vertical half extent of the local map");
    visit.integer("iterations", self.iterations, {1, 50}, "passes", "passes of the iterated update, at most");
    visit.number("keyframe_dist_m", self.keyframe_dist_m, {0.1, 100.0}, "m", "distance that makes a keyframe");
    visit.number("keyframe_yaw_rad", self.keyframe_yaw_rad, {0.05, 3.14159265358979}, "rad",
                 "turn that makes a keyframe");
    visit.flag("use_scan_matching", self.use_scan_matching, "off: pure inertial integration");
  }

  static void visit_reference_gates(auto& self, auto& visit) {
    visit.integer("min_plane_points", self.min_plane_points, {3, 1000}, "points", "neighbours that a plane needs");
    visit.number("max_curvature", self.max_curvature, {1e-4, 1.0}, "1", "smallest over largest eigenvalue (blob)");
    visit.number("min_spread", self.min_spread, {0.0, 1.0}, "1", "middle over largest eigenvalue (line)");
    visit.number("max_centroid_offset", self.max_centroid_offset, {0.01, 1.0}, "match radii",
                 "in-plane distance of the centroid from the query point");
    visit.number("max_surface_roughness", self.max_surface_roughness, {1e-4, 2.0}, "m",
                 "RMS deviation of the neighbours from the plane");
    visit.number("min_observability", self.min_observability, {1e-6, 1.0}, "1", "floor of the per-axis weight");
    visit.number("max_scan_correction_m", self.max_scan_correction_m, {1e-3, 50.0}, "m",
                 "trust region: position, unless the prediction itself is less certain");
    visit.number("max_scan_velocity_corr", self.max_scan_velocity_corr, {1e-3, 100.0}, "m/s",
                 "trust region: velocity, unless the prediction itself is less certain");
    visit.number("max_innovation_sigma", self.max_innovation_sigma, {0.5, 100.0}, "sigma",
                 "Mahalanobis gate of one point, and of the trust region");
    visit.number("max_mean_innovation", self.max_mean_innovation, {1e-3, 10.0}, "m",
                 "mean absolute point-to-plane distance of a scan");
  }

  static void visit_start(auto& self, auto& visit) {
    visit.choice("start", self.start, {"at_rest", "moving"}, "state of motion when the first data arrive");
    visit.number("start_seconds", self.start_seconds, {0.05, 60.0}, "s", "IMU time averaged before the start");
    visit.number("rest_gyro_sigma", self.rest_gyro_sigma, {1e-4, 10.0}, "rad/s", "largest gyro spread at rest");
    visit.number("rest_gyro_mean", self.rest_gyro_mean, {1e-4, 1.0}, "rad/s", "largest mean gyro at rest");
    visit.number("rest_accel_sigma", self.rest_accel_sigma, {1e-3, 50.0}, "m/s^2", "largest accel spread at rest");
    visit.number("rest_accel_band", self.rest_accel_band, {0.01, 5.0}, "m/s^2",
                 "largest difference of the mean specific force from gravity");
    visit.number("max_start_tilt_rad", self.max_start_tilt_rad, {0.05, 3.1415927}, "rad",
                 "larger tilts at the start are taken for swapped axes");
    visit.number("gyro_bias_sigma", self.gyro_bias_sigma, {1e-6, 1.0}, "rad/s", "prior of a gyro bias");
    visit.number("accel_bias_sigma", self.accel_bias_sigma, {1e-5, 5.0}, "m/s^2", "prior of an accelerometer bias");
    visit.number("moving_velocity_sigma", self.moving_velocity_sigma, {0.1, 100.0}, "m/s",
                 "prior of the unknown velocity of a moving start");
    visit.number("moving_accel_sigma", self.moving_accel_sigma, {0.01, 20.0}, "m/s^2",
                 "acceleration that may hide in the mean specific force of a moving start");
    visit.number("velocity_known_sigma", self.velocity_known_sigma, {0.01, 20.0}, "m/s",
                 "a moving start is over when the velocity is this certain");
  }

  static void visit_extensions(auto& self, auto& visit) {
    visit.number("full_observability", self.full_observability, {0.0, 1.0}, "1",
                 "share of sum(n n^T) from which on an axis is not down-weighted; 1 is the reference's weighting");
    visit.flag("adapt_measurement_noise", self.adapt_measurement_noise,
               "estimate the variance of a point from each scan's residuals, at most measurement_noise");
    visit.number("noise_prior_points", self.noise_prior_points, {0.0, 1e6}, "points",
                 "weight of measurement_noise in that estimate");
    visit.number("residual_inflation", self.residual_inflation, {1.0, 100.0}, "1",
                 "factor on the residuals' variance: points that share a plane share its error");
    visit.number("blind_residual_inflation", self.blind_residual_inflation, {1.0, 100.0}, "1",
                 "the same while a direction is not observed: then errors of the normals weigh more");
    visit.number("degeneracy_threshold", self.degeneracy_threshold, {0.0, 0.3}, "1",
                 "mean squared sensitivity per point below which a direction is left to the IMU");
    visit.number(
        "degeneracy_signal_to_noise", self.degeneracy_signal_to_noise, {0.0, 1000.0}, "1",
        "sensitivity of a direction over what errors of the normals explain of it, below which it is left to the "
        "IMU");
    visit.number("salient_sigma", self.salient_sigma, {0.0, 100.0}, "sigma",
                 "along a direction that is left to the IMU, points still count whose plane faces along it by so many "
                 "sigma of its normal; 0: none");
    visit.number("salient_share", self.salient_share, {0.0, 1.0}, "1",
                 "such points as a share of all matched ones, mean of half a second of scans, below which they are "
                 "taken for chance");
    visit.number("contradiction_sigma", self.contradiction_sigma, {0.0, 100.0}, "sigma",
                 "velocity that scans take back from the IMU within 2 s along a hardly observed direction; 0: off");
    visit.number("moving_surface_sigma", self.moving_surface_sigma, {0.0, 100.0}, "sigma",
                 "distance from the map at which surfaces that few others face the way of have moved; 0: off");
    visit.integer("map_average_points", self.map_average_points, {1, 60000}, "points",
                  "1: a voxel keeps the point nearest its centre; more: the mean of its points, up to this weight");
    visit.flag("map_two_faces", self.map_two_faces,
               "a voxel keeps apart what was seen from opposite sides: walls thinner than 0.2 m");
    visit.number("map_drift", self.map_drift, {0.0, 1000.0}, "1",
                 "factor on the variance that each scan leaves in the published covariance for good");
    visit.number("wide_match_radius_m", self.wide_match_radius_m, {0.0, 10.0}, "m",
                 "neighbour radius for points that find too few within match_radius_m; 0: none");
    visit.number(
        "line_match_radius_m", self.line_match_radius_m, {0.0, 10.0}, "m",
        "neighbour radius for points on lines, as single beams draw, while fewer than a tenth of a scan finds planes");
    visit.number("imu_timeout_s", self.imu_timeout_s, {0.05, 10.0}, "s",
                 "scan time without IMU data after which scans go on alone, at constant velocity");
    visit.number("resume_max_gap_s", self.resume_max_gap_s, {0.0, 3.0}, "s",
                 "a restarted front end goes on where its predecessor was killed when the IMU data that it missed are "
                 "no longer than this; 0: it always begins a new session");
    visit.number("degraded_sigma_m", self.degraded_sigma_m, {0.001, 1000.0}, "m",
                 "largest position sigma of a pose that is reported as OK");
    visit.number("lost_sigma_m", self.lost_sigma_m, {0.001, 1000.0}, "m",
                 "largest position sigma of a pose that is still of use");
    visit.integer("min_scan_points", self.min_scan_points, {1, 100000}, "points", "fewer: the scan is skipped");
    visit.integer("min_matches", self.min_matches, {6, 100000}, "points", "planes that a scan needs");
    visit.number("min_plane_width_m", self.min_plane_width_m, {0.0, 1.0}, "m",
                 "spread of the neighbours along the narrow side of their plane below which noise may have made it "
                 "(line); 0: any");
    visit.number("smooth_plane_m", self.smooth_plane_m, {0.0, 1.0}, "m",
                 "a plane of this roughness counts half as much as a perfect one; 0: all count alike");
    visit.number("enough_smooth_planes", self.enough_smooth_planes, {0.0, 1e4}, "planes",
                 "where smooth planes hold each direction like so many, planes count half way between their smoothness "
                 "and its fourth power, with range_noise_m left out; 0: by their smoothness");
    visit.number("range_noise_m", self.range_noise_m, {0.0, 1.0}, "m",
                 "noise of a measured point, which enough_smooth_planes does not take for roughness of a plane");
    visit.number("shock_accel_m_s2", self.shock_accel_m_s2, {0.0, 1000.0}, "m/s^2",
                 "a sample that differs from gravity by more is a shock, believed as little as a clipped one; 0: none");
    visit.number("shock_gyro_rad_s", self.shock_gyro_rad_s, {0.0, 100.0}, "rad/s",
                 "the same for a sample that turns faster; 0: none");
    visit.number("map_memory_m", self.map_memory_m, {1.0, 500.0}, "m",
                 "the local map reaches so far where it is surely placed; map_window_m if that is more");
    visit.number("map_memory_sigma_m", self.map_memory_sigma_m, {1e-3, 10.0}, "m",
                 "growth of the position's sigma since then, up to which a part of the map counts as surely placed");
    visit.integer("max_scan_points", self.max_scan_points, {100, 200000}, "points",
                  "larger scans are thinned, and matched with at most so many");
    visit.integer("reanchor_scans", self.reanchor_scans, {1, 10000}, "scans",
                  "contradicting scans in a row after which the local map is begun anew");
    visit.number("keyframe_max_seconds", self.keyframe_max_seconds, {0.5, 5.0}, "s", "time that makes a keyframe");
    visit.number("keyframe_cloud_seconds", self.keyframe_cloud_seconds, {0.01, 5.0}, "s",
                 "scans of this time make a keyframe's cloud");
    visit.number("max_scan_delay_s", self.max_scan_delay_s, {0.05, 10.0}, "s", "IMU history kept for late scans");
    visit.number("stationary_speed", self.stationary_speed, {1e-3, 1.0}, "m/s",
                 "slower counts as standing, up to three sigma; four times that, two sigma included, after a drive");
    visit.number("zero_velocity_sigma", self.zero_velocity_sigma, {0.0, 1.0}, "m/s",
                 "what standing says about the velocity, four times a second; 0: standing is not used");
    visit.number("scan_voxel_m", self.scan_voxel_m, {0.0, 5.0}, "m",
                 "scans of more than max_scan_points keep one point per such voxel before anything else; 0: all");
    visit.flag("deskew", self.deskew, "off: points are taken as measured at the scan's end (no point times)");
    visit.flag("project_degenerate", self.project_degenerate,
               "off: directions that the scan does not observe are corrected and trusted like all others");
    visit.flag("quarantine", self.quarantine,
               "off: points of scans that contradicted the map take part in plane fits at once");
  }
};

}  // namespace ignis
