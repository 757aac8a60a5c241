// SPDX-License-Identifier: Apache-2.0
#include "backend/smoother.h"

#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <format>

#include "backend/incremental_solver.h"
#include "backend/information.h"
#include "backend/keyframe_check.h"
#include "backend/keyframe_factors.h"
#include "backend/loop_search.h"
#include "backend/relative_pose_factor.h"
#include "common/config_check.h"

namespace ignis {
namespace {

using gtsam::symbol_shorthand::X;

constexpr double kMovedPosition = 1e-4;  // [m]
constexpr double kMovedRotation = 1e-5;  // [rad]
constexpr int kUpdatesAfterLoop = 2;     // Gauss-Newton steps that follow a large correction

/// The largest chi-square that is believed of an error with `directions` degrees of freedom.
double chi_square_bound(Eigen::Index directions, double probability) {
  return boost::math::quantile(boost::math::chi_squared(static_cast<double>(directions)), probability);
}

bool has_moved(const Pose& a, const Pose& b) {
  const Vector6d d = body_difference(a, b);
  return d.head<3>().norm() > kMovedRotation || d.tail<3>().norm() > kMovedPosition;
}

}  // namespace

class Smoother::Impl {
 public:
  Impl(const BackendConfig& config, const LoopGates& gates) : config_(config), gates_(gates), solver_(config.solver) {}

  SmootherUpdate add_keyframe(const Keyframe& keyframe) {
    SmootherUpdate update;
    update.verdict = verdict_on(keyframe, update.reason);
    if (update.accepted()) insert(keyframe, update);
    if (update.accepted()) {
      refresh_poses();
      update.loop = close_loop(keyframe.state.utime);
      withdraw_contradicted(update.withdrawn);
      ++revision_;
    }
    count(update.verdict);
    publish(update);
    return update;
  }

  SmootherUpdate add_loop(const LoopMeasurement& measurement) {
    SmootherUpdate update;
    LoopProposal proposal;
    proposal.information = measurement.information;
    proposal.result.from_id = measurement.from_id;
    proposal.result.to_id = measurement.to_id;
    proposal.result.T_to_from = measurement.T_to_from;
    proposal.result.reason = LoopReason::kSolverRefused;
    const Node* from = node_of(measurement.from_id);
    const Node* to = node_of(measurement.to_id);
    if (from == nullptr || to == nullptr || from == to) {
      proposal.result.reason_text = "the loop names keyframes that the graph does not hold";
    } else if (!measurement.T_to_from.all_finite() || !measurement.information.allFinite()) {
      proposal.result.reason_text = "the loop is not finite";
    } else {
      proposal.result.utime = from->end.utime;
      put_on_trial(proposal.result, whitening(measurement.information));
      withdraw_contradicted(update.withdrawn);
      ++revision_;
    }
    update.verdict = KeyframeVerdict::kAccepted;
    proposal.result.keyframes = static_cast<int>(nodes_.size());
    update.loop = proposal.result;
    publish(update);
    return update;
  }

  void accept_gap_before(std::int32_t id) { expected_id_ = std::max(expected_id_, id); }

  [[nodiscard]] const std::vector<KeyframePose>& poses() const { return poses_; }
  [[nodiscard]] std::int32_t revision() const { return revision_; }
  [[nodiscard]] std::int32_t expected_id() const { return expected_id_; }

  [[nodiscard]] Pose T_map_odom() const {
    return nodes_.empty() ? Pose() : poses_.back().T_map_body * nodes_.back().end.T_odom_body.inverse();
  }

  [[nodiscard]] SmootherStats stats() const {
    SmootherStats stats = stats_;
    stats.keyframes = static_cast<int>(nodes_.size());
    stats.loops_kept = static_cast<int>(loops_.size());
    stats.solver_rebuilds = solver_.rebuilds();
    return stats;
  }

