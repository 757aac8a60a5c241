// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "drivers/sim/l1_stream.h"

/// Damage between the sensor and the host, frame by frame, from a seeded generator.
namespace ignis::sim {

enum class Fault : std::uint8_t {
  kDrop,       ///< the frame is missing
  kFlip,       ///< one bit of it is turned over
  kCut,        ///< it breaks off after its first byte or later
  kDuplicate,  ///< it comes twice
  kStall,      ///< it and all that follow are held, then come in one burst
  kReorder,    ///< it changes places with the frame behind it
  kJunk,       ///< random bytes follow it
};

inline constexpr std::array<const char*, 7> kFaultNames = {"drop",  "flip",    "cut", "duplicate",
                                                           "stall", "reorder", "junk"};
inline constexpr std::size_t kFaultCount = kFaultNames.size();

[[nodiscard]] inline std::string name_of(Fault fault) { return kFaultNames[static_cast<std::size_t>(fault)]; }

struct FaultConfig {
  std::array<double, kFaultCount> rates{};  ///< 0..1 per frame, indexed by Fault
  int stall_ms = 200;

  [[nodiscard]] double& rate(Fault fault) { return rates[static_cast<std::size_t>(fault)]; }
  /// True when every rate is 0.
  [[nodiscard]] bool none() const;

  void visit_fields(this auto& self, auto& visit) {
    for (std::size_t i = 0; i < kFaultCount; ++i) {
      visit.number(kFaultNames[i], self.rates[i], {0.0, 1.0}, "1 per frame", "share of frames");
    }
    visit.integer("stall_ms", self.stall_ms, {1, 60'000}, "ms", "length of a stall");
  }
};

/// Reads texts such as "drop=0.01" into rates. Appends what is wrong to `offences`: no such fault, no number, named
/// twice. Rates outside their range are left to the validator.
void read_fault_rates(const std::vector<std::string>& texts, FaultConfig& faults, config::Offences& offences);

/// Bytes as they reach the host, and when.
struct Delivery {
  Utime utime = 0;  ///< [us] instant of the stream at which the last of them arrives; never goes back
  std::vector<std::byte> bytes;
};

/// One fault that was injected.
struct InjectedFault {
  std::int64_t offset = 0;  ///< [bytes] in the damaged stream, where the frame begins (junk: where the junk begins)
  std::int64_t frame = 0;   ///< the undamaged stream's frames, counted from 0
  Fault fault = Fault::kDrop;
};

/// Each frame is struck by each fault with that fault's rate, whatever else befalls it; a dropped frame suffers nothing
/// more. Without rates every frame comes through as it is, when its last byte has left the wire.
class ByteFaults {
 public:
  /// Throws config::ConfigError that names every rate outside its range.
  ByteFaults(const FaultConfig& config, std::uint64_t seed);

  /// What reaches the host because of this frame: nothing, it, or several things.
  [[nodiscard]] std::vector<Delivery> pass(const StreamFrame& frame);
  /// What is still held at the end of the stream.
  [[nodiscard]] std::vector<Delivery> finish();

  /// Everything injected so far, in the order of the damaged stream.
  [[nodiscard]] const std::vector<InjectedFault>& injected() const { return injected_; }
  [[nodiscard]] std::int64_t count(Fault fault) const { return counts_[static_cast<std::size_t>(fault)]; }
  [[nodiscard]] std::int64_t frames() const { return frames_; }

 private:
  /// A frame on its way, with what was done to it.
  struct Passenger {
    std::int64_t frame = 0;
    Utime utime = 0;
    std::vector<std::byte> bytes;
    std::vector<std::byte> junk;
    int copies = 1;
    std::vector<Fault> faults;
  };

  [[nodiscard]] Passenger damage(const StreamFrame& frame);
  void emit(const Passenger& passenger, std::vector<Delivery>& deliveries);
  void deliver(Utime utime, std::vector<std::byte> bytes, std::vector<Delivery>& deliveries);
  void note(Fault fault, std::int64_t frame);
  [[nodiscard]] bool strikes(Fault fault);
  [[nodiscard]] std::size_t pick(std::size_t first, std::size_t last);
  [[nodiscard]] std::vector<std::byte> junk();

  FaultConfig config_;
  std::mt19937_64 random_;
  std::optional<Passenger> overtaken_;  ///< waits for the frame behind it to go first
  Utime stalled_until_ = 0;
  Utime line_free_utime_ = 0;  ///< when the last byte so far has left the line
  std::int64_t offset_ = 0;
  std::int64_t frames_ = 0;
  std::vector<InjectedFault> injected_;
  std::array<std::int64_t, kFaultCount> counts_{};
};

}  // namespace ignis::sim
