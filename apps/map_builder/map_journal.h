// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "map/map_record.h"
#include "runtime/state_folder.h"

namespace ignis {

/// What one map_builder leaves to its successor: DIR/map_keyframe_ID, a file for each keyframe with its record and
/// those of the scans that followed it. Append-only, a checksum for each record. One process at a time may use a
/// folder.
///
/// A record is handed to the kernel at once, so a killed process loses none; it is not synced, since after a power cut
/// the drive is over. With a keyframe that the map has dropped its file goes, so the folder is bounded as the map is:
/// 16 bytes a point. What cannot be written shows in failure(), waits in memory up to a bound and is tried again with
/// the next records, a few megabytes with each, and some at the end; the map goes on. The records of a keyframe whose
/// own is lost help nobody: restore() leaves them out.
class MapJournal {
 public:
  struct Loaded {
    MapRecordHead head;
    std::vector<MapRecord> records;
  };

  /// Makes and locks the folder. Throws runtime::UserError that names folder and reason.
  explicit MapJournal(std::filesystem::path folder);
  ~MapJournal();
  MapJournal(const MapJournal&) = delete;
  MapJournal& operator=(const MapJournal&) = delete;

  /// What an earlier process has left under this configuration: of its newest session every whole record.
  [[nodiscard]] std::optional<Loaded> load(const std::string& config_fingerprint);

  /// Which files load() has found that are not whole; empty when all are.
  [[nodiscard]] std::string damage() const;

  /// Begins anew; what was there goes.
  void begin(const MapRecordHead& head);

  /// Goes on behind what load() has found. What is damaged is cut off.
  void resume(const MapRecordHead& head);

  void append(const MapRecord& record);

  /// Removes the files of keyframes that the map no longer holds.
  void forget_dropped(const KeyframeClouds& clouds);

  /// Why records are not in their files, how many have no room in memory either, and where; empty while all are. What
  /// is lost is lost until begin().
  [[nodiscard]] std::string failure() const;

 private:
  struct File {
    std::optional<MapRecordHead> head;
    std::vector<MapRecord> records;
    std::size_t whole_bytes = 0;
    std::string damage;
  };

  [[nodiscard]] static File read(const std::filesystem::path& path);
  [[nodiscard]] std::filesystem::path path_of(std::int32_t id) const;
  struct Waiting {
    std::int32_t id = 0;  ///< of the keyframe
    std::vector<std::byte> bytes;
  };

  void open_for(std::int32_t id);
  void close_file();
  void write_waiting(std::size_t most);
  [[nodiscard]] bool write(const Waiting& record);
  void fail(const std::string& what, int error);

  runtime::StateFolder folder_;
  MapRecordHead head_;
  std::map<std::int32_t, std::size_t> sizes_;  ///< of the whole records in the files
  int file_ = -1;
  std::int32_t file_id_ = 0;     ///< of the one that is open
  std::deque<Waiting> waiting_;  ///< not in their files yet, in the order in which they came
  std::size_t waiting_bytes_ = 0;
  std::string failure_;
  std::int64_t lost_ = 0;
  std::string damage_;  ///< of the last file that is not whole
  int damaged_files_ = 0;
};

}  // namespace ignis
