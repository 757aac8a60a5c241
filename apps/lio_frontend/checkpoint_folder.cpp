// SPDX-License-Identifier: Apache-2.0
#include "checkpoint_folder.h"

#include <algorithm>
#include <format>

#include "common/file_input.h"
#include "common/file_output.h"
#include "frontend/checkpoint.h"

namespace ignis {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "lio_frontend.checkpoint";

}  // namespace

CheckpointFolder::CheckpointFolder(fs::path folder) : folder_(std::move(folder), "lio_frontend", "checkpoint") {}

std::vector<std::byte> CheckpointFolder::load() const { return read_bytes(folder_.path() / kName); }

void CheckpointFolder::save(std::span<const std::byte> checkpoint) { write(folder_.path() / kName, checkpoint); }

fs::path CheckpointFolder::keyframe_path(std::int32_t id) const {
  return folder_.path() / std::format("keyframe_{:03d}", id % kKeyframes);
}

std::deque<Keyframe> CheckpointFolder::load_keyframes(std::int32_t session) const {
  std::deque<Keyframe> keyframes;
  for (std::int32_t slot = 0; slot < kKeyframes; ++slot) {
    std::optional<Keyframe> keyframe = decode_keyframe(read_bytes(keyframe_path(slot)));
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
    FileOutput file(path, FileOutput::Sync::kNo);
    file.stream().write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
    file.commit();
    failure_.clear();
  } catch (const std::exception& error) {
    failure_ = std::format("no checkpoint: {}", error.what());
  }
}

}  // namespace ignis
