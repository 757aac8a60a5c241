// SPDX-License-Identifier: Apache-2.0
//
// Bytes that a client may send as an HTTP request, through the parser that the server uses and through its rules of who
// may talk to it. The rules are told once more here, from the other side.

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <string>
#include <string_view>

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include "map/stream_encoding.h"
#include "map_builder/request_rules.h"
#include "require.h"

namespace {

using namespace ignis;
using fuzz::require;
namespace http = boost::beast::http;

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

/// A host that is let in without a configured origin is localhost or an address: hexadecimal digits, and a scope such
/// as %eth0 behind an IPv6 address. Brackets that open are closed, and nothing but a port follows them.
void judge_host(std::string_view host) {
  if (!host_is_allowed(host, "")) return;
  const std::string name = lower(host);
  if (name == "localhost" || name.starts_with("localhost:")) return;
  std::size_t end = name.find(':');
  std::size_t begin = 0;
  if (name.starts_with('[')) {
    begin = 1;
    end = name.find(']');
    require(end != std::string::npos && (end + 1 == name.size() || name[end + 1] == ':'));
  }
  const std::string address = name.substr(begin, end == std::string::npos ? end : end - begin);
  require(address.find_first_not_of("0123456789abcdef.:") == std::string::npos || address.contains('%'));
}

/// An origin that is let in is none, or that of the page.
void judge_origin(std::string_view origin, std::string_view host) {
  if (!origin_is_allowed(origin, host, "")) return;
  require(origin.empty() || lower(origin) == "http://" + lower(host));
}

void judge_protocol(std::string_view header) {
  require(!offers_protocol(header, kStreamProtocol) || header.contains(kStreamProtocol));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  http::request_parser<http::empty_body> parser;
  parser.header_limit(8 * 1024);
  boost::beast::error_code error;
  parser.put(boost::asio::buffer(data, size), error);
  if (!error && parser.is_header_done()) {
    const auto& request = parser.get();
    judge_host(request[http::field::host]);
    judge_origin(request[http::field::origin], request[http::field::host]);
    judge_protocol(request[http::field::sec_websocket_protocol]);
    static_cast<void>(boost::beast::websocket::is_upgrade(request));
  }
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  judge_host(text);
  judge_origin(text, text.substr(0, size / 2));
  judge_protocol(text);
  return 0;
}
