// SPDX-License-Identifier: Apache-2.0
#include "map_builder/tcp_progress.h"

// The kernel's own header: the C library's tcp_info ends before the field that we read, and the two exclude each other.
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace ignis {

TcpProgress tcp_progress(int socket) {
  tcp_info info{};
  socklen_t size = sizeof info;
  if (getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return {};
  return {.acknowledged = info.tcpi_bytes_acked, .is_complete = info.tcpi_unacked == 0 && info.tcpi_notsent_bytes == 0};
}

}  // namespace ignis
