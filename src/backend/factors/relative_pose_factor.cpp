// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/relative_pose_factor.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

#include "backend/factors/gtsam_conversion.h"

namespace ignis {
namespace {

class RelativePoseFactor : public gtsam::NoiseModelFactorN<gtsam::Pose3, gtsam::Pose3> {
 public:
  RelativePoseFactor(gtsam::Key from, gtsam::Key to, const gtsam::Pose3& T_from_to, WhiteningRows rows)
      : NoiseModelFactorN(gtsam::noiseModel::Unit::Create(static_cast<std::size_t>(rows.rows())), from, to),
        T_from_to_(T_from_to),
        rows_(std::move(rows)) {}

  gtsam::NonlinearFactor::shared_ptr clone() const override { return boost::make_shared<RelativePoseFactor>(*this); }

  gtsam::Vector evaluateError(const gtsam::Pose3& T_map_from, const gtsam::Pose3& T_map_to,
                              boost::optional<gtsam::Matrix&> H_from,
                              boost::optional<gtsam::Matrix&> H_to) const override {
    gtsam::Matrix6 between_from;
    gtsam::Matrix6 log_between;
    const gtsam::Pose3 T_from_to = T_map_from.between(T_map_to, between_from);
    const gtsam::Vector6 error = gtsam::Pose3::Logmap(T_from_to_.between(T_from_to), log_between);
    if (H_from) *H_from = rows_ * log_between * between_from;
    if (H_to) *H_to = rows_ * log_between;
    return rows_ * error;
  }

 private:
  gtsam::Pose3 T_from_to_;
  WhiteningRows rows_;
};

}  // namespace

boost::shared_ptr<gtsam::NonlinearFactor> make_relative_pose_factor(std::uint64_t from_key, std::uint64_t to_key,
                                                                    const Pose& T_from_to, const WhiteningRows& rows) {
  return boost::make_shared<RelativePoseFactor>(from_key, to_key, to_gtsam(T_from_to), rows);
}

}  // namespace ignis
