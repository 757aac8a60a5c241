// SPDX-License-Identifier: Apache-2.0
#include "runtime/bus_filter.h"

#include <cerrno>
#include <system_error>

#include <linux/filter.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sys/socket.h>

namespace ignis::runtime {
namespace {

// Offsets from the UDP header's first byte [bytes].
constexpr std::uint32_t kSourcePort = 0;
constexpr std::uint32_t kMagic = 8;
constexpr std::uint32_t kChannel = 16;
constexpr std::uint32_t kSmallest = 8 + 8 + 2;  // UDP header, LCM header, a channel of one letter

constexpr std::uint32_t kSourceIp = static_cast<std::uint32_t>(SKF_NET_OFF) + 12;  // in the IP header, RFC 791
constexpr std::uint32_t kWholeMessage = 0x4C433032;                                // "LC02"; a fragment has "LC03"

/// Classic BPF over the datagram; the accumulator decides: 0 drops it, any other value is the length kept. A load from
/// behind the datagram's end drops it too.
class Program {
 public:
  void load(std::uint16_t width, std::uint32_t offset) { code_.push_back(BPF_STMT(BPF_LD | width | BPF_ABS, offset)); }

  void load_ancillary(std::uint32_t what) { load(BPF_W, static_cast<std::uint32_t>(SKF_AD_OFF) + what); }

  void load_length() { code_.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_LEN, 0)); }

  /// Skips `then` or `otherwise` instructions.
  void compare(std::uint16_t how, std::uint32_t value, std::uint8_t then, std::uint8_t otherwise) {
    code_.push_back(BPF_JUMP(BPF_JMP | how | BPF_K, value, then, otherwise));
  }

  void drop() { code_.push_back(BPF_STMT(BPF_RET | BPF_K, 0)); }

  void take() { code_.push_back(BPF_STMT(BPF_RET | BPF_K, 0xFFFFFFFF)); }

  void drop_unless(std::uint16_t how, std::uint32_t value) {
    compare(how, value, 1, 0);
    drop();
  }

  /// What other computers sent: our own come over the loopback interface, or as the kernel's copy of what left through
  /// another one.
  void drop_foreign() {
    load_ancillary(SKF_AD_PKTTYPE);
    compare(BPF_JEQ, PACKET_LOOPBACK, 3, 0);
    load_ancillary(SKF_AD_IFINDEX);
    drop_unless(BPF_JEQ, if_nametoindex("lo"));
  }

  void take_health() {
    load(BPF_W, kChannel);
    compare(BPF_JEQ, 0x4845414C, 0, 5);  // "HEAL"
    load(BPF_H, kChannel + 4);
    compare(BPF_JEQ, 0x5448, 0, 3);  // "TH"
    load(BPF_B, kChannel + 6);
    compare(BPF_JEQ, 0, 0, 1);
    take();
  }

  void drop_from(const UdpAddress& sender) {
    load(BPF_W, kSourceIp);
    compare(BPF_JEQ, sender.ip, 0, 3);
    load(BPF_H, kSourcePort);
    compare(BPF_JEQ, sender.port, 0, 1);
    drop();
  }

  [[nodiscard]] std::vector<sock_filter>& code() { return code_; }

 private:
  std::vector<sock_filter> code_;
};

Program program_of(const BusFilter& filter) {
  Program program;
  program.load_length();
  program.drop_unless(BPF_JGE, kSmallest);
  program.load(BPF_W, kMagic);
  program.drop_unless(BPF_JEQ, kWholeMessage);
  if (filter.stays_home) program.drop_foreign();
  if (filter.health_only || !filter.unheard.empty()) program.take_health();
  if (filter.health_only) {
    program.drop();
    return program;
  }
  for (const UdpAddress& sender : filter.unheard) program.drop_from(sender);
  program.take();
  return program;
}

}  // namespace

void BusFilter::attach(int descriptor) const {
  Program program = program_of(*this);
  const sock_fprog code{.len = static_cast<unsigned short>(program.code().size()), .filter = program.code().data()};
  if (setsockopt(descriptor, SOL_SOCKET, SO_ATTACH_FILTER, &code, sizeof code) != 0) {
    throw std::system_error(errno, std::system_category(), "the filter in front of the bus");
  }
}

}  // namespace ignis::runtime
