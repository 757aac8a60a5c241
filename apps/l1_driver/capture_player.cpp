// SPDX-License-Identifier: Apache-2.0
#include "capture_player.h"

#include <array>
#include <filesystem>
#include <format>
#include <fstream>
#include <iostream>
#include <optional>
#include <thread>

#include "driver_publisher.h"
#include "runtime/steady_time.h"
#include "runtime/stop_signal.h"

namespace ignis::runtime {
namespace {

std::ifstream open_capture(const std::string& path) {
  if (!std::filesystem::exists(path))
    throw UserError(std::format("{} does not exist: name a recorded byte stream", path));
  if (!std::filesystem::is_regular_file(path))
    throw UserError(std::format("{} is not a file; a device is read with --port", path));
  std::ifstream file(path, std::ios::binary);
  if (!file) throw UserError(std::format("cannot read {}: check its permissions", path));
  return file;
}

}  // namespace

ExitCode play_capture(const Application& application, const std::string& path) {
  std::ifstream file = open_capture(path);
  DriverConfig driver = application.config.driver;
  driver.time_source = "counters";
  l1::L1Decoder decoder(driver, application.config.extrinsics);
  LcmLink bus(application);
  DriverPublisher publisher(bus, decoder, path, 0);
  const bool paced = !application.config.lcm.url.starts_with("file:");

  std::optional<Utime> pace_offset;
  const auto publish_all = [&](const std::vector<l1::Event>& events) {
    for (const l1::Event& event : events) {
      const Utime due = decoder.newest_utime();
      if (!pace_offset) pace_offset = steady_now() - due;
      if (paced) std::this_thread::sleep_for(std::chrono::microseconds(due + *pace_offset - steady_now()));
      publisher.publish(event);
    }
    publisher.report(paced ? steady_now() : decoder.newest_utime(), {});
  };
  std::array<char, 1024> buffer{};
  while (!stop_requested() && (file.read(buffer.data(), std::ssize(buffer)) || file.gcount() > 0)) {
    const auto bytes = std::as_bytes(std::span(buffer)).first(static_cast<std::size_t>(file.gcount()));
    publish_all(decoder.feed(bytes, 0));
  }
  publish_all(decoder.finish());

  const l1::DecoderCounters counters = decoder.counters();
  std::cout << std::format("l1_driver: {}: {} scans, {} inertial samples\n", path, counters.scans_published,
                           counters.imu_published);
  if (counters.framing.frames == 0) {
    throw UserError(std::format("{} holds no frame of an L1: is it a raw byte stream of the sensor?", path),
                    kInputDamaged);
  }
  const std::string damage = l1::damage_in(counters);
  if (damage.empty()) return kDone;
  std::cerr << "l1_driver: " << damage << std::endl;
  return kInputDamaged;
}

}  // namespace ignis::runtime
