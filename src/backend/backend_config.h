// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "backend/factors/preintegration.h"
#include "backend/loops/loop_matcher.h"
#include "backend/solver/incremental_solver.h"
#include "common/config_fields.h"

namespace ignis {

/// Parameters of the back end, section `backend` of the configuration. The thresholds of the loop closer itself stand
/// in LoopGates.
struct BackendConfig {
  ImuNoise imu;
  SolverConfig solver;
  LoopMatcherConfig matcher;

  // First keyframe. The graph does not estimate gravity, so its tilt must be honest.
  double prior_tilt_deg = 1.5;
  double prior_yaw_rad = 1e-3;
  double prior_position_m = 1e-3;
  double prior_velocity = 0.5;
  double prior_gyro_bias = 0.005;
  double prior_accel_bias = 0.1;

  // Relative pose from scan matching.
  double scan_information_scale = 1.0;
  double odometry_floor_m = 0.001;
  double odometry_floor_rad = 0.0002;

  // What links two keyframes when the IMU does not.
  double loose_position_m = 0.5;
  double loose_rotation_rad = 0.05;
  double loose_velocity = 1.0;

  double stationary_velocity = 0.02;

  int estimated_keyframes = 4000;
  double retired_spacing_m = 2.0;

  // Loops.
  double cloud_voxel_m = 0.15;
  double cloud_memory_mb = 256.0;
  bool use_loop_closing = true;
  int loop_min_spacing = 2;
  int loop_max_candidates = 3;
  double loop_noise_inflation = 5.0;
  double loop_floor_m = 0.01;
  double loop_floor_rad = 0.0015;
  double loop_residual_weight = 2.0;
  double loop_consistency_probability = 0.999;
  double loop_min_travel_m = 1.0;
  double loop_widening_sigmas = 3.0;
  double loop_max_widening_m = 8.0;
  std::string loop_correction_gate = "distance";
  double loop_drift_scale = 2.0;
  double loop_support_beyond_m = 1.0;
  double loop_support_apart_m = 15.0;
  int loop_trial_keyframes = 10;

  // Batch solution that checks the incremental one.
  double shadow_swap_m = 0.01;
  double shadow_swap_rad = 0.001;

