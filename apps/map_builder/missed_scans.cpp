// SPDX-License-Identifier: Apache-2.0
#include "map_builder/missed_scans.h"

#include <algorithm>
#include <format>
#include <tuple>
#include <utility>

#include "messages/part_assembler.h"

namespace ignis {
namespace {

std::size_t parts_of(const messages::PosedCloud& cloud) {
  constexpr auto kPoints = static_cast<std::size_t>(messages::kMaxPointsPerPart);
  return std::max<std::size_t>(1, (cloud.points.size() + kPoints - 1) / kPoints);
}

/// A keyframe is told right behind the cloud of its scan.
std::tuple<Utime, bool> place_of(const MapInput& input) {
  if (const auto* cloud = std::get_if<messages::PosedCloud>(&input)) return {cloud->utime, false};
  return {std::get<Keyframe>(input).state.utime, true};
}

}  // namespace

void MissedScans::begin(std::int32_t newest, std::int32_t first, double now_s) {
  *this = {};
  if (first <= newest) {
    give_up("scans that a restarted front end no longer has", now_s);
    return;
  }
  newest_ = newest;
  asked_s_ = now_s - kAskAgain_s;
  progress_s_ = now_s;
}

void MissedScans::hold(const messages::PosedCloud& cloud, double now_s) {
  if (!newest_) return;
  if (cloud.sequence < *newest_) {
    counted_anew_.push_back(cloud);
    return;
  }
  const std::int32_t number = cloud.sequence;
  // Those that arrive of themselves close no gap.
  if (!clouds_.empty() && number < clouds_.rbegin()->first) progress_s_ = now_s;
  if (number == *newest_) {
    newest_came_again_ = true;
    return;
  }
  if (clouds_.try_emplace(number, cloud).second) points_ += cloud.points.size();
}

void MissedScans::hold_again(const messages::PosedCloud& cloud, double now_s) {
  if (newest_ && cloud.sequence >= *newest_) hold(cloud, now_s);
}

void MissedScans::hold(const Keyframe& keyframe) {
  if (keyframes_.try_emplace(keyframe.id, keyframe).second) points_ += keyframe.cloud.size();
}

bool MissedScans::has(std::int32_t number) const {
  return number == *newest_ ? newest_came_again_ : clouds_.contains(number);
}

std::int64_t MissedScans::missing_count() const {
  if (clouds_.empty()) return 0;
  return std::int64_t{clouds_.rbegin()->first} - *newest_ - std::ssize(clouds_) + (newest_came_again_ ? 0 : 1);
}

std::vector<std::int32_t> MissedScans::newest_missing(std::size_t most) const {
  std::vector<std::int32_t> missing;
  if (clouds_.empty()) return missing;
  for (std::int32_t number = clouds_.rbegin()->first; number >= *newest_ && missing.size() < most; --number) {
    if (!has(number)) missing.push_back(number);
    if (number == 0) break;
  }
  return missing;
}

std::vector<std::int32_t> MissedScans::ask(double now_s) {
  if (!newest_ || clouds_.empty()) return {};
  const bool answered = std::ranges::all_of(asked_, [this](std::int32_t number) { return has(number); });
  if (now_s - asked_s_ < kAskAgain_s && (asked_.empty() || !answered)) return {};
  asked_ = newest_missing(std::max<std::size_t>(1, kPartsAtOnce / parts_of(clouds_.rbegin()->second)));
  asked_s_ = now_s;
  return asked_;
}

std::vector<MapInput> MissedScans::take(double now_s) {
  if (!newest_ || clouds_.empty()) return {};
  const std::int64_t missing = missing_count();
  const bool may_come = counted_anew_.empty() && now_s - progress_s_ < kGiveUp_s && points_ <= kMostPoints;
  if (missing > 0 && may_come) return {};
  std::vector<MapInput> inputs;
  for (auto& [number, cloud] : clouds_) inputs.emplace_back(std::move(cloud));
  for (auto& [id, keyframe] : keyframes_) inputs.emplace_back(std::move(keyframe));
  std::ranges::stable_sort(inputs, {}, place_of);
  for (messages::PosedCloud& cloud : counted_anew_) inputs.emplace_back(std::move(cloud));
  // The map has the newest one already: what may lack is the keyframe made of it, and that is asked for anyway.
  const std::int64_t lost = missing - (newest_came_again_ ? 0 : 1);
  *this = {};
  if (lost > 0) give_up(std::format("{} scans", lost), now_s);
  return inputs;
}

void MissedScans::give_up(const std::string& what, double now_s) {
  given_up_ = what + " of the map's restart are missing";
  given_up_s_ = now_s;
}

std::string MissedScans::trouble(double now_s) const {
  if (waiting()) return std::format("waiting for {} scans of the map's restart", missing_count());
  return now_s - given_up_s_ < kTold_s ? given_up_ : std::string();
}

}  // namespace ignis