  [[nodiscard]] PoseGraph pose_graph() const {
    PoseGraph graph;
    graph.vertices = poses_;
    for (std::size_t i = 1; i < nodes_.size(); ++i) {
      const WhiteningRows& rows = nodes_[i].odometry;
      const Pose T_from_to = nodes_[i - 1].end.T_odom_body.inverse() * nodes_[i].end.T_odom_body;
      graph.edges.push_back({nodes_[i - 1].end.id, nodes_[i].end.id, T_from_to, rows.transpose() * rows, false});
    }
    for (const Loop& loop : loops_) {
      graph.edges.push_back(
          {loop.result.to_id, loop.result.from_id, loop.result.T_to_from, loop.rows.transpose() * loop.rows, true});
    }
    return graph;
  }

 private:
  struct Node {
    LinkEnd end;
    WhiteningRows odometry;  ///< of the link to the previous node, for the exported graph
  };
  struct Loop {
    LoopResult result;
    FactorId factor;
    WhiteningRows rows;
  };

  KeyframeVerdict verdict_on(const Keyframe& keyframe, std::string& reason) const {
    if (!nodes_.empty() && keyframe.session != session_) {
      reason = std::format("session {} while the graph holds session {}", keyframe.session, session_);
      return KeyframeVerdict::kOtherSession;
    }
    if (keyframe.id < expected_id_) {
      reason = std::format("duplicate: id {} was handled before", keyframe.id);
      return KeyframeVerdict::kDuplicate;
    }
    if (keyframe.id > expected_id_) {
      reason = std::format("gap: expected id {}, got {}", expected_id_, keyframe.id);
      return KeyframeVerdict::kGap;
    }
    reason = keyframe_problem(keyframe);
    if (reason.empty() && !nodes_.empty() && keyframe.state.utime <= nodes_.back().end.utime) {
      reason = "the stamp does not come after the previous keyframe's";
    }
    return reason.empty() ? KeyframeVerdict::kAccepted : KeyframeVerdict::kInvalid;
  }

  void count(KeyframeVerdict verdict) {
    switch (verdict) {
      case KeyframeVerdict::kDuplicate:
        ++stats_.duplicates;
        break;
      case KeyframeVerdict::kGap:
        ++stats_.gaps;
        break;
      case KeyframeVerdict::kInvalid:
      case KeyframeVerdict::kSolver:
        // Sent again it would be no better: wait for the next one.
        ++stats_.invalid;
        ++expected_id_;
        break;
      case KeyframeVerdict::kOtherSession:
      case KeyframeVerdict::kAccepted:
        break;
    }
  }

  /// Why the keyframe's IMU samples cannot link it to the newest node, or nothing.
  [[nodiscard]] std::optional<std::string> imu_obstacle(const Keyframe& keyframe) const {
    const LinkEnd& previous = nodes_.back().end;
    if (keyframe.id != previous.id + 1) return "keyframes are missing before this one";
    if (!keyframe.imu_complete) return "the front end reports an IMU gap";
    if (keyframe.previous_utime != previous.utime) return "the interval does not begin at the previous keyframe";
    return imu_problem(keyframe.imu, previous.utime, keyframe.state.utime, config_.imu);
  }

  void insert(const Keyframe& keyframe, SmootherUpdate& update) {
    Node node{{keyframe.id, keyframe.state.utime, keyframe.state.T_odom_body, {}}, {}};
    const SolverOutcome outcome = nodes_.empty() ? insert_first(keyframe) : insert_next(keyframe, node, update.reason);
    if (!outcome.accepted) {
      update.verdict = KeyframeVerdict::kSolver;
      update.reason = outcome.reason;
      return;
    }
    session_ = keyframe.session;
    expected_id_ = keyframe.id + 1;
    angular_rate_ = keyframe.state.angular_rate;
    nodes_.push_back(std::move(node));
    clouds_.push_back(keyframe.cloud);
  }

  SolverOutcome insert_first(const Keyframe& keyframe) {
    gtsam::NonlinearFactorGraph factors;
    gtsam::Values values;
    add_first_keyframe(keyframe, config_, factors, values);
    return solver_.add(factors, values);
  }