  void visit_fields(this auto& self, auto& visit) {
    visit.section("imu", self.imu, "noise of the inertial unit as the graph assumes it");
    visit.section("solver", self.solver, "when iSAM2 linearises anew");
    visit.section("matcher", self.matcher, "scan match that confirms a loop");
    visit.number("prior_tilt_deg", self.prior_tilt_deg, {0.01, 45.0}, "deg",
                 "sigma of roll and pitch of the first keyframe");
    visit.number("prior_yaw_rad", self.prior_yaw_rad, {1e-6, 1.0}, "rad", "sigma of its heading");
    visit.number("prior_position_m", self.prior_position_m, {1e-6, 10.0}, "m", "sigma of its position");
    visit.number("prior_velocity", self.prior_velocity, {1e-3, 100.0}, "m/s", "smallest sigma of its velocity");
    visit.number("prior_gyro_bias", self.prior_gyro_bias, {1e-6, 1.0}, "rad/s", "sigma of its gyro bias");
    visit.number("prior_accel_bias", self.prior_accel_bias, {1e-5, 5.0}, "m/s^2", "sigma of its accelerometer bias");
    visit.number("scan_information_scale", self.scan_information_scale, {1e-6, 10.0}, "1",
                 "factor on the information of scan matching: below 1 where residuals of one wall are not independent, "
                 "above 1 where the front end's noise is cautious");
    visit.number("odometry_floor_m", self.odometry_floor_m, {1e-6, 1.0}, "m",
                 "sigma of an independent position error per keyframe");
    visit.number("odometry_floor_rad", self.odometry_floor_rad, {1e-7, 1.0}, "rad",
                 "sigma of an independent attitude error per keyframe");
    visit.number("loose_position_m", self.loose_position_m, {1e-3, 100.0}, "m",
                 "sigma of the odometry between keyframes without IMU");
    visit.number("loose_rotation_rad", self.loose_rotation_rad, {1e-4, 3.0}, "rad", "the same, attitude");
    visit.number("loose_velocity", self.loose_velocity, {1e-3, 100.0}, "m/s", "the same, velocity");
    visit.number("stationary_velocity", self.stationary_velocity, {1e-4, 1.0}, "m/s",
                 "sigma of the zero velocity of a keyframe that stood still");
    visit.integer("estimated_keyframes", self.estimated_keyframes, {20, 1000000}, "keyframes",
                  "newest keyframes whose poses the graph estimates; older ones stay where they are, as known places");
    visit.number(
        "retired_spacing_m", self.retired_spacing_m, {0.0, 100.0}, "m",
        "of keyframes that have retired and look the same way at most this far apart, the first keeps its cloud "
        "and loops, the others their poses alone; 0: all are kept");
    visit.number("cloud_voxel_m", self.cloud_voxel_m, {0.01, 2.0}, "m",
                 "of a keyframe's cloud one point per voxel is kept, in memory and in the journal");
    visit.number("cloud_memory_mb", self.cloud_memory_mb, {0.1, 1e6}, "MB",
                 "clouds in memory; others are read back from the journal, and forgotten where there is none");
    visit.flag("use_loop_closing", self.use_loop_closing, "false: smoothing only");
    visit.integer("loop_min_spacing", self.loop_min_spacing, {1, 1000}, "keyframes",
                  "fewest keyframes from one accepted loop to the next search");
    visit.integer("loop_max_candidates", self.loop_max_candidates, {1, 50}, "1",
                  "candidates that are matched per keyframe");
    visit.number("loop_noise_inflation", self.loop_noise_inflation, {1.0, 1000.0}, "1",
                 "factor on the variance of a match: its residuals are not independent");
    visit.number("loop_floor_m", self.loop_floor_m, {1e-6, 1.0}, "m",
                 "sigma of an independent position error of a loop");
    visit.number("loop_floor_rad", self.loop_floor_rad, {1e-7, 1.0}, "rad",
                 "sigma of an independent attitude error of a loop");
    visit.number(
        "loop_residual_weight", self.loop_residual_weight, {0.0, 100.0}, "1",
        "both sigmas grow with the match's mean residual, the position's by so many times the residual: surfaces "
        "that do not fit are moved or blurred, and pull the match with them");
    visit.number("loop_consistency_probability", self.loop_consistency_probability, {0.5, 0.9999999}, "1",
                 "a loop is refused or withdrawn when its chi-square exceeds this quantile");
    visit.number("loop_min_travel_m", self.loop_min_travel_m, {0.0, 1000.0}, "m",
                 "way from one accepted loop to the next search: a parked vehicle has nothing new to tell");
    visit.number("loop_widening_sigmas", self.loop_widening_sigmas, {0.0, 10.0}, "1",
                 "the candidate test reaches farther by so many sigmas of the odometry's drift; 0: it does not");
    visit.number("loop_max_widening_m", self.loop_max_widening_m, {0.0, 100.0}, "m", "but at most by this");
    visit.choice("loop_correction_gate", self.loop_correction_gate, {"distance", "covariance"},
                 "what bounds the correction of a loop: frontend.loop_max_correction_m besides the chi-square test "
                 "against the odometry's drift, or that test alone");
    visit.number("loop_drift_scale", self.loop_drift_scale, {0.1, 100.0}, "1",
                 "factor on the sigmas of the odometry's drift and of loops when they are tested against each other: "
                 "their errors are correlated");
    visit.number("loop_support_beyond_m", self.loop_support_beyond_m, {0.01, 1000.0}, "m",
                 "a loop about whose place odometry is less sure than this waits until a second one agrees with it");
    visit.number("loop_support_apart_m", self.loop_support_apart_m, {0.0, 1000.0}, "m",
                 "the second one, unless it is in the graph already, at both ends at least so far from the first: "
                 "nearby it would look the same in any place that looks alike");
    visit.integer(
        "loop_trial_keyframes", self.loop_trial_keyframes, {1, 10000}, "keyframes",
        "a loop on trial that so many later keyframes do not contradict is kept, once its place is pinned down");
    visit.number("shadow_swap_m", self.shadow_swap_m, {1e-6, 10.0}, "m",
                 "the batch solution replaces the incremental one when a position differs by more");
    visit.number("shadow_swap_rad", self.shadow_swap_rad, {1e-7, 1.0}, "rad", "the same for an attitude");
  }
};

}  // namespace ignis
