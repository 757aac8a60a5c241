// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace ignis::runtime {

/// The folder in which a process leaves to its successor what it knows. One process of a kind at a time may use it: it
/// holds the lock of DIR/PROCESS.lock as long as it lives, however it ends.
class StateFolder {
 public:
  /// Makes and locks the folder. `what`: what the process keeps in it, which is also the option that names the folder.
  /// Throws UserError that names folder and reason.
  StateFolder(std::filesystem::path folder, const std::string& process, const std::string& what);
  ~StateFolder();
  StateFolder(const StateFolder&) = delete;
  StateFolder& operator=(const StateFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;
};

/// A supervisor that names a folder in this environment variable wants a killed process to be succeeded within the
/// drive. Whoever starts a process by hand asks for its state by name, so that no files appear in folders unasked:
/// empty then.
std::string supervised_folder(const char* variable);

}  // namespace ignis::runtime
