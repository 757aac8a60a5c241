// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backend/backend_config.h"
#include "backend/keyframe_pose.h"
#include "backend/loop_result.h"
#include "backend/pose_graph_file.h"
#include "common/keyframe.h"
#include "common/loop_gates.h"

namespace ignis {

/// Why a keyframe did not enter the graph.
enum class KeyframeVerdict : std::uint8_t {
  kAccepted,
  kDuplicate,     ///< an id that was handled before: nothing to do
  kGap,           ///< an earlier id is missing: ask for it again
  kOtherSession,  ///< the front end was reset: begin a new smoother
  kInvalid,       ///< not finite or contradictory: dropped for good, the next one is linked across it
  kSolver,        ///< the solver refused it: dropped for good as well
};

/// What a call changed.
struct SmootherUpdate {
  KeyframeVerdict verdict = KeyframeVerdict::kInvalid;
  std::string reason;               ///< why it was refused, or what was left out of an accepted keyframe
  std::int32_t revision = 0;        ///< +1 per change of the graph
  std::int32_t expected_id = 0;     ///< id that may come next
  std::vector<KeyframePose> moved;  ///< new, or moved by more than 0.1 mm or 0.01 mrad since last listed
  Pose T_map_odom;
  Matrix6d covariance = Matrix6d::Zero();  ///< of the newest pose in map; attitude then position, body axes
  bool covariance_valid = false;
  NavState newest;                    ///< state of the newest keyframe in map (fields named odom are map here)
  std::optional<LoopResult> loop;     ///< of this keyframe
  std::vector<LoopResult> withdrawn;  ///< earlier loops that the graph contradicts by now

  [[nodiscard]] bool accepted() const { return verdict == KeyframeVerdict::kAccepted; }
};

/// Counters since construction.
struct SmootherStats {
  int keyframes = 0;
  int loops_kept = 0;
  int loops_withdrawn = 0;
  int duplicates = 0;
  int gaps = 0;
  int invalid = 0;
  int without_imu = 0;  ///< keyframes linked without preintegration
  int solver_rebuilds = 0;
};

/// A loop that was found elsewhere.
struct LoopMeasurement {
  std::int32_t from_id = 0;  ///< the later keyframe
  std::int32_t to_id = 0;
  Pose T_to_from;
  Matrix6d information = Matrix6d::Zero();  ///< attitude then position, body axes of `from`; taken as it is
};

/// Fixed-history smoother over keyframes: pose, velocity and biases of each, linked by preintegrated IMU, by what scan
/// matching alone says of the relative motion, by zero velocity at rest, and by loops. Frame map equals frame odom at
/// the first keyframe and drifts away from it as odometry does. World +Y up.
///
/// A new loop is on trial: if it raises the chi-square of the graph beyond the configured quantile it is taken out
/// before anyone sees its effect; if later evidence contradicts it, it is taken out then. Deterministic, no clock; one
/// thread.
class Smoother {
 public:
  /// Throws config::ConfigError naming every offence.
  Smoother(const BackendConfig& config, const LoopGates& gates);
  ~Smoother();
  Smoother(Smoother&&) noexcept;
  Smoother& operator=(Smoother&&) noexcept;

  /// Keyframes enter in the order of their ids, beginning at 0.
  [[nodiscard]] SmootherUpdate add_keyframe(const Keyframe& keyframe);

  /// Stops waiting for ids before `id`, which nobody can send any more. The next keyframe is linked across the hole by
  /// loose odometry.
  void accept_gap_before(std::int32_t id);

  /// Puts a loop on trial as if it had been found here. `loop` tells the outcome.
  [[nodiscard]] SmootherUpdate add_loop(const LoopMeasurement& measurement);

  /// All keyframes as the graph places them, ascending ids.
  [[nodiscard]] const std::vector<KeyframePose>& all_poses() const;
  [[nodiscard]] Pose T_map_odom() const;
  [[nodiscard]] std::int32_t revision() const;
  [[nodiscard]] std::int32_t expected_id() const;
  [[nodiscard]] SmootherStats stats() const;

  /// Poses, odometry and loops for keyframes.g2o.
  [[nodiscard]] PoseGraph pose_graph() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ignis
