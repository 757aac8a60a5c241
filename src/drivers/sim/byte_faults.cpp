// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/byte_faults.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <format>
#include <utility>

#include "common/config_check.h"

namespace ignis::sim {
namespace {

constexpr std::size_t kShortestJunk = 16;
constexpr std::size_t kLongestJunk = 1024;

const FaultConfig& checked(const FaultConfig& config) {
  config::require_valid(config, "fault");
  return config;
}

std::string names_of_all() {
  std::string text;
  for (const char* name : kFaultNames) text += std::format("{}{}", text.empty() ? "" : ", ", name);
  return text;
}

}  // namespace

bool FaultConfig::none() const {
  return std::ranges::all_of(rates, [](double rate) { return rate == 0.0; });
}

void read_fault_rates(const std::vector<std::string>& texts, FaultConfig& faults, config::Offences& offences) {
  std::array<bool, kFaultCount> named{};
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    const auto found = std::ranges::find(kFaultNames, name);
    if (equals == std::string::npos || found == kFaultNames.end()) {
      offences.push_back({"--fault", text, std::format("FAULT=RATE, FAULT one of {}", names_of_all())});
      continue;
    }
    const auto index = static_cast<std::size_t>(found - kFaultNames.begin());
    const char* const begin = text.data() + equals + 1;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(begin, end, faults.rates[index]);
    if (error != std::errc{} || stop != end) {
      offences.push_back({"--fault", text, std::format("{}=RATE, RATE a number from 0 to 1", name)});
    } else if (named[index]) {
      offences.push_back({"--fault", text, std::format("{} only once", name)});
    }
    named[index] = true;
  }
}

ByteFaults::ByteFaults(const FaultConfig& config, std::uint64_t seed) : config_(checked(config)), random_(seed) {}

std::vector<Delivery> ByteFaults::pass(const StreamFrame& frame) {
  std::vector<Delivery> deliveries;
  Passenger passenger = damage(frame);
  const bool swaps = strikes(Fault::kReorder);
  if (!overtaken_ && !swaps) {
    emit(passenger, deliveries);
  } else if (!overtaken_) {
    overtaken_ = std::move(passenger);
    overtaken_->faults.push_back(Fault::kReorder);
  } else {
    emit(passenger, deliveries);
    overtaken_->utime = passenger.utime;
    // The overtaken frame now stands where this one stood: struck again, it falls back by one more.
    if (swaps) {
      overtaken_->faults.push_back(Fault::kReorder);
    } else {
      emit(*std::exchange(overtaken_, std::nullopt), deliveries);
    }
  }
  return deliveries;
}

std::vector<Delivery> ByteFaults::finish() {
  std::vector<Delivery> deliveries;
  if (!overtaken_) return deliveries;
  overtaken_->faults.pop_back();  // nothing came that could have overtaken it
  emit(*std::exchange(overtaken_, std::nullopt), deliveries);
  return deliveries;
}

ByteFaults::Passenger ByteFaults::damage(const StreamFrame& frame) {
  Passenger passenger{
      .frame = frames_++, .utime = frame.end_utime(), .bytes = frame.bytes, .junk = {}, .copies = 1, .faults = {}};
  const auto suffers = [&](Fault fault) {
    if (!strikes(fault)) return false;
    passenger.faults.push_back(fault);
    return true;
  };
  if (suffers(Fault::kStall)) {
    stalled_until_ = std::max(stalled_until_, passenger.utime + config_.stall_ms * Utime{1000});
  }
  if (suffers(Fault::kDrop)) {
    passenger.copies = 0;
    return passenger;
  }
  if (suffers(Fault::kFlip)) {
    passenger.bytes[pick(0, passenger.bytes.size() - 1)] ^= static_cast<std::byte>(1U << pick(0, 7));
  }
  if (suffers(Fault::kCut)) passenger.bytes.resize(pick(1, passenger.bytes.size() - 1));
  if (suffers(Fault::kDuplicate)) passenger.copies = 2;
  if (suffers(Fault::kJunk)) passenger.junk = junk();
  return passenger;
}

void ByteFaults::emit(const Passenger& passenger, std::vector<Delivery>& deliveries) {
  for (const Fault fault : passenger.faults) {
    if (fault != Fault::kJunk) note(fault, passenger.frame);
  }
  for (int copy = 0; copy < passenger.copies; ++copy) deliver(passenger.utime, passenger.bytes, deliveries);
  if (passenger.junk.empty()) return;
  note(Fault::kJunk, passenger.frame);
  deliver(passenger.utime, passenger.junk, deliveries);
}

void ByteFaults::deliver(Utime utime, std::vector<std::byte> bytes, std::vector<Delivery>& deliveries) {
  // What comes in addition takes its time on the line too; a stall holds what has already left it.
  const Utime line_time = std::llround(l1::kByteTimeUs * static_cast<double>(bytes.size()));
  line_free_utime_ = std::max(utime, line_free_utime_ + line_time);
  offset_ += std::ssize(bytes);
  deliveries.push_back({std::max(line_free_utime_, stalled_until_), std::move(bytes)});
}

void ByteFaults::note(Fault fault, std::int64_t frame) {
  injected_.push_back({offset_, frame, fault});
  ++counts_[static_cast<std::size_t>(fault)];
}

bool ByteFaults::strikes(Fault fault) { return std::bernoulli_distribution(config_.rate(fault))(random_); }

std::size_t ByteFaults::pick(std::size_t first, std::size_t last) {
  return std::uniform_int_distribution<std::size_t>(first, last)(random_);
}

std::vector<std::byte> ByteFaults::junk() {
  std::vector<std::byte> bytes(pick(kShortestJunk, kLongestJunk));
  std::ranges::generate(bytes, [&] { return static_cast<std::byte>(pick(0, 255)); });
  return bytes;
}

}  // namespace ignis::sim
