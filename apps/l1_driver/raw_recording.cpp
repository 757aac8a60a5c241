// SPDX-License-Identifier: Apache-2.0
#include "raw_recording.h"

#include <cerrno>
#include <cstring>
#include <format>

#include "runtime/application.h"

namespace ignis::runtime {

RawRecording::RawRecording(std::filesystem::path file) : file_(std::move(file)) {
  if (std::filesystem::exists(file_)) {
    throw UserError(
        std::format("{} exists already: a recording is not overwritten, choose another name", file_.string()));
  }
  stream_.open(file_, std::ios::binary);
  if (!stream_) {
    throw UserError(std::format("cannot record into {}: {}; choose a folder that exists and can be written",
                                file_.string(), std::strerror(errno)));
  }
}

void RawRecording::append(std::span<const std::byte> bytes) {
  if (!trouble_.empty()) return;
  stream_.write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
  bytes_ += std::ssize(bytes);
  check();
}

void RawRecording::flush() {
  if (!trouble_.empty()) return;
  stream_.flush();
  check();
}

void RawRecording::check() {
  if (stream_) return;
  trouble_ = std::format("recording into {} ended: {}", file_.string(), std::strerror(errno));
}

std::string RawRecording::summary() const {
  return trouble_.empty() ? std::format("{} bytes in {}", bytes_, file_.string()) : trouble_;
}

}  // namespace ignis::runtime
