// SPDX-License-Identifier: Apache-2.0
#include "common/file_output.h"

#include <cerrno>
#include <cstring>
#include <format>
#include <stdexcept>

namespace ignis {

FileOutput::FileOutput(std::filesystem::path path) : path_(std::move(path)), temporary_(path_.string() + ".tmp") {
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
  std::filesystem::rename(temporary_, path_);
  committed_ = true;
}

}  // namespace ignis
