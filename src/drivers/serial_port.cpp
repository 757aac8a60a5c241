// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_port.h"

// termbits.h, not termios.h: only the kernel's termios2 knows speeds outside POSIX's list.
#include <asm/termbits.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <format>

namespace ignis::l1 {

namespace {

constexpr int kWriteTimeoutMs = 1000;

std::string open_error(const std::string& device, int error) {
  switch (error) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return std::format(
          "serial port {} does not exist: plug the sensor's adapter in, or name the right port with --port "
          "(ls /dev/ttyUSB* /dev/ttyACM* shows what is there)",
          device);
    case EACCES:
    case EPERM:
      return std::format(
          "no permission for serial port {}: add the user to the group that owns it (usually "
          "'sudo usermod -aG dialout $USER', then log in again)",
          device);
    case EBUSY:
      return std::format(
          "serial port {} is in use by another process: end it ('fuser -v {}' names it) or use another port", device,
          device);
    default:
      return std::format("cannot open serial port {}: {}", device, std::strerror(error));
  }
}

/// Bytes that waited in a pty were put there for us; those in a UART are from before anybody listened.
bool is_pty(int fd) {
  struct stat info{};
  constexpr unsigned kFirstPtyMajor = 136;
  constexpr unsigned kLastPtyMajor = 143;
  return fstat(fd, &info) == 0 && major(info.st_rdev) >= kFirstPtyMajor && major(info.st_rdev) <= kLastPtyMajor;
}

}  // namespace

SerialPort::SerialPort(const std::filesystem::path& device, int baud)
    : device_(device), fd_(open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
  if (fd_ < 0) throw LinkError(open_error(device_.string(), errno));
  try {
    claim();
    configure(baud);
  } catch (...) {
    close(fd_);
    throw;
  }
}

SerialPort::~SerialPort() {
  ioctl(fd_, TIOCNXCL);
  close(fd_);
}

void SerialPort::claim() {
  if (isatty(fd_) == 0) {
    throw LinkError(
        std::format("{} is not a serial port; a recorded byte stream is read with --capture", device_.string()));
  }
  // TIOCEXCL keeps other programs out, but not those of root; flock keeps out all who ask.
  if (flock(fd_, LOCK_EX | LOCK_NB) != 0) throw LinkError(open_error(device_.string(), EBUSY));
  ioctl(fd_, TIOCEXCL);
}

void SerialPort::configure(int baud) {
  struct termios2 settings{};
  if (ioctl(fd_, TCGETS2, &settings) != 0) {
    throw LinkError(
        std::format("cannot read the settings of serial port {}: {}", device_.string(), std::strerror(errno)));
  }
  settings.c_iflag = 0;
  settings.c_oflag = 0;
  settings.c_lflag = 0;
  settings.c_cflag = CS8 | CREAD | CLOCAL | BOTHER;
  settings.c_ispeed = static_cast<speed_t>(baud);
  settings.c_ospeed = static_cast<speed_t>(baud);
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  if (ioctl(fd_, TCSETS2, &settings) != 0) {
    throw LinkError(std::format("serial port {} refuses {} baud 8N1: {}; use an adapter that supports it",
                                device_.string(), baud, std::strerror(errno)));
  }
  if (!is_pty(fd_)) ioctl(fd_, TCFLSH, TCIFLUSH);
}

std::size_t SerialPort::read(std::span<std::byte> buffer, int timeout_ms) {
  struct pollfd waiting{.fd = fd_, .events = POLLIN, .revents = 0};
  if (poll(&waiting, 1, timeout_ms) <= 0) return 0;
  const ssize_t count = ::read(fd_, buffer.data(), buffer.size());
  if (count > 0) return static_cast<std::size_t>(count);
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return 0;
  lost(count == 0 ? "end of file" : std::strerror(errno));
}

void SerialPort::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(fd_, bytes.data(), bytes.size());
    if (count > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(count));
    } else if (errno == EAGAIN) {
      struct pollfd waiting{.fd = fd_, .events = POLLOUT, .revents = 0};
      if (poll(&waiting, 1, kWriteTimeoutMs) == 0) lost("it takes no bytes");
    } else if (errno != EINTR) {
      lost(std::strerror(errno));
    }
  }
}

void SerialPort::lost(const std::string& reason) const {
  throw LinkError(std::format("serial port {} is gone: {}", device_.string(), reason));
}

}  // namespace ignis::l1
