// SPDX-License-Identifier: Apache-2.0
#include "loop_liar.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace ignis::bench {
namespace {

constexpr int kIndexGap = 10;
constexpr std::size_t kGroupSize = 20;
constexpr std::size_t kSmallestGroup = 3;
constexpr double kGroupReachM = 4.0;
constexpr double kGroupNoiseM = 0.02;
constexpr double kGroupNoiseRad = 0.003;
constexpr int kGroupAttempts = 400;

class Liar {
 public:
  Liar(const StudyDrive& drive, unsigned seed) : drive_(drive), random_(seed) {}

  LoopMeasurement lone_lie() {
    const auto from = static_cast<int>(between(kIndexGap, count() - 1.0));
    const auto to = static_cast<int>(between(0.0, from - kIndexGap + 0.999));
    const double size_m = 0.3 * std::pow(20.0, between(0.0, 1.0));
    const Pose T_true = truth(to).inverse() * truth(from);
    return {from, to, perturbed_in_body(T_true, gaussian(0.1 * size_m, size_m)), some_information()};
  }

  /// Every second keyframe from a random one on, as long as the shifted way runs near an earlier one. Few or none when
  /// there is nothing beside it.
  std::vector<LoopMeasurement> group(std::size_t most) {
    const double length = between(2.5, 6.0);
    const double bearing = between(0.0, 2.0 * std::numbers::pi);
    Pose shift;
    shift.translation = {length * std::cos(bearing), 0.0, length * std::sin(bearing)};
    const Matrix6d information = some_information();
    std::vector<LoopMeasurement> lies;
    for (auto from = static_cast<int>(between(kIndexGap, count() - 1.0)); from < count() && lies.size() < most;
         from += 2) {
      const Pose T_claimed = shift * truth(from);
      const int to = nearest_before(from, T_claimed.translation);
      if (to < 0) break;
      const Pose T_to_from = perturbed_in_body(truth(to).inverse() * T_claimed, gaussian(kGroupNoiseRad, kGroupNoiseM));
      lies.push_back({from, to, T_to_from, information});
    }
    return lies;
  }

 private:
  [[nodiscard]] int count() const { return static_cast<int>(drive_.T_world_body.size()); }
  [[nodiscard]] const Pose& truth(int i) const { return drive_.T_world_body[static_cast<std::size_t>(i)]; }

  [[nodiscard]] int nearest_before(int from, const Eigen::Vector3d& place) const {
    int nearest = -1;
    double distance = kGroupReachM;
    for (int i = 0; i <= from - kIndexGap; ++i) {
      const double d = (truth(i).translation - place).norm();
      if (d >= distance) continue;
      distance = d;
      nearest = i;
    }
    return nearest;
  }

  Matrix6d some_information() {
    const auto i = static_cast<std::size_t>(between(0.0, static_cast<double>(drive_.loops.size()) - 1e-9));
    return drive_.loops.at(i).information;
  }

  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  Vector6d gaussian(double rotation, double position) {
    std::normal_distribution<double> unit;
    Vector6d v;
    for (int i = 0; i < 6; ++i) v(i) = unit(random_) * (i < 3 ? rotation : position);
    return v;
  }

  const StudyDrive& drive_;
  std::mt19937 random_;
};

}  // namespace

std::vector<StudyLoop> with_lies(const StudyDrive& drive, double share, Lies lies, unsigned seed) {
  std::vector<StudyLoop> loops;
  Liar liar(drive, seed);
  const double wanted = share / (1.0 - share) * static_cast<double>(drive.loops.size());
  const auto count = share > 0.0 ? static_cast<std::size_t>(std::max(1.0, std::round(wanted))) : 0;
  for (int attempt = 0; lies == Lies::kGroups && attempt < kGroupAttempts && loops.size() < count; ++attempt) {
    const std::size_t most = std::min(kGroupSize, std::max(kSmallestGroup, count - loops.size()));
    const std::vector<LoopMeasurement> group = liar.group(most);
    if (group.size() < kSmallestGroup) continue;
    for (const LoopMeasurement& lie : group) loops.push_back({lie, false});
  }
  while (lies == Lies::kIndependent && loops.size() < count) loops.push_back({liar.lone_lie(), false});
  for (const LoopMeasurement& loop : drive.loops) loops.push_back({loop, true});
  std::ranges::stable_sort(loops, {}, [](const StudyLoop& loop) { return loop.measurement.from_id; });
  return loops;
}

}  // namespace ignis::bench
