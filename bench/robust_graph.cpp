// SPDX-License-Identifier: Apache-2.0
#include "robust_graph.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/linear/LossFunctions.h>
#include <gtsam/linear/NoiseModel.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <stdexcept>

#include "backend/factors/gtsam_conversion.h"
#include "backend/factors/information.h"
#include "backend/factors/keyframe_factors.h"
#include "backend/factors/relative_pose_factor.h"

namespace ignis::bench {
namespace {

using gtsam::symbol_shorthand::X;
namespace estimators = gtsam::noiseModel::mEstimator;

constexpr double kHuberWidth = 3.5;
constexpr double kCauchyWidth = 2.3849;
constexpr int kUpdatesAfterLoop = 2;

gtsam::NonlinearFactor::shared_ptr under(Kernel kernel, const gtsam::NonlinearFactor::shared_ptr& factor) {
  estimators::Base::shared_ptr loss;
  if (kernel == Kernel::kHuber) loss = estimators::Huber::Create(kHuberWidth);
  if (kernel == Kernel::kCauchy) loss = estimators::Cauchy::Create(kCauchyWidth);
  if (!loss) return factor;
  const auto plain = boost::dynamic_pointer_cast<gtsam::NoiseModelFactor>(factor);
  return plain->cloneWithNewNoiseModel(gtsam::noiseModel::Robust::Create(loss, plain->noiseModel()));
}

void require(const SolverOutcome& outcome) {
  if (!outcome.accepted) throw std::runtime_error("the solver refuses: " + outcome.reason);
}

}  // namespace

void RobustGraph::add(const Keyframe& keyframe) {
  KeyframeLink link = first_link(keyframe, config_);
  if (!ends_.empty()) {
    LinkEnd previous = ends_.back();
    previous.estimate = estimate_of(solver_, previous.id);
    const WhiteningRows odometry = whitening_with_floor(config_.scan_information_scale * keyframe.scan_information,
                                                        config_.odometry_floor_rad, config_.odometry_floor_m);
    link = next_link(keyframe, previous, keyframe.imu_complete, odometry, config_);
  }
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  add_link_factors(link, config_, factors);
  insert_estimate(link.id, link.guess, values);
  require(solver_.add(factors, values));
  ends_.push_back({keyframe.id, keyframe.state, {}});
}

void RobustGraph::add(const LoopMeasurement& loop) {
  const auto factor =
      make_relative_pose_factor(X(loop.to_id), X(loop.from_id), loop.T_to_from, whitening(loop.information));
  gtsam::NonlinearFactorGraph factors;
  factors.push_back(under(kernel_, factor));
  require(solver_.add(factors, {}));
  static_cast<void>(solver_.settle(kUpdatesAfterLoop));
}

std::vector<Pose> RobustGraph::poses() {
  const gtsam::Values& values = solver_.estimate();
  std::vector<Pose> poses;
  for (const LinkEnd& end : ends_) poses.push_back(from_gtsam(values.at<gtsam::Pose3>(X(end.id))));
  return poses;
}

}  // namespace ignis::bench
