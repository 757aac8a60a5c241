// SPDX-License-Identifier: Apache-2.0
#include "runtime/service_notifier.h"

#include <charconv>
#include <cstdlib>
#include <cstring>

#include <systemd/sd-daemon.h>
#include <unistd.h>

namespace ignis::runtime {
namespace {

constexpr double kFeedsPerTimeout = 4.0;

/// The descriptor that IGNIS_READY_FD names; -1 without one. Standard input and output are never meant.
int readiness_descriptor() {
  const char* text = std::getenv("IGNIS_READY_FD");
  if (text == nullptr) return -1;
  int descriptor = -1;
  const char* end = text + std::strlen(text);
  const auto [stop, error] = std::from_chars(text, end, descriptor);
  return error == std::errc{} && stop == end && descriptor > STDERR_FILENO ? descriptor : -1;
}

}  // namespace

ServiceNotifier::ServiceNotifier() {
  std::uint64_t timeout_us = 0;
  if (sd_watchdog_enabled(0, &timeout_us) > 0) {
    watchdog_period_s_ = 1e-6 * static_cast<double>(timeout_us) / kFeedsPerTimeout;
  }
}

bool ServiceNotifier::is_supervised() { return std::getenv("NOTIFY_SOCKET") != nullptr || readiness_descriptor() >= 0; }

void ServiceNotifier::turn(std::int64_t progress, double now_s) {
  if (!ready_) say_ready();
  feed(progress, now_s);
}

void ServiceNotifier::feed(std::int64_t progress, double now_s) {
  if (!ready_ || watchdog_period_s_ <= 0.0 || progress == fed_with_ || now_s - last_fed_s_ < watchdog_period_s_) return;
  fed_with_ = progress;
  last_fed_s_ = now_s;
  sd_notify(0, "WATCHDOG=1");
}

void ServiceNotifier::status(const std::string& text) const { sd_notify(0, ("STATUS=" + text).c_str()); }

void ServiceNotifier::say_ready() {
  ready_ = true;
  sd_notify(0, "READY=1");
  if (const int descriptor = readiness_descriptor(); descriptor >= 0) {
    // Nobody listening is no reason to stop, and the descriptor is of no further use.
    [[maybe_unused]] const auto written = write(descriptor, "\n", 1);
    close(descriptor);
  }
}

}  // namespace ignis::runtime
