// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_distribution.h"

#include "common/so3.h"

namespace ignis {
namespace {

/// Share of the correction per pose of [earlier, later]: 0 at the first, 1 at the last.
std::vector<double> weights(std::span<const Pose> section) {
  std::vector<double> driven(section.size(), 0.0);
  for (std::size_t i = 1; i < section.size(); ++i) {
    driven[i] = driven[i - 1] + (section[i].translation - section[i - 1].translation).norm();
  }
  const double total = driven.back();
  for (std::size_t i = 0; i < section.size(); ++i) {
    driven[i] = total > 0.0 ? driven[i] / total : static_cast<double>(i) / static_cast<double>(section.size() - 1);
  }
  return driven;
}

}  // namespace

std::optional<std::vector<Pose>> distribute_loop_correction(std::span<const Pose> chain, const ChainLoop& loop,
                                                            double max_correction_m) {
  if (loop.earlier >= loop.later || loop.later >= chain.size()) return std::nullopt;
  const Pose& T_world_end = chain[loop.later];
  const Pose T_world_corrected = chain[loop.earlier] * loop.T_earlier_later;
  const Eigen::Vector3d shift = T_world_corrected.translation - T_world_end.translation;
  const Eigen::Vector3d turn = so3::log(T_world_corrected.rotation * T_world_end.rotation.conjugate());
  if (!(shift.norm() <= max_correction_m)) return std::nullopt;

  std::vector<Pose> corrected(chain.begin(), chain.end());
  const std::vector<double> share = weights(chain.subspan(loop.earlier, loop.later - loop.earlier + 1));
  for (std::size_t i = 0; i < share.size(); ++i) {
    Pose& pose = corrected[loop.earlier + i];
    pose.translation += share[i] * shift;
    pose.rotation = (so3::exp(share[i] * turn) * pose.rotation).normalized();
  }
  const Pose T_new_old = corrected[loop.later] * T_world_end.inverse();
  for (std::size_t i = loop.later + 1; i < chain.size(); ++i) corrected[i] = T_new_old * chain[i];
  return corrected;
}

}  // namespace ignis