  SolverOutcome insert_next(const Keyframe& keyframe, Node& node, std::string& left_out) {
    LinkEnd previous = nodes_.back().end;
    previous.estimate = estimate_of(solver_.estimate(), previous.id);
    // The information belongs to the interval since id - 1 and says nothing about a longer one.
    WhiteningRows odometry(0, 6);
    if (keyframe.id == previous.id + 1) {
      odometry = whitening_with_floor(config_.scan_information_scale * keyframe.scan_information,
                                      config_.odometry_floor_rad, config_.odometry_floor_m);
    }
    node.odometry = odometry.rows() > 0 ? odometry : loose_rows(config_);
    const std::optional<std::string> obstacle = imu_obstacle(keyframe);
    SolverOutcome outcome = link(keyframe, previous, !obstacle, odometry);
    if (outcome.accepted && !obstacle) return outcome;
    left_out = "linked without IMU: " + obstacle.value_or(outcome.reason);
    if (!obstacle) outcome = link(keyframe, previous, false, odometry);
    if (outcome.accepted) ++stats_.without_imu;
    return outcome;
  }

  SolverOutcome link(const Keyframe& keyframe, const LinkEnd& previous, bool use_imu, const WhiteningRows& odometry) {
    gtsam::NonlinearFactorGraph factors;
    gtsam::Values values;
    add_next_keyframe(keyframe, previous, use_imu, odometry, config_, factors, values);
    return solver_.add(factors, values);
  }

  void refresh_poses() {
    poses_.clear();
    for (const Node& node : nodes_) {
      poses_.push_back({node.end.id, estimate_of(solver_.estimate(), node.end.id).T_odom_body});
    }
  }

  LoopResult close_loop(Utime utime) {
    LoopProposal proposal;
    if (!config_.use_loop_closing) {
      proposal.result.reason = LoopReason::kDisabled;
    } else if (last_loop_id_ >= 0 && poses_.back().id - last_loop_id_ < config_.loop_min_spacing) {
      proposal.result.reason = LoopReason::kTooSoon;
    } else {
      proposal = search_loop(poses_, clouds_, config_, gates_);
    }
    LoopResult& result = proposal.result;
    result.utime = utime;
    result.keyframes = static_cast<int>(nodes_.size());
    if (result.reason_text.empty()) result.reason_text = text(result.reason);
    if (result.accepted()) {
      put_on_trial(result, whitening_with_floor(proposal.information / config_.loop_noise_inflation,
                                                config_.loop_floor_rad, config_.loop_floor_m));
    }
    return result;
  }

  /// Adds the loop's factor and looks what it does to the graph. In a linear graph the rise of the chi-square is the
  /// squared Mahalanobis distance of the loop from what the graph had predicted, with the covariance of both.
  void put_on_trial(LoopResult& result, const WhiteningRows& rows) {
    const double before = solver_.half_chi_square();
    gtsam::NonlinearFactorGraph factors;
    if (rows.rows() > 0) {
      factors.push_back(make_relative_pose_factor(X(result.to_id), X(result.from_id), result.T_to_from, rows));
    }
    const SolverOutcome outcome =
        factors.empty() ? SolverOutcome{false, "the loop holds no direction", {}} : solver_.add(factors, {});
    if (!outcome.accepted) {
      result.reason = LoopReason::kSolverRefused;
      result.reason_text = outcome.reason;
      return;
    }
    solver_.settle(kUpdatesAfterLoop);
    result.reason = LoopReason::kAccepted;
    loops_.push_back({result, outcome.factors.front(), rows});
    const double rise = 2.0 * (solver_.half_chi_square() - before);
    const double bound = chi_square_bound(rows.rows(), config_.loop_consistency_probability);
    if (!(rise <= bound)) {
      result = withdraw(loops_.size() - 1, rise, bound);
    } else {
      last_loop_id_ = result.from_id;
    }
    refresh_poses();
  }

  /// Takes out, worst first, every loop whose own error has become unbelievable.
  void withdraw_contradicted(std::vector<LoopResult>& withdrawn) {
    while (true) {
      double worst = 1.0;
      std::size_t index = loops_.size();
      for (std::size_t i = 0; i < loops_.size(); ++i) {
        const double share = own_chi_square(loops_[i]) / own_bound(loops_[i]);
        if (share > worst) {
          worst = share;
          index = i;
        }
      }
      if (index == loops_.size()) return;
      withdrawn.push_back(withdraw(index, own_chi_square(loops_[index]), own_bound(loops_[index])));
      refresh_poses();
    }
  }

