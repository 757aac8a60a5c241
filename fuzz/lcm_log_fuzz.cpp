// SPDX-License-Identifier: Apache-2.0
//
// Logs from strangers: whatever the file holds, the reader comes to its end, every record lies inside of the file and
// behind the one before, and each byte is either in a record or counted as damaged.

#include <cstdint>
#include <filesystem>
#include <format>
#include <stdexcept>

#include <sys/mman.h>
#include <unistd.h>

#include "messages/lcm_log.h"
#include "require.h"

namespace {

using namespace ignis;
using fuzz::require;

void check(const std::filesystem::path& file, std::int64_t size) {
  messages::LcmLog log(file);
  std::int64_t in_records = 0;
  std::int64_t last_end = 0;
  while (const auto event = log.next()) {
    in_records += 28 + std::ssize(event->channel) + std::ssize(event->data);
    require(log.position() > last_end && log.position() <= size);
    last_end = log.position();
  }
  require(in_records + log.damaged_bytes() == size);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = memfd_create("log", 0);
  require(file >= 0 && write(file, data, size) == static_cast<ssize_t>(size));
  try {
    check(std::format("/proc/self/fd/{}", file), static_cast<std::int64_t>(size));
  } catch (const std::runtime_error&) {
    // Empty, or not a record in it.
  }
  close(file);
  return 0;
}
