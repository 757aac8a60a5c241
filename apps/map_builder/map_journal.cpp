// SPDX-License-Identifier: Apache-2.0
#include "map_builder/map_journal.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <format>
#include <ios>
#include <iterator>
#include <new>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "common/byte_record.h"
#include "common/file_input.h"

namespace ignis {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPrefix = "map_keyframe_";
constexpr std::size_t kMostWaiting = 64U << 20U;  // [bytes] for a disk that takes none: half an hour of driving
// [bytes] written by one append: a second of a card that takes 4 MB/s, so that a disk which works again does not keep
// the map from saying that it lives.
constexpr std::size_t kMostAtOnce = 4U << 20U;
constexpr std::size_t kMostAtTheEnd = 16U << 20U;  // [bytes] a quarter of the time that systemd gives

std::vector<fs::path> files_of(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().filename().string().starts_with(kPrefix)) paths.push_back(entry.path());
  }
  return paths;
}

void remove_file(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
}

}  // namespace

MapJournal::MapJournal(fs::path folder) : folder_(std::move(folder), "map_builder", "journal") {}

MapJournal::~MapJournal() {
  try {
    write_waiting(kMostAtTheEnd);
  } catch (const std::bad_alloc&) {
    waiting_.clear();  // lost, as they would be without a last attempt
  }
  close_file();
}

MapJournal::File MapJournal::read(const fs::path& path) {
  File file;
  std::vector<std::byte> bytes;
  try {
    bytes = read_bytes(path);
  } catch (const std::ios_base::failure& error) {
    file.damage = std::format("{}: the disk does not give it back: {}", path.filename().string(), error.what());
    return file;
  }
  while (file.whole_bytes < bytes.size() && file.damage.empty()) {
    const RecordAt at = record_at(bytes, file.whole_bytes);
    if (!at.damage.empty()) {
      file.damage = at.damage;
    } else if (!file.head) {
      file.head = decode_head(at.payload);
      if (!file.head) file.damage = "no head";
    } else if (auto record = decode_record(at.payload)) {
      file.records.push_back(std::move(*record));
    } else {
      file.damage = "a record that is none";
    }
    if (file.damage.empty()) file.whole_bytes += kRecordFrameBytes + at.payload.size();
  }
  if (!file.damage.empty()) file.damage = std::format("{}: {}", path.filename().string(), file.damage);
  return file;
}

std::optional<MapJournal::Loaded> MapJournal::load(const std::string& config_fingerprint) {
  std::optional<Loaded> loaded;
  damage_.clear();
  damaged_files_ = 0;
  for (const fs::path& path : files_of(folder_.path())) {
    File file = read(path);
    const MapRecordHead here{kMapRecordVersion, config_fingerprint, file.head ? file.head->session : 0};
    // A file that does not even say what it belongs to may be ours.
    if (!file.damage.empty() && (!file.head || *file.head == here)) {
      damage_ = file.damage;
      ++damaged_files_;
    }
    if (file.records.empty() || *file.head != here) continue;
    if (!loaded || loaded->head.session < here.session) {
      loaded = Loaded{.head = here, .records = {}};
      sizes_.clear();
    }
    if (loaded->head != here) continue;
    sizes_[file.records.front().id] = file.whole_bytes;
    std::ranges::move(file.records, std::back_inserter(loaded->records));
  }
  return loaded;
}

std::string MapJournal::damage() const {
  return damaged_files_ > 1 ? std::format("{} files, among them {}", damaged_files_, damage_) : damage_;
}

void MapJournal::begin(const MapRecordHead& head) {
  sizes_.clear();
  resume(head);
}

void MapJournal::resume(const MapRecordHead& head) {
  close_file();
  head_ = head;
  failure_.clear();
  lost_ = 0;
  waiting_.clear();
  waiting_bytes_ = 0;
  for (const fs::path& path : files_of(folder_.path())) {
    const auto known = std::ranges::find_if(sizes_, [&](const auto& each) { return path_of(each.first) == path; });
    if (known == sizes_.end()) {
      remove_file(path);
    } else if (::truncate(path.c_str(), static_cast<off_t>(known->second)) != 0) {
      fail("cannot be cut", errno);
    }
  }
}

fs::path MapJournal::path_of(std::int32_t id) const { return folder_.path() / std::format("{}{}", kPrefix, id); }

void MapJournal::close_file() {
  if (file_ >= 0) close(file_);
  file_ = -1;
}

void MapJournal::open_for(std::int32_t id) {
  struct stat ours{};
  if (file_ >= 0 && fstat(file_, &ours) == 0 && ours.st_nlink == 0) {
    fail("was removed", ENOENT);
    ++lost_;
    sizes_.erase(file_id_);
    close_file();
  }
  if (file_ >= 0 && file_id_ == id) return;
  close_file();
  file_id_ = id;
  file_ = ::open(path_of(id).c_str(), O_CREAT | O_WRONLY | O_APPEND | O_CLOEXEC, 0644);
  if (file_ < 0) fail("cannot be opened", errno);
}

void MapJournal::append(const MapRecord& record) {
  Waiting waiting{.id = record.id, .bytes = encode_record(encode(record))};
  if (waiting_bytes_ + waiting.bytes.size() > kMostWaiting) {
    ++lost_;
  } else {
    waiting_bytes_ += waiting.bytes.size();
    waiting_.push_back(std::move(waiting));
  }
  write_waiting(kMostAtOnce);
}

/// At least one, if the disk takes it; no further one once `most` bytes are written.
void MapJournal::write_waiting(std::size_t most) {
  std::size_t written = 0;
  while (!waiting_.empty()) {
    if (written >= most || !write(waiting_.front())) return;
    written += waiting_.front().bytes.size();
    waiting_bytes_ -= waiting_.front().bytes.size();
    waiting_.pop_front();
  }
  if (lost_ == 0) failure_.clear();
}

/// All of it or nothing.
bool MapJournal::write(const Waiting& record) {
  open_for(record.id);
  if (file_ < 0) return false;
  std::vector<std::byte> bytes;
  if (sizes_[record.id] == 0) bytes = encode_record(encode(head_));
  std::ranges::copy(record.bytes, std::back_inserter(bytes));
  std::size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t count = ::write(file_, bytes.data() + written, bytes.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int error = errno;
      static_cast<void>(ftruncate(file_, static_cast<off_t>(sizes_[file_id_])));
      fail("cannot be written", error);
      return false;
    }
    written += static_cast<std::size_t>(count);
  }
  sizes_[file_id_] += written;
  return true;
}

std::string MapJournal::failure() const {
  return lost_ > 0 ? std::format("{}; {} records are lost", failure_, lost_) : failure_;
}

void MapJournal::forget_dropped(const KeyframeClouds& clouds) {
  std::erase_if(waiting_, [&](const Waiting& each) {
    if (clouds.contains(each.id)) return false;
    waiting_bytes_ -= each.bytes.size();
    return true;
  });
  std::erase_if(sizes_, [&](const auto& each) {
    if (clouds.contains(each.first)) return false;
    if (file_id_ == each.first) close_file();
    remove_file(path_of(each.first));
    return true;
  });
}

void MapJournal::fail(const std::string& what, int error) {
  failure_ = std::format("the map's journal {}: {} ({})", what, std::strerror(error), folder_.path().string());
}

}  // namespace ignis
