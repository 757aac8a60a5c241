// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "map/live_map.h"
#include "map_builder/map_journal.h"
#include "messages/odometry_messages.h"

namespace ignis {

/// The map of the present drive and, when a folder is given, its journal: a process that was killed is succeeded by one
/// with the same clouds.
///
/// Session numbers begin at 0 in every drive, so the journal is used only when the first scan that arrives follows its
/// newest within a minute. Whether that was right the next keyframe tells (LiveMap::is_of_another_drive).
class LastingMap {
 public:
  /// Reads what is in `folder`; empty: without a journal. Throws runtime::UserError when the folder cannot be used.
  LastingMap(const MapConfig& config, const std::filesystem::path& folder);

  [[nodiscard]] LiveMap& live() { return map_; }

  /// A journal waits for a scan that tells whether it is of this drive: keyframes come too early.
  [[nodiscard]] bool waits_for_scan() const { return loaded_.has_value(); }

  struct Beginning {
    std::string note;                      ///< what became of the journal, for people; empty when none waited
    std::optional<std::int32_t> newest{};  ///< number of the map's newest cloud, when the journal is gone on with
    std::string damage{};                  ///< what of the journal is lost
  };

  /// Goes on with the journal that waits, or begins a new one. `got_on` is called again and again meanwhile.
  Beginning begin_with(const messages::PosedCloud& cloud, const std::function<void()>& got_on);

  /// Forgets everything: the keyframes and scans of another session or drive follow.
  void begin_session(std::int32_t session);

  InsertCounts insert_scan(const messages::PosedCloud& cloud);
  /// False when it is refused, or is no news: whoever comes again brings nothing, also when its cloud was dropped.
  bool add_keyframe(const Keyframe& keyframe);

  /// Why the map is not in the journal; empty while all is well, and without a journal.
  [[nodiscard]] std::string failure() const { return journal_ ? journal_->failure() : std::string(); }

 private:
  void begin_journal(std::int32_t session);
  void note_drops();
  void write(MapRecord record);

  std::string fingerprint_;
  LiveMap map_;
  std::unique_ptr<MapJournal> journal_;
  std::optional<MapJournal::Loaded> loaded_;
  std::string damage_;                   ///< of the journal, until the first scan
  std::optional<std::int32_t> session_;  ///< of the journal that is being written
  std::int64_t dropped_ = 0;
  std::int32_t number_ = 0;   ///< of the newest cloud
  std::int32_t written_ = 0;  ///< number in the newest record
};

}  // namespace ignis
