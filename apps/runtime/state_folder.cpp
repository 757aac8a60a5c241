// SPDX-License-Identifier: Apache-2.0
#include "runtime/state_folder.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <format>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "runtime/application.h"

namespace ignis::runtime {

StateFolder::StateFolder(std::filesystem::path folder, const std::string& process, const std::string& what)
    : path_(std::move(folder)) {
  std::error_code error;
  std::filesystem::create_directories(path_, error);
  if (error) throw UserError(std::format("cannot make the folder {}: {}", path_.string(), error.message()));
  const std::filesystem::path lock_path = path_ / (process + ".lock");
  lock_ = ::open(lock_path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644);
  if (lock_ < 0) {
    throw UserError(std::format("{}: {}; --{} needs a folder that it may write to", lock_path.string(),
                                std::strerror(errno), what));
  }
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    close(lock_);
    throw UserError(std::format("another {} uses the {} in {}", process, what, path_.string()), kFailed);
  }
}

StateFolder::~StateFolder() { close(lock_); }

std::string supervised_folder(const char* variable) {
  const char* folder = std::getenv(variable);
  return folder != nullptr ? folder : "";
}

}  // namespace ignis::runtime
