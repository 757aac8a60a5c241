// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "runtime/bus_filter.h"

namespace ignis::runtime {

/// Who a process on the bus is and what it runs with, as its HEALTH tells.
struct PeerIdentity {
  std::string process;
  std::int32_t pid = 0;
  std::string version;
  std::string config_hash;
  UdpAddress sender{};  ///< that it sends from; all zero: not known

  bool operator==(const PeerIdentity&) const = default;
};

/// Compares this process with the others on the bus: all must run the same version with the same configuration, each
/// executable once, and none may end and be started again and again. Values in, values out: time comes with the calls.
class PeerWatch {
 public:
  /// [s] without a word after which another process counts as gone; HEALTH comes every second.
  static constexpr double kForgetAfter_s = 3.0;
  /// HEALTH messages of a second instance before it is believed: a killed process's last one may still be on its way.
  static constexpr int kInstanceMessages = 3;

  /// [s] that two instances of another executable must have lived side by side: one that is started anew has not.
  static constexpr double kSideBySide_s = 1.5;

  /// A process of which so many instances were heard within this time ends again and again.
  static constexpr std::size_t kCrashLoopStarts = 5;
  static constexpr double kCrashLoopSeconds = 60.0;

  /// Processes remembered at most: names and numbers come from the bus.
  static constexpr std::size_t kMaxPeers = 32;

  explicit PeerWatch(PeerIdentity self) : self_(std::move(self)) {}

  /// A HEALTH message arrived at `now_s` [s of any steady clock] from a process that has lived for `uptime_s` [s]. Ours
  /// are ignored as long as they do not name an address: on another computer, or in another container, a second
  /// instance may well have our process id.
  void observe(const PeerIdentity& peer, double now_s, double uptime_s);

  /// Whether a process can have lived for so long.
  [[nodiscard]] static bool is_possible(double uptime_s) { return std::isfinite(uptime_s) && uptime_s >= 0.0; }

  /// What disagrees among those heard lately, in words; empty when all agree.
  [[nodiscard]] std::string trouble(double now_s) const;

  /// Of executables that are there more than once: all but the one that has lived longest. That is the one that the
  /// vehicle has gone by so far, and every process that has heard both comes to the same answer. A latecomer stays one
  /// as long as another is there: when the right one is started anew, the vehicle goes on with that.
  [[nodiscard]] std::vector<PeerIdentity> latecomers(double now_s) const;

  /// Whether anything of that needs a person: every disagreement does, since no process can mend it.
  [[nodiscard]] bool needs_person(double now_s) const { return !trouble(now_s).empty(); }

 private:
  struct Heard {
    PeerIdentity peer;
    double started_s = 0.0;  // by our clock
    double first_s = 0.0;
    double last_s = 0.0;
    int messages = 0;
    bool is_late = false;
  };
  struct Start {
    std::int32_t pid = 0;
    double heard_s = 0.0;
  };
  using Key = std::tuple<std::string, std::int32_t, UdpAddress>;  // name, process id, address

  [[nodiscard]] static Key key_of(const PeerIdentity& peer);
  [[nodiscard]] std::string disagreement(const Heard& heard) const;
  [[nodiscard]] bool are_twins(const Heard& a, const Heard& b, double now_s) const;
  [[nodiscard]] std::vector<std::pair<const Heard*, const Heard*>> twins(double now_s) const;
  [[nodiscard]] bool has_right_one(const std::string& process, double now_s) const;
  void judge_latecomers(const std::string& process, double now_s);
  void note_start(const std::string& process, std::int32_t pid, double now_s);

  PeerIdentity self_;
  std::map<Key, Heard> peers_;
  std::map<std::string, std::deque<Start>> starts_;  // the newest instances of each, by the first word of each
};

}  // namespace ignis::runtime
