// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>

namespace ignis {

/// A file that appears under its name only when it is complete: written as `name.tmp`, synced and renamed by commit().
/// Without commit() the temporary file is removed. Throws std::runtime_error that names the path and the system's
/// reason.
class FileOutput {
 public:
  /// Whether the file is to outlive a power cut. Without, it outlives the process alone, and its writer waits for no
  /// disk: for what is written often and is worth nothing after a start of the computer.
  enum class Sync : std::uint8_t { kYes, kNo };

  explicit FileOutput(std::filesystem::path path, Sync sync = Sync::kYes);
  ~FileOutput();
  FileOutput(const FileOutput&) = delete;
  FileOutput& operator=(const FileOutput&) = delete;

  [[nodiscard]] std::ofstream& stream() { return stream_; }

  /// The name under which the file is being written, for libraries that open files themselves.
  [[nodiscard]] const std::filesystem::path& temporary_path() const { return temporary_; }

  /// Flushes, checks for write errors, syncs and renames.
  void commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
  Sync sync_;
  std::ofstream stream_;
  bool committed_ = false;
};

}  // namespace ignis
