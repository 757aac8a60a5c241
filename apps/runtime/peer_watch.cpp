// SPDX-License-Identifier: Apache-2.0
#include "runtime/peer_watch.h"

#include <algorithm>
#include <format>
#include <iterator>

namespace ignis::runtime {
namespace {

constexpr std::size_t kMaxTextLength = 64;  // our names, versions and fingerprints are shorter

/// The process ids of two instances, and where they are if the ids alone do not tell.
std::string both(const PeerIdentity& a, const PeerIdentity& b) {
  if (a.pid != b.pid) return std::format("{} and {}", a.pid, b.pid);
  const auto place = [](const UdpAddress& of) {
    return std::format("{}.{}.{}.{}:{}", of.ip >> 24U, of.ip >> 16U & 255U, of.ip >> 8U & 255U, of.ip & 255U, of.port);
  };
  return std::format("{} at {} and {}", a.pid, place(a.sender), place(b.sender));
}

}  // namespace

PeerWatch::Key PeerWatch::key_of(const PeerIdentity& peer) {
  return {peer.process.substr(0, kMaxTextLength), peer.pid, peer.sender};
}

void PeerWatch::observe(const PeerIdentity& peer, double now_s, double uptime_s) {
  if (key_of(peer) == key_of(self_) || !is_possible(uptime_s)) return;
  std::erase_if(peers_, [&](const auto& entry) { return now_s - entry.second.last_s > kForgetAfter_s; });
  const Key key = key_of(peer);
  if (peers_.size() >= kMaxPeers && !peers_.contains(key)) return;
  Heard& heard = peers_[key];
  heard.peer = {.process = std::get<std::string>(key),
                .pid = peer.pid,
                .version = peer.version.substr(0, kMaxTextLength),
                .config_hash = peer.config_hash.substr(0, kMaxTextLength),
                .sender = peer.sender};
  if (heard.messages == 0) {
    heard.started_s = now_s - uptime_s;
    heard.first_s = now_s;
  }
  heard.last_s = now_s;
  ++heard.messages;
  note_start(heard.peer.process, peer.pid, now_s);
  judge_latecomers(heard.peer.process, now_s);
}

void PeerWatch::note_start(const std::string& process, std::int32_t pid, double now_s) {
  std::erase_if(starts_, [&](const auto& entry) { return now_s - entry.second.back().heard_s > kCrashLoopSeconds; });
  if (starts_.size() >= kMaxPeers && !starts_.contains(process)) return;
  std::deque<Start>& starts = starts_[process];
  if (std::ranges::contains(starts, pid, &Start::pid)) return;
  starts.push_back({pid, now_s});
  if (starts.size() > kCrashLoopStarts) starts.pop_front();
}

std::string PeerWatch::disagreement(const Heard& heard) const {
  const PeerIdentity& peer = heard.peer;
  if (peer.process == self_.process && heard.messages >= kInstanceMessages) {
    return std::format("a second {} is on the bus (process {})", peer.process, peer.pid);
  }
  // Whoever says nothing about itself, such as a tool, contradicts nobody.
  if (!peer.config_hash.empty() && peer.config_hash != self_.config_hash) {
    return std::format("configuration differs from that of {} (ours {}, its {})", peer.process, self_.config_hash,
                       peer.config_hash);
  }
  if (!peer.version.empty() && peer.version != self_.version) {
    return std::format("version {} differs from {} of {}", self_.version, peer.version, peer.process);
  }
  return {};
}

/// Two others of one name that are both there. Tools, which name no configuration, may be there twice.
bool PeerWatch::are_twins(const Heard& a, const Heard& b, double now_s) const {
  const bool is_no_concern =
      a.peer.process == self_.process || a.peer.config_hash.empty() || b.peer.config_hash.empty();
  if (a.peer.process != b.peer.process || is_no_concern) return false;
  const double gone_first_s = std::min(a.last_s, b.last_s);
  if (now_s - gone_first_s > kForgetAfter_s) return false;
  return gone_first_s - std::max(a.first_s, b.first_s) >= kSideBySide_s;
}

/// In the order of names, instances of one executable stand together; one between two others may just have ended.
std::vector<std::pair<const PeerWatch::Heard*, const PeerWatch::Heard*>> PeerWatch::twins(double now_s) const {
  std::vector<std::pair<const Heard*, const Heard*>> found;
  for (auto each = peers_.begin(); each != peers_.end(); ++each) {
    for (auto other = std::next(each); other != peers_.end(); ++other) {
      if (other->second.peer.process != each->second.peer.process) break;
      if (are_twins(each->second, other->second, now_s)) found.emplace_back(&each->second, &other->second);
    }
  }
  return found;
}

/// Whether one of this name is still heard that is no latecomer.
bool PeerWatch::has_right_one(const std::string& process, double now_s) const {
  return std::ranges::any_of(peers_, [&](const auto& entry) {
    const Heard& heard = entry.second;
    return heard.peer.process == process && !heard.is_late && now_s - heard.last_s <= kForgetAfter_s;
  });
}

void PeerWatch::judge_latecomers(const std::string& process, double now_s) {
  if (!has_right_one(process, now_s)) {
    for (auto& [key, heard] : peers_) {
      if (heard.peer.process == process) heard.is_late = false;
    }
  }
  for (const auto& [a, b] : twins(now_s)) {
    if (a->peer.process != process || a->is_late || b->is_late) continue;
    const PeerIdentity& later = a->started_s <= b->started_s ? b->peer : a->peer;
    peers_.at(key_of(later)).is_late = true;
  }
}

std::vector<PeerIdentity> PeerWatch::latecomers(double now_s) const {
  std::vector<PeerIdentity> late;
  for (const auto& [key, heard] : peers_) {
    const bool is_heard = now_s - heard.last_s <= kForgetAfter_s;
    if (heard.is_late && is_heard && has_right_one(heard.peer.process, now_s)) late.push_back(heard.peer);
  }
  return late;
}

std::string PeerWatch::trouble(double now_s) const {
  std::string text;
  const auto add = [&text](const std::string& one) {
    if (!text.empty() && !one.empty()) text += "; ";
    text += one;
  };
  for (const auto& [key, heard] : peers_) {
    if (now_s - heard.last_s <= kForgetAfter_s) add(disagreement(heard));
  }
  for (const auto& [a, b] : twins(now_s)) {
    add(std::format("two instances of {} are on the bus (processes {})", a->peer.process, both(a->peer, b->peer)));
  }
  for (const auto& [process, starts] : starts_) {
    if (starts.size() == kCrashLoopStarts && now_s - starts.front().heard_s <= kCrashLoopSeconds) {
      add(std::format("{} was started {} times within {:.0f} s", process, starts.size(), kCrashLoopSeconds));
    }
  }
  return text;
}

}  // namespace ignis::runtime
