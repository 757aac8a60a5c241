// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "backend/backend_config.h"
#include "backend/journal/record_archive.h"
#include "backend/keyframe_pose.h"
#include "backend/loops/loop_result.h"
#include "backend/pose_graph/pose_graph_file.h"
#include "backend/shadow/shadow_optimum.h"
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
  NavState newest;                 ///< state of the newest keyframe in map (fields named odom are map here)
  std::optional<LoopResult> loop;  ///< of this keyframe, or the one that a command cannot take out
  std::vector<LoopResult>
      changed;  ///< other loops that entered or left the graph, were kept or wait for another reason

  [[nodiscard]] bool accepted() const { return verdict == KeyframeVerdict::kAccepted; }
};

/// Counters since construction.
struct SmootherStats {
  int keyframes = 0;
  int retired = 0;          ///< of these, the oldest, that stay where they are
  int absorbed = 0;         ///< of these, for which another stands: nothing but their poses is kept
  int loops_kept = 0;       ///< in the graph, on trial or kept
  int loops_on_trial = 0;   ///< of these, on trial
  int loops_waiting = 0;    ///< verified, but outside of the graph
  int loops_withdrawn = 0;  ///< times that a loop left the graph
  int duplicates = 0;
  int gaps = 0;
  int invalid = 0;
  int without_imu = 0;        ///< keyframes linked without preintegration
  int clouds_forgotten = 0;   ///< dropped for want of memory and an archive: no loop ends there any more
  int clouds_unreadable = 0;  ///< times that a cloud could not be read back, so that a candidate was refused
  int solver_rebuilds = 0;
  std::string solver_failure;   ///< why the graph takes nothing any more; empty while all is well
  int shadow_checks = 0;        ///< batch solutions that were compared with the incremental one
  int shadow_swaps = 0;         ///< of these, so far away that they took its place
  double shadow_gap_m = 0.0;    ///< largest distance of a keyframe from its place in the newest batch solution
  double shadow_gap_rad = 0.0;  ///< the same for attitudes
};

/// A loop that was found elsewhere.
struct LoopMeasurement {
  std::int32_t from_id = 0;  ///< the later keyframe
  std::int32_t to_id = 0;
  Pose T_to_from;
  Matrix6d information = Matrix6d::Zero();  ///< attitude then position, body axes of `from`; taken as it is
};

struct SmootherRestoration;

/// Smoother over the newest `estimated_keyframes` keyframes, with those before them as known places: pose, velocity and
/// biases of each, linked by preintegrated IMU, by what scan matching alone says of the relative motion, by zero
/// velocity at rest, and by loops. Frame map equals frame odom at the first keyframe and drifts away from it as
/// odometry does. World +Y up.
///
/// A loop enters when it agrees with odometry and belongs to the largest set of loops that agree with each other. It is
/// on trial at first, then kept; whichever loop the evidence contradicts is taken out again, as long as one of its
/// keyframes is estimated. Deterministic, no clock; one thread.
class Smoother {
 public:
  /// `archive` keeps what take_change() gives; clouds beyond `cloud_memory_mb` are read back from it, and forgotten
  /// without one. It outlives the smoother. Throws config::ConfigError naming every offence.
  Smoother(const BackendConfig& config, const LoopGates& gates, const RecordArchive* archive = nullptr);
  ~Smoother();
  Smoother(Smoother&&) noexcept;
  Smoother& operator=(Smoother&&) noexcept;

  /// Keyframes enter in the order of their ids, beginning at 0.
  [[nodiscard]] SmootherUpdate add_keyframe(const Keyframe& keyframe);

  /// Whether the keyframe belongs to another drive although session and id fit: the front end was started anew and
  /// counts from 0 again.
  [[nodiscard]] bool is_of_another_drive(const Keyframe& keyframe) const;

  /// Stops waiting for ids before `id`, which nobody can send any more. The next keyframe is linked across the hole by
  /// loose odometry.
  void accept_gap_before(std::int32_t id);

  /// Puts a loop on trial as if it had been found here. `loop` tells the outcome.
  [[nodiscard]] SmootherUpdate add_loop(const LoopMeasurement& measurement);

  /// Takes every loop between the two keyframes out, wherever it stands. The search may find it again. One between
  /// keyframes that have retired stays, and `loop` says so.
  [[nodiscard]] SmootherUpdate withdraw_loop(std::int32_t from_id, std::int32_t to_id);

  /// The same, and neither the pair nor its neighbours within loop_min_spacing are closed again from now on.
  [[nodiscard]] SmootherUpdate veto_loop(std::int32_t from_id, std::int32_t to_id);

  /// The graph as it is now, for solve() on any thread.
  [[nodiscard]] ShadowProblem shadow_problem();

  /// Notes how far the incremental solution was from the batch optimum, and goes on from there when it was farther than
  /// configured. Keyframes and loops may have come since; an optimum of another graph is ignored.
  [[nodiscard]] SmootherUpdate adopt(const ShadowOptimum& optimum);

  /// The newest update once more, as after a restart, without what it moved.
  [[nodiscard]] SmootherUpdate present() const;

  /// All keyframes as the graph places them, ascending ids.
  [[nodiscard]] std::vector<KeyframePose> all_poses() const;
  [[nodiscard]] Pose T_map_odom() const;
  [[nodiscard]] std::int32_t revision() const;
  [[nodiscard]] std::int32_t expected_id() const;
  [[nodiscard]] SmootherStats stats() const;

  /// Poses, odometry and loops for keyframes.g2o, without keyframes that were absorbed and their loops.
  [[nodiscard]] PoseGraph pose_graph() const;

  /// What changed since the previous call, as the next record for the archive. From here on the archive is taken to
  /// have it, so the clouds in it may leave memory. To be called after every change of the graph, or never.
  [[nodiscard]] std::vector<std::byte> take_change();

 private:
  friend SmootherRestoration restore_smoother(const BackendConfig& config, const LoopGates& gates,
                                              std::span<const std::span<const std::byte>> records,
                                              const RecordArchive* archive);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A smoother out of a journal.
struct SmootherRestoration {
  Smoother smoother;
  std::size_t records_used = 0;  ///< those behind it do not fit, and are lost
  std::string problem;           ///< with the first that does not; or why the solver refuses them all
};

/// The smoother that take_change() wrote these records of, in order, under the same configuration: same keyframes,
/// loops, revision and estimates. `archive` holds them by their places in `records`. Throws config::ConfigError naming
/// every offence.
[[nodiscard]] SmootherRestoration restore_smoother(const BackendConfig& config, const LoopGates& gates,
                                                   std::span<const std::span<const std::byte>> records,
                                                   const RecordArchive* archive = nullptr);

}  // namespace ignis
