// SPDX-License-Identifier: Apache-2.0
#include "journal_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <format>
#include <utility>

#include <boost/interprocess/file_mapping.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "runtime/application.h"

namespace ignis {
namespace {

namespace fs = std::filesystem;
namespace interprocess = boost::interprocess;

constexpr const char* kName = "graph_backend.journal";
constexpr std::chrono::seconds kRetryPeriod{1};
constexpr std::size_t kMaxPending = 256U << 20U;  // some thousand keyframes
constexpr std::size_t kMostAtOnce = 4U << 20U;    // so that nobody waits long for a slow disk

struct Readable {
  std::size_t bytes = 0;
  int error = 0;  ///< an errno: what lies behind cannot be read
};

/// What a disk does not give would end the process, were it met in a mapping.
Readable read_through(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0)
    throw runtime::UserError(std::format("{}: cannot be read: {}", path.string(), std::strerror(errno)),
                             runtime::kFailed);
  std::vector<std::byte> block(1U << 20U);
  Readable readable;
  while (true) {
    const ssize_t count = pread(file, block.data(), block.size(), static_cast<off_t>(readable.bytes));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) readable.error = errno;
    if (count <= 0) break;
    readable.bytes += static_cast<std::size_t>(count);
  }
  close(file);
  return readable;
}

}  // namespace

std::span<const std::byte> LoadedJournal::bytes() const {
  return {static_cast<const std::byte*>(file.get_address()), file.get_size()};
}

std::size_t LoadedJournal::end_of(std::size_t records) const {
  if (records == 0) return encode_head(contents.head).size();
  const std::span<const std::byte> last = contents.payloads[records - 1];
  return static_cast<std::size_t>(last.data() + last.size() - bytes().data());
}

JournalFile::JournalFile(fs::path folder)
    : folder_(std::move(folder), "graph_backend", "journal"), path_(folder_.path() / kName) {}

JournalFile::~JournalFile() {
  if (file_ < 0) return;
  write_all_pending();
  fdatasync(file_);
  close(file_);
}

std::optional<LoadedJournal> JournalFile::load() const {
  std::error_code error;
  if (!fs::exists(path_, error)) return std::nullopt;
  LoadedJournal loaded;
  const Readable readable = read_through(path_);
  try {
    // Nothing can be mapped of an empty file.
    if (readable.bytes > 0) {
      const interprocess::file_mapping file(path_.c_str(), interprocess::read_only);
      loaded.file = interprocess::mapped_region(file, interprocess::read_only, 0, readable.bytes);
    }
  } catch (const std::exception& e) {
    throw runtime::UserError(std::format("{}: cannot be read: {}", path_.string(), e.what()), runtime::kFailed);
  }
  loaded.contents = read_journal(loaded.bytes());
  if (readable.error == 0) return loaded;
  loaded.contents.torn_tail = false;
  loaded.contents.damage =
      std::format("the disk gives {} bytes and then: {}", readable.bytes, std::strerror(readable.error));
  return loaded;
}

fs::path JournalFile::free_name(const char* suffix) const {
  for (int number = 1;; ++number) {
    fs::path candidate = path_;
    candidate += std::format(".{}{}", suffix, number);
    std::error_code error;
    if (!fs::exists(candidate, error)) return candidate;
  }
}

fs::path JournalFile::set_aside() {
  if (file_ >= 0) {
    write_all_pending();
    sync_.leave();
    close(file_);
    file_ = -1;
  }
  pending_.clear();
  unsynced_.clear();
  ends_.clear();
  std::error_code error;
  if (!fs::exists(path_, error)) return {};
  fs::path kept = free_name("old");
  fs::rename(path_, kept, error);
  if (error) fail("cannot be renamed", error.value());
  return kept;
}

void JournalFile::begin(const JournalHead& head) {
  set_aside();
  failure_.clear();
  unsynced_why_.clear();
  given_up_ = false;
  open(O_CREAT | O_TRUNC, 0);
  const std::vector<std::byte> bytes = encode_head(head);
  add_pending(bytes);
  write_pending();
}

void JournalFile::resume(const LoadedJournal& loaded, std::size_t records, bool keep_file) {
  ends_.clear();
  for (std::size_t i = 0; i <= records; ++i) ends_.push_back(loaded.end_of(i));
  if (!keep_file) {
    open(0, ends_.back());
    return;
  }
  std::error_code renaming;
  fs::rename(path_, free_name("damaged"), renaming);
  if (renaming) {
    throw runtime::UserError(
        std::format("{}: cannot be renamed, and is damaged: {}", path_.string(), renaming.message()), runtime::kFailed);
  }
  // The old one may not even be read to its end, so what is used of it goes into another one.
  open(O_CREAT | O_TRUNC, 0);
  const std::span<const std::byte> used = loaded.bytes().first(ends_.back());
  int error = write_file(0, used);
  if (error == 0 && fdatasync(file_) != 0) error = errno;
  if (error == 0) {
    size_ = used.size();
    return;
  }
  pending_.assign(used.begin(), used.end());
  fail("cannot be written", error);
}

void JournalFile::open(int flags, std::size_t size) {
  file_ = ::open(path_.c_str(), O_RDWR | O_CLOEXEC | flags, 0644);
  size_ = size;
  if (file_ < 0 || ftruncate(file_, static_cast<off_t>(size)) != 0) fail("cannot be opened", errno);
}

void JournalFile::append(std::span<const std::byte> payload) {
  if (given_up_) return;
  add_pending(encode_record(payload));
  write_pending();
  if (pending_.size() + unsynced_.size() > kMaxPending) give_up();
}

