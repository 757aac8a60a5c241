// SPDX-License-Identifier: Apache-2.0
#include "map_builder/lasting_map.h"

#include <algorithm>
#include <chrono>
#include <format>
#include <utility>

#include "runtime/ignis_config.h"

namespace ignis {
namespace {

// The front end keeps ten seconds of clouds: a parked vehicle's scans, which say nothing new, are noted in between.
constexpr std::int32_t kMostUnwritten = 40;
constexpr double kLongestAbsence = 60.0;  // [s] of sensor time: six times the longest pause of a supervisor

std::string fingerprint_of(const MapConfig& config) {
  runtime::IgnisConfig deciding;
  deciding.map = config;
  return runtime::config_hash(deciding);
}

}  // namespace

LastingMap::LastingMap(const MapConfig& config, const std::filesystem::path& folder)
    : fingerprint_(fingerprint_of(config)),
      map_(config),
      journal_(folder.empty() ? nullptr : std::make_unique<MapJournal>(folder)) {
  if (!journal_) return;
  loaded_ = journal_->load(fingerprint_);
  if (!journal_->damage().empty()) damage_ = "the map's journal is not whole: " + journal_->damage();
}

void LastingMap::begin_journal(std::int32_t session) {
  if (!journal_ || session_ == session) return;
  session_ = session;
  journal_->begin({.config_fingerprint = fingerprint_, .session = session});
}

LastingMap::Beginning LastingMap::begin_with(const messages::PosedCloud& cloud, const std::function<void()>& got_on) {
  if (!loaded_) {
    if (damage_.empty()) return {};
    std::string damage = std::exchange(damage_, {});
    return {.note = std::format("{}; the map begins anew", damage), .damage = damage};
  }
  std::string damage = std::exchange(damage_, {});
  const auto began = std::chrono::steady_clock::now();
  MapJournal::Loaded loaded = *std::exchange(loaded_, std::nullopt);
  const MapRecord& newest = *std::ranges::max_element(loaded.records, {}, &MapRecord::utime);
  const double absence = seconds_between(newest.utime, cloud.utime);
  if (loaded.head.session != cloud.session || !(absence > 0.0 && absence < kLongestAbsence)) {
    begin_session(cloud.session);
    return {.note = "the journal is of another drive; the map begins anew"};
  }
  number_ = written_ = newest.number;
  journal_->resume(loaded.head);
  session_ = loaded.head.session;
  restore(map_, std::move(loaded.records), got_on);
  note_drops();
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - began;
  return {.note = std::format("goes on with {} keyframes, {} voxels after {:.1f} s, built in {:.2f} s{}{}",
                              map_.clouds().size(), map_.voxels().size(), absence, spent.count(),
                              damage.empty() ? "" : "; ", damage),
          .newest = number_,
          .damage = damage};
}

void LastingMap::begin_session(std::int32_t session) {
  map_.clear();
  loaded_.reset();
  session_.reset();  // the journal of this session may be that of another drive
  begin_journal(session);
}

InsertCounts LastingMap::insert_scan(const messages::PosedCloud& cloud) {
  const InsertCounts counts = map_.insert_scan(cloud.points, cloud.T_odom_body);
  number_ = cloud.sequence;
  if (!journal_) return counts;
  begin_journal(cloud.session);
  if (auto record = record_of_scan(map_, cloud.points, cloud.utime, cloud.T_odom_body)) {
    write(std::move(*record));
  } else if (const auto open = map_.clouds().open_id(); open && number_ - written_ >= kMostUnwritten) {
    write({.id = *open, .utime = cloud.utime, .T_odom_body = cloud.T_odom_body, .points = {}});
  }
  note_drops();
  return counts;
}

bool LastingMap::add_keyframe(const Keyframe& keyframe) {
  if (map_.has_come(keyframe.id) || !map_.add_keyframe(keyframe)) return false;
  if (!journal_) return true;
  begin_journal(keyframe.session);
  write(record_of_keyframe(map_, keyframe));
  note_drops();
  return true;
}

void LastingMap::write(MapRecord record) {
  record.number = written_ = number_;
  journal_->append(record);
}

void LastingMap::note_drops() {
  if (std::exchange(dropped_, map_.clouds().dropped()) != dropped_) journal_->forget_dropped(map_.clouds());
}

}  // namespace ignis
