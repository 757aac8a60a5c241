// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <thread>

#include "bounded_queue.h"
#include "frontend/lio.h"
#include "ignis/lio_command_t.hpp"
#include "replay_follower.h"

namespace ignis {

/// All cores in one process: the front end in the caller's thread, back end and map behind it in another. What the
/// front end says goes one way and in order, so the result does not depend on how the two keep pace. Their numbers and
/// files are of the newest session, the trajectories of all.
class ReplayPipeline {
 public:
  /// `listener` may be null; it outlives the pipeline, and until finish() it is called in the other thread. `session`
  /// is the number of the first one.
  ReplayPipeline(const runtime::IgnisConfig& config, bool use_loops, GraphListener* listener = nullptr,
                 std::int32_t session = 0);
  ~ReplayPipeline();
  ReplayPipeline(const ReplayPipeline&) = delete;
  ReplayPipeline& operator=(const ReplayPipeline&) = delete;

  /// Both throw what back end or map have thrown meanwhile; then only the end of the pipeline may follow.
  void add_imu(const ImuSample& sample);
  void add_scan(Scan scan);

  /// What is refused is counted.
  void take_command(const lio_command_t& command);

  /// Places everything at its final pose. Call once, at the end. Throws what back end or map have thrown.
  [[nodiscard]] ReplayResult finish();

  [[nodiscard]] const StageTimer& frontend_timer() const { return frontend_timer_; }
  /// Voxels and times of back end and map. To be asked after finish() only.
  [[nodiscard]] const ReplayFollower& follower() const { return follower_; }

 private:
  struct Step {
    ScanResult scan;
    double milliseconds = 0.0;
  };

  void hand_over(ScanResult scan, double milliseconds);
  void follow();
  void end_following();

  Lio lio_;
  StageTimer frontend_timer_;
  std::int64_t imu_samples_ = 0;
  std::map<std::string, std::int64_t> rejected_imu_;
  std::map<std::string, std::int64_t> refused_commands_;
  ReplayFollower follower_;
  BoundedQueue<Step> steps_;
  std::exception_ptr failure_;  // of the other thread, written before it closes the queue
  std::thread following_;
};

}  // namespace ignis
