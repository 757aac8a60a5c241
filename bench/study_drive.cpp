// SPDX-License-Identifier: Apache-2.0
#include "study_drive.h"

#include <algorithm>
#include <random>

#include "backend/synthetic_drive.h"
#include "common/trajectory_file.h"
#include "keyframe_file.h"
#include "runtime/application.h"

namespace ignis::bench {
namespace {

constexpr double kWrongM = 0.5;
constexpr int kSyntheticKeyframes = 110;
constexpr int kSyntheticLap = 21;
constexpr double kSyntheticSigmaM = 0.02;
constexpr double kSyntheticSigmaRad = 0.003;

Pose at(const Trajectory& trajectory, Utime utime) {
  const auto after = std::ranges::lower_bound(trajectory, utime, {}, &StampedPose::utime);
  if (after == trajectory.end()) return trajectory.back().T_world_body;
  if (after == trajectory.begin()) return after->T_world_body;
  const auto before = after - 1;
  const double ratio = seconds_between(before->utime, utime) / seconds_between(before->utime, after->utime);
  return interpolate(before->T_world_body, after->T_world_body, ratio);
}

double error_of(const LoopMeasurement& loop, const std::vector<Pose>& truth) {
  const Pose& T_world_to = truth[static_cast<std::size_t>(loop.to_id)];
  const Pose& T_world_from = truth[static_cast<std::size_t>(loop.from_id)];
  return body_difference(T_world_to.inverse() * T_world_from, loop.T_to_from).tail<3>().norm();
}

}  // namespace

StudyDrive recorded_study(const std::filesystem::path& keyframe_log, const std::filesystem::path& ground_truth,
                          const BackendConfig& config, const LoopGates& gates) {
  StudyDrive study;
  study.keyframes = read_keyframes(keyframe_log);
  const Trajectory truth = read_tum(ground_truth);
  Smoother smoother(config, gates);
  for (Keyframe& keyframe : study.keyframes) {
    if (!smoother.add_keyframe(keyframe).accepted()) {
      throw runtime::UserError(keyframe_log.string() + ": a keyframe is refused; the study needs one whole session");
    }
    study.T_world_body.push_back(at(truth, keyframe.state.utime));
    keyframe.cloud.clear();
  }
  for (const PoseGraphEdge& edge : smoother.pose_graph().edges) {
    if (!edge.is_loop) continue;
    const LoopMeasurement loop{edge.to, edge.from, edge.T_from_to, edge.information};
    if (error_of(loop, study.T_world_body) <= kWrongM) study.loops.push_back(loop);
  }
  std::ranges::stable_sort(study.loops, {}, &LoopMeasurement::from_id);
  return study;
}

StudyDrive synthetic_study(unsigned seed) {
  testing::Drive drive = testing::make_drive({.seed = seed, .keyframes = kSyntheticKeyframes});
  StudyDrive study{std::move(drive.keyframes), std::move(drive.T_world_body), {}};
  Vector6d sigmas;
  sigmas << Eigen::Vector3d::Constant(kSyntheticSigmaRad), Eigen::Vector3d::Constant(kSyntheticSigmaM);
  const Matrix6d information = sigmas.cwiseProduct(sigmas).cwiseInverse().asDiagonal();
  std::mt19937 random(seed);
  std::normal_distribution<double> unit;
  for (int i = kSyntheticLap + 1; i < kSyntheticKeyframes; i += 2) {
    const Pose& T_world_to = study.T_world_body[static_cast<std::size_t>(i - kSyntheticLap)];
    Vector6d noise;
    for (int k = 0; k < 6; ++k) noise(k) = sigmas(k) * unit(random);
    const Pose T_true = T_world_to.inverse() * study.T_world_body[static_cast<std::size_t>(i)];
    study.loops.push_back({i, i - kSyntheticLap, perturbed_in_body(T_true, noise), information});
  }
  return study;
}

}  // namespace ignis::bench
