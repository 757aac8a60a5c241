// SPDX-License-Identifier: Apache-2.0
#include "drivers/byte_link.h"

#include <format>

#include "drivers/serial_port.h"
#include "drivers/udp_port.h"

namespace ignis::l1 {

std::unique_ptr<ByteLink> open_link(const std::string& port, int baud) {
  if (!is_udp(port)) return std::make_unique<SerialPort>(port, baud);
  const auto address = parse_udp_address(port);
  if (!address) throw LinkError(std::format("{} is not of the form {}", port, kUdpForm));
  return std::make_unique<UdpPort>(*address);
}

}  // namespace ignis::l1
