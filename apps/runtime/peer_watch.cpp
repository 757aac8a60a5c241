// SPDX-License-Identifier: Apache-2.0
#include "runtime/peer_watch.h"

#include <format>

namespace ignis::runtime {
namespace {

constexpr std::size_t kMaxTextLength = 64;  // our names, versions and fingerprints are shorter

}  // namespace

void PeerWatch::observe(const PeerIdentity& peer, double now_s) {
  if (peer.process == self_.process && peer.pid == self_.pid) return;
  std::erase_if(peers_, [&](const auto& entry) { return now_s - entry.second.last_s > kForgetAfter_s; });
  const std::pair key{peer.process.substr(0, kMaxTextLength), peer.pid};
  if (peers_.size() >= kMaxPeers && !peers_.contains(key)) return;
  Heard& heard = peers_[key];
  heard.peer = {.process = key.first,
                .pid = peer.pid,
                .version = peer.version.substr(0, kMaxTextLength),
                .config_hash = peer.config_hash.substr(0, kMaxTextLength)};
  heard.last_s = now_s;
  ++heard.messages;
}

std::string PeerWatch::disagreement(const Heard& heard) const {
  const PeerIdentity& peer = heard.peer;
  if (peer.process == self_.process && heard.messages >= kInstanceMessages) {
    return std::format("a second {} is on the bus (process {})", peer.process, peer.pid);
  }
  if (peer.config_hash != self_.config_hash) {
    return std::format("configuration differs from that of {} (ours {}, its {})", peer.process, self_.config_hash,
                       peer.config_hash);
  }
  if (peer.version != self_.version) {
    return std::format("version {} differs from {} of {}", self_.version, peer.version, peer.process);
  }
  return {};
}

std::string PeerWatch::trouble(double now_s) const {
  std::string text;
  for (const auto& [key, heard] : peers_) {
    if (now_s - heard.last_s > kForgetAfter_s) continue;
    const std::string one = disagreement(heard);
    if (one.empty()) continue;
    if (!text.empty()) text += "; ";
    text += one;
  }
  return text;
}

}  // namespace ignis::runtime
