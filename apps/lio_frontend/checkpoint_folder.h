// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/keyframe.h"
#include "runtime/state_folder.h"

namespace ignis {

/// What one lio_frontend leaves to its successor: DIR/lio_frontend.checkpoint and the keyframes that others may still
/// ask for, DIR/keyframe_NNN. One process at a time may use a folder. Files appear whole or not at all; they are not
/// synced, because after a power cut they are too old anyway. What cannot be written shows in failure().
class CheckpointFolder {
 public:
  static constexpr std::int32_t kKeyframes = 400;  ///< the newest so many are kept

  /// Makes and locks the folder. Throws runtime::UserError that names folder and reason.
  explicit CheckpointFolder(std::filesystem::path folder);

  /// Empty when there is none, or when it cannot be read.
  [[nodiscard]] std::vector<std::byte> load() const;
  void save(std::span<const std::byte> checkpoint);

  /// Those of a session, oldest first.
  [[nodiscard]] std::deque<Keyframe> load_keyframes(std::int32_t session) const;
  void save_keyframe(const Keyframe& keyframe);

  /// Why the newest file could not be written; empty while all is well.
  [[nodiscard]] const std::string& failure() const { return failure_; }

 private:
  void write(const std::filesystem::path& path, std::span<const std::byte> bytes);
  [[nodiscard]] std::filesystem::path keyframe_path(std::int32_t id) const;

  runtime::StateFolder folder_;
  std::string failure_;
};

}  // namespace ignis
