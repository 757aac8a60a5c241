// SPDX-License-Identifier: Apache-2.0
#include "checkpoint_folder.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <format>
#include <fstream>
#include <iterator>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "common/file_output.h"
#include "frontend/checkpoint.h"
#include "runtime/application.h"

namespace ignis {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "lio_frontend.checkpoint";
constexpr const char* kLockName = "lio_frontend.lock";

std::vector<std::byte> read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::vector<char> letters{std::istreambuf_iterator<char>(in), {}};
  const std::span<const std::byte> bytes = std::as_bytes(std::span(letters));
  return {bytes.begin(), bytes.end()};
}

}  // namespace

CheckpointFolder::CheckpointFolder(fs::path folder) : folder_(std::move(folder)) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw runtime::UserError(std::format("cannot make the folder {}: {}", folder_.string(), error.message()));
  const fs::path lock_path = folder_ / kLockName;
  lock_ = ::open(lock_path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644);
  if (lock_ < 0) {
    throw runtime::UserError(std::format("{}: {}; --checkpoint needs a folder that it may write to", lock_path.string(),
                                         std::strerror(errno)));
  }
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    close(lock_);
    throw runtime::UserError(std::format("another lio_frontend uses the checkpoint in {}", folder_.string()),
                             runtime::kFailed);
  }
}

CheckpointFolder::~CheckpointFolder() { close(lock_); }

std::vector<std::byte> CheckpointFolder::load() const { return read_file(folder_ / kName); }

void CheckpointFolder::save(std::span<const std::byte> checkpoint) { write(folder_ / kName, checkpoint); }

fs::path CheckpointFolder::keyframe_path(std::int32_t id) const {
  return folder_ / std::format("keyframe_{:03d}", id % kKeyframes);
}

std::deque<Keyframe> CheckpointFolder::load_keyframes(std::int32_t session) const {
  std::deque<Keyframe> keyframes;
  for (std::int32_t slot = 0; slot < kKeyframes; ++slot) {
    std::optional<Keyframe> keyframe = decode_keyframe(read_file(keyframe_path(slot)));
    if (keyframe && keyframe->session == session) keyframes.push_back(std::move(*keyframe));
  }
  std::ranges::sort(keyframes, {}, &Keyframe::id);
  return keyframes;
}

void CheckpointFolder::save_keyframe(const Keyframe& keyframe) {
  write(keyframe_path(keyframe.id), encode_keyframe(keyframe));
}

void CheckpointFolder::write(const fs::path& path, std::span<const std::byte> bytes) {
  try {
    FileOutput file(path);
    file.stream().write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
    file.commit();
    failure_.clear();
  } catch (const std::exception& error) {
    failure_ = std::format("no checkpoint: {}", error.what());
  }
}

}  // namespace ignis
