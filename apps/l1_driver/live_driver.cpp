// SPDX-License-Identifier: Apache-2.0
#include "live_driver.h"

#include <format>
#include <iostream>
#include <thread>
#include <utility>

#include "runtime/stop_signal.h"

namespace ignis::runtime {
namespace {

constexpr int kReadTimeoutMs = 50;
constexpr std::chrono::milliseconds kReconnectPause{200};

}  // namespace

LiveDriver::LiveDriver(const Application& application, const std::string& recording)
    : driver_(application.config.driver),
      decoder_(driver_, application.config.extrinsics),
      bus_(application),
      publisher_(bus_, decoder_, std::format("{} at {} baud", driver_.port, driver_.baud), epoch_of_start()),
      recording_(recording.empty() ? std::nullopt : std::optional<RawRecording>(recording)) {
  try {
    link_ = l1::open_link(driver_.port, driver_.baud);
  } catch (const l1::LinkError& error) {
    // A supervised driver waits for a port that is not there yet, like for one that was lost.
    if (!ServiceNotifier::is_supervised()) throw;
    close(error.what());
  }
}

ExitCode LiveDriver::run() {
  std::cout << std::format("l1_driver: reading {}\n", driver_.port) << std::flush;
  while (!stop_requested()) step();
  for (const l1::Event& event : decoder_.finish()) publisher_.publish(event);
  if (!recording_) return kDone;
  recording_->flush();
  std::cout << std::format("l1_driver: {}\n", recording_->summary());
  return recording_->trouble().empty() ? kDone : kFailed;
}

void LiveDriver::step() {
  try {
    if (link_) {
      exchange();
    } else {
      reopen();
    }
  } catch (const l1::LinkError& error) {
    close(error.what());
  }
  report();
}

void LiveDriver::close(const std::string& reason) {
  link_.reset();
  if (std::exchange(closed_because_, reason) == reason) return;
  std::cerr << std::format("l1_driver: {}, trying again\n", reason);
}

void LiveDriver::exchange() {
  const std::size_t count = link_->read(buffer_, kReadTimeoutMs);
  const Utime arrived = steady_now();
  const auto bytes = std::span<const std::byte>(buffer_).first(count);
  if (recording_) recording_->append(bytes);
  for (const l1::Event& event : decoder_.feed(bytes, host_clock_.now())) publisher_.publish(event);
  bus_.add_latency(1e-3 * static_cast<double>(steady_now() - arrived));
  if (const auto answer = decoder_.take_outgoing(); !answer.empty()) link_->write(answer);
  ask_for_version();
}

void LiveDriver::reopen() {
  std::this_thread::sleep_for(kReconnectPause);
  link_ = l1::open_link(driver_.port, driver_.baud);
  closed_because_.clear();
  std::cerr << std::format("l1_driver: {} is back\n", driver_.port);
}

void LiveDriver::ask_for_version() {
  const Utime now = steady_now();
  if (!decoder_.housekeeping().firmware.empty() || now - last_request_ < kMicrosPerSecond) return;
  last_request_ = now;
  link_->write(decoder_.version_request());
}

void LiveDriver::report() {
  while (bus_.handle(0)) {
  }
  const Utime now = steady_now();
  if (recording_ && now - last_flush_ >= kMicrosPerSecond) {
    last_flush_ = now;
    recording_->flush();
  }
  publisher_.report(now, {.closed_because = closed_because_,
                          .refused = link_ ? link_->refused() : 0,
                          .trouble = recording_ ? recording_->trouble() : ""});
}

}  // namespace ignis::runtime
