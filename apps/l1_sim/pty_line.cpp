// SPDX-License-Identifier: Apache-2.0
#include "pty_line.h"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <format>
#include <string>

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include "descriptor_wait.h"
#include "runtime/application.h"

namespace ignis {
namespace {

constexpr std::chrono::milliseconds kPatience{200};

[[noreturn]] void fail(const std::string& what) {
  throw runtime::UserError(std::format("{}: {}", what, std::strerror(errno)), runtime::kFailed);
}

/// Raw mode, so that the line changes no byte. Opening and closing the far end once also makes poll() report a hang-up
/// until a reader comes, which it does not for an end that was never opened.
void prepare_far_end(const char* name) {
  const int far_end = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (far_end < 0) fail(std::format("cannot open the pseudo-terminal {}", name));
  termios settings{};
  tcgetattr(far_end, &settings);
  cfmakeraw(&settings);
  tcsetattr(far_end, TCSANOW, &settings);
  close(far_end);
}

void put_link(const std::filesystem::path& link, const char* target) {
  namespace fs = std::filesystem;
  const fs::file_status status = fs::symlink_status(link);
  if (fs::exists(status) && !fs::is_symlink(status)) {
    throw runtime::UserError(
        std::format("{} exists and is not a symbolic link; choose another name for --pty", link.string()));
  }
  const fs::path temporary = link.string() + ".tmp";
  std::error_code error;
  fs::remove(temporary, error);
  fs::create_symlink(target, temporary, error);
  if (!error) fs::rename(temporary, link, error);
  if (error) {
    throw runtime::UserError(std::format("cannot make the link {}: {}; choose a folder that exists and can be written",
                                         link.string(), error.message()));
  }
}

}  // namespace

PtyLine::PtyLine(std::filesystem::path link) : link_(std::move(link)) {
  master_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
  std::array<char, 64> name{};
  if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0 ||
      ptsname_r(master_, name.data(), name.size()) != 0) {
    fail("cannot make a pseudo-terminal (is /dev/pts mounted?)");
  }
  try {
    prepare_far_end(name.data());
    put_link(link_, name.data());
  } catch (...) {
    close(master_);
    throw;
  }
}

PtyLine::~PtyLine() {
  std::error_code ignored;
  std::filesystem::remove(link_, ignored);
  close(master_);
}

bool PtyLine::has_reader() const {
  pollfd end{master_, 0, 0};
  return poll(&end, 1, 0) == 0;
}

bool PtyLine::write(std::span<const std::byte> bytes) {
  if (!has_reader()) return false;
  const auto deadline = Clock::now() + kPatience;
  while (!bytes.empty()) {
    const ssize_t sent = ::write(master_, bytes.data(), bytes.size());
    if (sent > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
      continue;
    }
    if (sent < 0 && errno != EAGAIN && errno != EINTR) return false;
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) return false;
    pollfd end{master_, POLLOUT, 0};
    poll(&end, 1, static_cast<int>(left.count()));
  }
  return true;
}

std::size_t PtyLine::read(std::span<std::byte> buffer, Clock::time_point deadline) {
  if (!wait_for_input(master_, deadline)) return 0;
  const ssize_t count = ::read(master_, buffer.data(), buffer.size());
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

}  // namespace ignis