void JournalFile::give_up() {
  given_up_ = true;
  pending_.clear();
  unsynced_.clear();
  sync_.leave();
  std::erase_if(ends_, [this](std::size_t end) { return end > size_; });
  const std::string why = failure();
  failure_ = (why.empty() ? failure_text("is written slower than it grows") : why) + "; given up for this drive";
}

void JournalFile::add_pending(std::span<const std::byte> bytes) {
  pending_.insert(pending_.end(), bytes.begin(), bytes.end());
  ends_.push_back(size_ + pending_.size());
}

std::optional<std::vector<std::byte>> JournalFile::read(std::size_t number) const {
  if (ends_.empty() || number >= ends_.size() - 1) return std::nullopt;
  const std::size_t begin = ends_[number];
  std::vector<std::byte> bytes(ends_[number + 1] - begin);
  if (begin >= size_) {
    std::ranges::copy(std::span(pending_).subspan(begin - size_, bytes.size()), bytes.begin());
  } else if (!read_file(begin, bytes)) {
    return std::nullopt;
  }
  const RecordAt record = record_at(bytes, 0);
  if (!record.damage.empty()) return std::nullopt;
  return std::vector<std::byte>(record.payload.begin(), record.payload.end());
}

bool JournalFile::read_file(std::size_t offset, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = pread(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    offset += static_cast<std::size_t>(count);
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

void JournalFile::maintain() {
  if (given_up_ || ends_.empty()) return;
  const auto now = std::chrono::steady_clock::now();
  const bool is_time = now - last_try_ > kRetryPeriod;
  if (is_time) return_to_folder();
  if (!pending_.empty() && (is_time || failure_.empty())) write_pending();
  sync();
}

/// Whoever takes the file away leaves us one that no successor finds: what it held is written to another one.
void JournalFile::return_to_folder() {
  last_try_ = std::chrono::steady_clock::now();
  struct stat ours{};
  struct stat there{};
  const bool is_there = stat(path_.c_str(), &there) == 0;
  const bool is_missing = !is_there && errno == ENOENT;
  if (file_ >= 0) {
    if (fstat(file_, &ours) != 0 || (!is_there && !is_missing)) return;  // nobody knows
    if (is_there && ours.st_ino == there.st_ino && ours.st_dev == there.st_dev) return;
    fail("was removed", ENOENT);
    if (size_ + pending_.size() > kMaxPending) {
      give_up();
      return;
    }
    std::vector<std::byte> held(size_);
    if (!read_file(0, held)) {
      give_up();
      return;
    }
    sync_.leave();
    close(file_);
    file_ = -1;
    size_ = 0;
    unsynced_.clear();
    pending_.insert(pending_.begin(), held.begin(), held.end());
  }
  failure_.clear();
  std::error_code error;
  if (is_there && size_ == 0) fs::rename(path_, free_name("old"), error);  // somebody else's
  open(size_ == 0 ? O_CREAT : 0, size_);
}

void JournalFile::sync() {
  if (const auto outcome = sync_.finished()) note(*outcome);
  if (sync_.under_way()) {
    if (sync_.waits() > kSyncPeriod) unsynced_why_ = failure_text("waits for its disk");
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  if (file_ < 0 || unsynced_.empty() || now - last_sync_ < kSyncPeriod) return;
  last_sync_ = now;
  sync_.begin(file_, size_);
}

void JournalFile::note(const BackgroundSync::Outcome& outcome) {
  const std::size_t later = size_ - outcome.size;
  if (outcome.error == 0) {
    unsynced_.erase(unsynced_.begin(), unsynced_.end() - static_cast<std::ptrdiff_t>(later));
    unsynced_why_.clear();
    return;
  }
  // What was handed over since the last time that it went well is written once more.
  size_ -= unsynced_.size();
  pending_.insert(pending_.begin(), unsynced_.begin(), unsynced_.end());
  unsynced_.clear();
  last_sync_ -= kSyncPeriod - kRetryPeriod;
  unsynced_why_ = failure_text(std::format("cannot be synced: {}", std::strerror(outcome.error)));
}

/// The number of the error, or 0.
int JournalFile::write_file(std::size_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return errno;
    offset += static_cast<std::size_t>(count);
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return 0;
}

void JournalFile::write_all_pending() {
  do write_pending();
  while (file_ >= 0 && !pending_.empty() && failure_.empty());
}

/// Whole records, some at once, or nothing.
void JournalFile::write_pending() {
  if (file_ < 0 || pending_.empty()) return;
  const auto first = std::ranges::upper_bound(ends_, size_);
  const auto beyond = std::ranges::upper_bound(ends_, size_ + kMostAtOnce);
  const std::size_t all = *(beyond > first ? beyond - 1 : first) - size_;
  if (const int error = write_file(size_, std::span(pending_).first(all)); error != 0) {
    // Left in place, a torn record would only be overwritten by the next attempt.
    static_cast<void>(ftruncate(file_, static_cast<off_t>(size_)));
    last_try_ = std::chrono::steady_clock::now();
    fail("cannot be written", error);
    return;
  }
  size_ += all;
  const auto end = pending_.begin() + static_cast<std::ptrdiff_t>(all);
  unsynced_.insert(unsynced_.end(), pending_.begin(), end);
  pending_.erase(pending_.begin(), end);
  failure_.clear();
}

void JournalFile::fail(const std::string& what, int error) {
  failure_ = failure_text(std::format("{}: {}", what, std::strerror(error)));
}

std::string JournalFile::failure_text(const std::string& what) const {
  return std::format("the journal {} ({})", what, path_.string());
}

}  // namespace ignis
