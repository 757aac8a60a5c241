// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

namespace ignis::runtime {

/// The sensor's bytes as they came, in a file that --capture and `./ignis l1 decode` read. Written as it grows, so that
/// a crash loses the last second at most. Trouble with the disk ends the recording and never the driving.
class RawRecording {
 public:
  /// Throws UserError when the file cannot be made or exists already: a recording is never overwritten.
  explicit RawRecording(std::filesystem::path file);

  void append(std::span<const std::byte> bytes);
  /// Call about once a second: hands what was written to the system.
  void flush();

  /// Why the recording ended early; empty while all is well.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  /// What was recorded, for the end of the run.
  [[nodiscard]] std::string summary() const;

 private:
  void check();

  std::filesystem::path file_;
  std::ofstream stream_;
  std::int64_t bytes_ = 0;
  std::string trouble_;
};

}  // namespace ignis::runtime
