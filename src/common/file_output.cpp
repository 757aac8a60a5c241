// SPDX-License-Identifier: Apache-2.0
#include "common/file_output.h"

#include <cerrno>
#include <cstring>
#include <format>
#include <stdexcept>

#include <fcntl.h>
#include <unistd.h>

namespace ignis {
namespace {

/// Waits until a file or a folder is on the disk. What has no disk behind it answers EINVAL.
void wait_for_disk(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool is_there = descriptor >= 0 && (fsync(descriptor) == 0 || errno == EINVAL);
  const int error = errno;
  if (descriptor >= 0) close(descriptor);
  if (!is_there) throw std::runtime_error(std::format("cannot sync {}: {}", path.string(), std::strerror(error)));
}

}  // namespace

FileOutput::FileOutput(std::filesystem::path path, Sync sync)
    : path_(std::move(path)), temporary_(path_.string() + ".tmp"), sync_(sync) {
  stream_.open(temporary_, std::ios::binary | std::ios::trunc);
  if (!stream_) throw std::runtime_error(std::format("cannot write {}: {}", path_.string(), std::strerror(errno)));
}

FileOutput::~FileOutput() {
  if (committed_) return;
  stream_.close();
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void FileOutput::commit() {
  stream_.close();
  if (stream_.fail()) throw std::runtime_error(std::format("cannot write {}: is the disk full?", path_.string()));
  // Without, a power cut may leave the new name without its content, and the old file gone.
  if (sync_ == Sync::kYes) wait_for_disk(temporary_);
  std::filesystem::rename(temporary_, path_);
  committed_ = true;
  if (sync_ == Sync::kYes) wait_for_disk(path_.has_parent_path() ? path_.parent_path() : ".");
}

}  // namespace ignis
