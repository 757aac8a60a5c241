// SPDX-License-Identifier: Apache-2.0
#include "descriptor_wait.h"

#include <algorithm>
#include <ctime>
#include <thread>

#include <poll.h>

namespace ignis {

bool wait_for_input(int descriptor, HostLine::Clock::time_point deadline) {
  using std::chrono::nanoseconds;
  constexpr std::int64_t kNanosPerSecond = 1'000'000'000;
  // A sensor that runs late still listens.
  const auto left = std::max(nanoseconds(deadline - HostLine::Clock::now()), nanoseconds::zero());
  const std::int64_t nanos = left.count();
  const timespec timeout{.tv_sec = nanos / kNanosPerSecond, .tv_nsec = nanos % kNanosPerSecond};
  pollfd end{descriptor, POLLIN, 0};
  if (ppoll(&end, 1, &timeout, nullptr) <= 0) return false;
  if ((end.revents & POLLIN) != 0) return true;
  // A hang-up is reported at once and again and again: the wait must not become a busy loop.
  std::this_thread::sleep_until(deadline);
  return false;
}

}  // namespace ignis
