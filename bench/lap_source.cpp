// SPDX-License-Identifier: Apache-2.0
#include "lap_source.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "runtime/application.h"

namespace ignis::bench {
namespace {

constexpr double kSettled = 10.0;   // [s] behind the beginning, so that no rest at the start is repeated
constexpr double kLeastLap = 25.0;  // [s]
// A splice is a jump that no sensor feels: as small as what a vehicle drives between two samples of the truth.
constexpr double kSamePlace = 0.005;   // [m]
constexpr double kSameCourse = 0.005;  // [rad]

bool is_same(const Pose& a, const Pose& b) {
  return (a.translation - b.translation).norm() < kSamePlace && a.rotation.angularDistance(b.rotation) < kSameCourse;
}

ReplayInput open(const std::filesystem::path& log) {
  try {
    return ReplayInput(log);
  } catch (const std::runtime_error& error) {
    throw runtime::UserError(error.what());
  }
}

}  // namespace

LapSource::LapSource(const std::filesystem::path& log) : input_(open(log)) {
  const Trajectory& truth = input_.ground_truth();
  if (truth.empty()) throw runtime::UserError(log.string() + ": has no GROUND_TRUTH to find the laps by");
  first_ = input_.inventory().first_utime;
  for (std::size_t i = 0; i < truth.size() && end_ == 0; ++i) {
    if (truth[i].utime < first_ + to_micros(kSettled)) continue;
    if (truth[i].utime > first_ + 2 * to_micros(kSettled)) break;
    for (std::size_t k = truth.size() - 1; truth[k].utime > truth[i].utime + to_micros(kLeastLap); --k) {
      if (!is_same(truth[k].T_world_body, truth[i].T_world_body)) continue;
      begin_ = truth[i].utime;
      end_ = truth[k].utime;
      break;
    }
  }
  if (end_ == 0)
    throw runtime::UserError(log.string() + ": the drive never comes back to where it was on the same course");
}

void LapSource::run(double seconds, const std::function<void(const ImuSample&)>& on_imu,
                    const std::function<void(Scan)>& on_scan, const std::function<bool()>& proceed) const {
  const Utime until = first_ + to_micros(seconds);
  for (Utime shift = 0; first_ + shift < until && proceed(); shift += end_ - begin_) {
    const auto is_played = [&](Utime utime) { return (shift == 0 || utime >= begin_) && utime < end_; };
    const auto imu = [&](ImuSample sample) {
      if (!is_played(sample.utime)) return;
      sample.utime += shift;
      on_imu(sample);
    };
    const auto scan = [&](Scan each) {
      if (!is_played(each.utime)) return;
      each.utime += shift;
      on_scan(std::move(each));
    };
    input_.run({.on_imu = imu,
                .on_scan = scan,
                .on_command = [](const lio_command_t&) {},  // a lap is of one session
                .proceed = [&](Utime utime) { return utime < end_ && utime + shift < until && proceed(); }});
  }
}

Pose LapSource::truth_at(Utime utime) const {
  const Utime recorded = utime < end_ ? utime : begin_ + (utime - begin_) % (end_ - begin_);
  const Trajectory& truth = input_.ground_truth();
  const auto after = std::ranges::lower_bound(truth, recorded, {}, &StampedPose::utime);
  if (after == truth.begin()) return truth.front().T_world_body;
  if (after == truth.end()) return truth.back().T_world_body;
  const StampedPose& before = *std::prev(after);
  return interpolate(before.T_world_body, after->T_world_body,
                     seconds_between(before.utime, recorded) / seconds_between(before.utime, after->utime));
}

}  // namespace ignis::bench
