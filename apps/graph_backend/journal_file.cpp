// SPDX-License-Identifier: Apache-2.0
#include "journal_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <format>
#include <utility>

#include <boost/interprocess/file_mapping.hpp>

#include <fcntl.h>
#include <unistd.h>

#include "runtime/application.h"

namespace ignis {
namespace {

namespace fs = std::filesystem;
namespace interprocess = boost::interprocess;

constexpr const char* kName = "graph_backend.journal";
constexpr std::chrono::seconds kRetryPeriod{1};
constexpr std::size_t kMaxPending = 256U << 20U;  // some thousand keyframes

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
  write_pending();
  fdatasync(file_);
  close(file_);
}

std::optional<LoadedJournal> JournalFile::load() const {
  std::error_code error;
  if (!fs::exists(path_, error)) return std::nullopt;
  LoadedJournal loaded;
  try {
    // Nothing can be mapped of an empty file.
    if (fs::file_size(path_) > 0) {
      const interprocess::file_mapping file(path_.c_str(), interprocess::read_only);
      loaded.file = interprocess::mapped_region(file, interprocess::read_only);
    }
  } catch (const std::exception& e) {
    throw runtime::UserError(std::format("{}: cannot be read: {}", path_.string(), e.what()), runtime::kFailed);
  }
  loaded.contents = read_journal(loaded.bytes());
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
    write_pending();
    close(file_);
    file_ = -1;
  }
  pending_.clear();
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
  given_up_ = false;
  open(O_CREAT | O_TRUNC, 0);
  const std::vector<std::byte> bytes = encode_head(head);
  add_pending(bytes);
  write_pending();
}

void JournalFile::resume(const LoadedJournal& loaded, std::size_t records, bool keep_copy) {
  if (keep_copy) {
    std::error_code error;
    fs::copy_file(path_, free_name("damaged"), error);
    if (error) throw runtime::UserError(std::format("{}: cannot be copied: {}", path_.string(), error.message()));
  }
  ends_.clear();
  for (std::size_t i = 0; i <= records; ++i) ends_.push_back(loaded.end_of(i));
  open(0, ends_.back());
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
  if (pending_.size() <= kMaxPending) return;
  given_up_ = true;
  pending_.clear();
  std::erase_if(ends_, [this](std::size_t end) { return end > size_; });
  failure_ += "; given up for this drive";
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
  const auto now = std::chrono::steady_clock::now();
  if (!pending_.empty() && now - last_try_ > kRetryPeriod) write_pending();
  if (!unsynced_ || now - last_sync_ < kSyncPeriod) return;
  last_sync_ = now;
  unsynced_ = false;
  if (fdatasync(file_) != 0) fail("cannot be synced", errno);
}

/// All of it or nothing.
void JournalFile::write_pending() {
  last_try_ = std::chrono::steady_clock::now();
  if (file_ < 0) return;
  std::size_t written = 0;
  while (written < pending_.size()) {
    const ssize_t count =
        pwrite(file_, pending_.data() + written, pending_.size() - written, static_cast<off_t>(size_ + written));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int error = errno;
      // Left in place, a torn record would only be overwritten by the next attempt.
      static_cast<void>(ftruncate(file_, static_cast<off_t>(size_)));
      fail("cannot be written", error);
      return;
    }
    written += static_cast<std::size_t>(count);
  }
  size_ += written;
  unsynced_ = unsynced_ || written > 0;
  pending_.clear();
  failure_.clear();
}

void JournalFile::fail(const std::string& what, int error) {
  failure_ = std::format("the journal {}: {}", what, std::strerror(error));
}

}  // namespace ignis
