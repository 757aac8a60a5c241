// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <boost/interprocess/mapped_region.hpp>

#include "backend/journal/journal.h"
#include "backend/journal/record_archive.h"
#include "background_sync.h"
#include "runtime/state_folder.h"

namespace ignis {

/// The bytes of a journal, in the page cache rather than in memory of its own, and what they hold.
struct LoadedJournal {
  boost::interprocess::mapped_region file;
  JournalContents contents;  ///< points into `file`

  [[nodiscard]] std::span<const std::byte> bytes() const;
  /// Where the head and the first `records` end.
  [[nodiscard]] std::size_t end_of(std::size_t records) const;
};

/// The file DIR/graph_backend.journal, which one process at a time may use. A record is handed to the kernel at once,
/// so a killed process loses none; it is on the disk within kSyncPeriod and what the disk takes for it, in a thread of
/// its own, so a power cut loses no more than that. Records that cannot be written (disk full) wait in memory and are
/// tried again, and so are those of which the disk said only when they were synced that it did not take them: the
/// kernel may have forgotten them. The graph goes on. Records are read back from wherever they are.
class JournalFile : public RecordArchive {
 public:
  static constexpr std::chrono::seconds kSyncPeriod{5};

  /// Makes the folder and locks it. Throws runtime::UserError that names folder and reason.
  explicit JournalFile(std::filesystem::path folder);
  ~JournalFile() override;
  JournalFile(const JournalFile&) = delete;
  JournalFile& operator=(const JournalFile&) = delete;

  /// What an earlier process has left; nothing when there is no file. Throws runtime::UserError when nothing of it can
  /// be read.
  [[nodiscard]] std::optional<LoadedJournal> load() const;

  /// Renames what is there, so that it is kept and never read again; its new path, empty when there was none.
  std::filesystem::path set_aside();

  /// Begins anew. What was there is set aside.
  void begin(const JournalHead& head);

  /// Goes on behind the first `records` of what load() has found. The rest is cut off, or, with `keep_file`, the whole
  /// file is kept under another name.
  void resume(const LoadedJournal& loaded, std::size_t records, bool keep_file);

  /// Adds a record. What goes wrong shows in failure().
  void append(std::span<const std::byte> payload);

  [[nodiscard]] std::optional<std::vector<std::byte>> read(std::size_t number) const override;

  /// Tries again what could not be written, and syncs when it is time.
  void maintain();

  /// Why records are waiting or lost, with the path; empty while all is well.
  [[nodiscard]] const std::string& failure() const { return failure_.empty() ? unsynced_why_ : failure_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  void open(int flags, std::size_t size);
  int write_file(std::size_t offset, std::span<const std::byte> bytes);
  void write_all_pending();
  void add_pending(std::span<const std::byte> bytes);
  void write_pending();
  void give_up();
  void return_to_folder();
  void sync();
  void note(const BackgroundSync::Outcome& outcome);
  /// All of them, or false.
  [[nodiscard]] bool read_file(std::size_t offset, std::span<std::byte> bytes) const;
  void fail(const std::string& what, int error);
  [[nodiscard]] std::string failure_text(const std::string& what) const;
  [[nodiscard]] std::filesystem::path free_name(const char* suffix) const;

  runtime::StateFolder folder_;
  std::filesystem::path path_;
  int file_ = -1;
  std::size_t size_ = 0;             ///< of whole records in the file
  std::vector<std::byte> pending_;   ///< encoded, not yet in the file
  std::vector<std::byte> unsynced_;  ///< the end of the file, which may not be on the disk yet
  /// Where the head ends, and each record, in the file and what is pending behind it.
  std::vector<std::size_t> ends_;
  bool given_up_ = false;
  BackgroundSync sync_;
  std::chrono::steady_clock::time_point last_sync_{};
  std::chrono::steady_clock::time_point last_try_{};
  std::string failure_;
  std::string unsynced_why_;
};

}  // namespace ignis