  double own_chi_square(const Loop& loop) { return 2.0 * solver_.half_chi_square(loop.factor); }
  [[nodiscard]] double own_bound(const Loop& loop) const {
    return chi_square_bound(loop.rows.rows(), config_.loop_consistency_probability);
  }

  LoopResult withdraw(std::size_t index, double chi_square, double bound) {
    LoopResult result = loops_[index].result;
    result.reason = LoopReason::kWithdrawn;
    result.reason_text = std::format("withdrawn: chi-square {:.1f} exceeds {:.1f}", chi_square, bound);
    const FactorId factor = loops_[index].factor;
    loops_.erase(loops_.begin() + static_cast<std::ptrdiff_t>(index));
    static_cast<void>(solver_.remove({&factor, 1}));
    solver_.settle(kUpdatesAfterLoop);
    ++stats_.loops_withdrawn;
    return result;
  }

  [[nodiscard]] const Node* node_of(std::int32_t id) const {
    const auto found = std::ranges::lower_bound(nodes_, id, {}, [](const Node& node) { return node.end.id; });
    return found != nodes_.end() && found->end.id == id ? &*found : nullptr;
  }

  void publish(SmootherUpdate& update) {
    update.revision = revision_;
    update.expected_id = expected_id_;
    update.T_map_odom = T_map_odom();
    if (nodes_.empty()) return;
    const LinkEnd& end = nodes_.back().end;
    update.newest = estimate_of(solver_.estimate(), end.id);
    update.newest.utime = end.utime;
    update.newest.angular_rate = angular_rate_;
    if (!update.accepted()) return;
    if (const auto covariance = solver_.marginal_covariance(X(end.id))) {
      update.covariance = *covariance;
      update.covariance_valid = true;
    }
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      const bool is_new = i >= published_.size();
      if (!is_new && !has_moved(published_[i], poses_[i].T_map_body)) continue;
      if (is_new) published_.emplace_back();
      published_[i] = poses_[i].T_map_body;
      update.moved.push_back(poses_[i]);
    }
  }

  BackendConfig config_;
  LoopGates gates_;
  IncrementalSolver solver_;
  std::vector<Node> nodes_;
  std::vector<std::vector<CloudPoint>> clouds_;  ///< body frame, one per node
  std::vector<KeyframePose> poses_;              ///< as the graph places them, one per node
  std::vector<Pose> published_;                  ///< as last listed in an update
  std::vector<Loop> loops_;
  SmootherStats stats_;
  Eigen::Vector3d angular_rate_ = Eigen::Vector3d::Zero();
  std::int32_t session_ = 0;
  std::int32_t expected_id_ = 0;
  std::int32_t last_loop_id_ = -1;
  std::int32_t revision_ = 0;
};

Smoother::Smoother(const BackendConfig& config, const LoopGates& gates) {
  config::require_valid(config, "backend");
  config::require_valid(gates, "frontend");
  impl_ = std::make_unique<Impl>(config, gates);
}

Smoother::~Smoother() = default;
Smoother::Smoother(Smoother&&) noexcept = default;
Smoother& Smoother::operator=(Smoother&&) noexcept = default;

SmootherUpdate Smoother::add_keyframe(const Keyframe& keyframe) { return impl_->add_keyframe(keyframe); }
SmootherUpdate Smoother::add_loop(const LoopMeasurement& measurement) { return impl_->add_loop(measurement); }
void Smoother::accept_gap_before(std::int32_t id) { impl_->accept_gap_before(id); }
const std::vector<KeyframePose>& Smoother::all_poses() const { return impl_->poses(); }
Pose Smoother::T_map_odom() const { return impl_->T_map_odom(); }
std::int32_t Smoother::revision() const { return impl_->revision(); }
std::int32_t Smoother::expected_id() const { return impl_->expected_id(); }
SmootherStats Smoother::stats() const { return impl_->stats(); }
PoseGraph Smoother::pose_graph() const { return impl_->pose_graph(); }

}  // namespace ignis
