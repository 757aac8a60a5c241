// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframes/keyframe_chain.h"

#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <format>
#include <limits>
#include <optional>

#include "backend/factors/information.h"
#include "backend/factors/keyframe_factors.h"
#include "backend/factors/loose_odometry.h"
#include "backend/factors/scan_trust.h"
#include "backend/keyframes/keyframe_check.h"
#include "backend/loops/plane_map.h"

namespace ignis {
namespace {

/// Why the keyframe's IMU samples cannot link it to the newest node, or nothing.
std::optional<std::string> imu_obstacle(const Keyframe& keyframe, const LinkEnd& previous, const ImuNoise& noise) {
  if (keyframe.id != previous.id + 1) return "keyframes are missing before this one";
  if (!keyframe.imu_complete) return "the front end reports an IMU gap";
  if (keyframe.previous_utime != previous.filter.utime) return "the interval does not begin at the previous keyframe";
  return imu_problem(keyframe.imu, previous.filter.utime, keyframe.state.utime, noise);
}

/// Of the pose, attitude then position, both in body axes.
Matrix6d pose_covariance(const Keyframe& keyframe) {
  Matrix6d to_body = Matrix6d::Identity();
  to_body.bottomRightCorner<3, 3>() = keyframe.state.T_odom_body.rotation.conjugate().toRotationMatrix();
  return to_body * keyframe.covariance.topLeftCorner<6, 6>() * to_body.transpose();
}

SolverOutcome insert(const KeyframeLink& link, const BackendConfig& config, IncrementalSolver& solver) {
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  add_link_factors(link, config, factors);
  insert_estimate(link.id, link.guess, values);
  return solver.add(factors, values);
}

SolverOutcome insert_first(const Keyframe& keyframe, const BackendConfig& config, IncrementalSolver& solver,
                           KeyframeLink& link) {
  link = first_link(keyframe, config);
  return insert(link, config, solver);
}

SolverOutcome insert_next(const Keyframe& keyframe, const BackendConfig& config, IncrementalSolver& solver,
                          SmootherState& state, GraphNode& node, KeyframeLink& link, std::string& left_out) {
  LinkEnd previous = state.nodes.back().end;
  previous.estimate = estimate_of(solver, previous.id);
  // The information belongs to the interval since id - 1 and says nothing about a longer one.
  WhiteningRows odometry(0, 6);
  if (keyframe.id == previous.id + 1) {
    odometry = whitening_with_floor(config.scan_information_scale * trusted_information(keyframe.scan_information),
                                    config.odometry_floor_rad, config.odometry_floor_m);
  }
  node.odometry = odometry.rows() > 0 ? odometry : loose_rows(config);
  const std::optional<std::string> obstacle = imu_obstacle(keyframe, previous, config.imu);
  link = next_link(keyframe, previous, !obstacle, odometry, config);
  SolverOutcome outcome = insert(link, config, solver);
  if (outcome.accepted && !obstacle) return outcome;
  left_out = "linked without IMU: " + obstacle.value_or(outcome.reason);
  if (!obstacle) {
    link = next_link(keyframe, previous, false, odometry, config);
    outcome = insert(link, config, solver);
  }
  if (outcome.accepted) ++state.stats.without_imu;
  return outcome;
}

/// Whether a keyframe that was absorbed, or refused, could have the stamp of `keyframe`: between those of the nodes
/// around its id.
bool comes_between(const Keyframe& keyframe, const std::vector<GraphNode>& nodes) {
  const auto id_of = [](const GraphNode& node) { return node.end.id; };
  const auto later = std::ranges::upper_bound(nodes, keyframe.id, {}, id_of);
  if (later == nodes.end() || keyframe.state.utime >= later->end.filter.utime) return false;
  return later == nodes.begin() || keyframe.state.utime > std::prev(later)->end.filter.utime;
}

}  // namespace

KeyframeVerdict verdict_on(const Keyframe& keyframe, const SmootherState& state, std::string& reason) {
  if (!state.nodes.empty() && keyframe.session != state.session) {
    reason = std::format("session {} while the graph holds session {}", keyframe.session, state.session);
    return KeyframeVerdict::kOtherSession;
  }
  if (keyframe.id < state.expected_id) {
    reason = std::format("duplicate: id {} was handled before", keyframe.id);
    return KeyframeVerdict::kDuplicate;
  }
  if (keyframe.id > state.expected_id) {
    reason = std::format("gap: expected id {}, got {}", state.expected_id, keyframe.id);
    return KeyframeVerdict::kGap;
  }
  reason = keyframe_problem(keyframe);
  if (reason.empty() && !state.nodes.empty()) {
    const LinkEnd& newest = state.nodes.back().end;
    reason = succession_problem(keyframe, newest.filter.utime, newest.filter.T_odom_body);
  }
  return reason.empty() ? KeyframeVerdict::kAccepted : KeyframeVerdict::kInvalid;
}

bool is_of_another_drive(const Keyframe& keyframe, const SmootherState& state) {
  if (state.nodes.empty() || keyframe.session != state.session) return false;
  if (const GraphNode* node = state.node_of(keyframe.id)) {
    return node->end.filter.utime != keyframe.state.utime ||
           node->end.filter.T_odom_body.translation != keyframe.state.T_odom_body.translation;
  }
  const LinkEnd& newest = state.nodes.back().end;
  if (keyframe.id == newest.id + 1) return keyframe.previous_utime != newest.filter.utime;
  return keyframe.id < newest.id && !comes_between(keyframe, state.nodes);
}

SolverOutcome append_keyframe(const Keyframe& keyframe, const BackendConfig& config, IncrementalSolver& solver,
                              SmootherState& state, std::string& left_out) {
  GraphNode node{{keyframe.id, keyframe.state, {}}, {}, pose_covariance(keyframe)};
  KeyframeLink link;
  SolverOutcome outcome = state.nodes.empty() ? insert_first(keyframe, config, solver, link)
                                              : insert_next(keyframe, config, solver, state, node, link, left_out);
  if (!outcome.accepted) return outcome;
  state.session = keyframe.session;
  state.expected_id = keyframe.id + 1;
  state.angular_rate = keyframe.state.angular_rate;
  state.nodes.push_back(std::move(node));
  state.links.push_back(std::move(link));
  state.clouds.add(keyframe.id, compact(one_per_voxel(keyframe.cloud, config.cloud_voxel_m)));
  return outcome;
}

void count_verdict(KeyframeVerdict verdict, SmootherState& state) {
  switch (verdict) {
    case KeyframeVerdict::kDuplicate:
      ++state.stats.duplicates;
      break;
    case KeyframeVerdict::kGap:
      ++state.stats.gaps;
      break;
    case KeyframeVerdict::kInvalid:
    case KeyframeVerdict::kSolver:
      ++state.stats.invalid;
      if (state.expected_id < std::numeric_limits<std::int32_t>::max()) ++state.expected_id;
      break;
    case KeyframeVerdict::kOtherSession:
    case KeyframeVerdict::kAccepted:
      break;
  }
}

}  // namespace ignis
