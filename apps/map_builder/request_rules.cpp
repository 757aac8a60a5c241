// SPDX-License-Identifier: Apache-2.0
#include "map_builder/request_rules.h"

#include <algorithm>
#include <cctype>

#include <boost/asio/ip/address.hpp>

namespace ignis {
namespace {

std::string_view trim(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

bool same_ignoring_case(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

bool is_address(std::string_view text) {
  boost::system::error_code error;
  boost::asio::ip::make_address(std::string(text), error);
  // The system reads an address up to the first NUL, whatever stands behind it.
  return !error && !text.contains('\0');
}

/// Brackets hold an IPv6 address and nothing else, and they are closed (RFC 3986, section 3.2.2).
bool is_bracketed_address(std::string_view host) {
  const std::size_t end = host.find(']');
  if (end == std::string_view::npos) return false;
  const std::string_view address = host.substr(1, end - 1);
  const std::string_view rest = host.substr(end + 1);
  return address.contains(':') && is_address(address) && (rest.empty() || rest.starts_with(':'));
}

bool names_an_address_or_localhost(std::string_view host) {
  if (host.starts_with('[')) return is_bracketed_address(host);
  const std::string_view name = host.substr(0, host.find(':'));
  return same_ignoring_case(name, "localhost") || is_address(name);
}

std::string_view host_of_origin(std::string_view origin) {
  const std::size_t scheme_end = origin.find("://");
  return scheme_end == std::string_view::npos ? std::string_view{} : origin.substr(scheme_end + 3);
}

}  // namespace

bool host_is_allowed(std::string_view host, std::string_view allowed_origin) {
  if (names_an_address_or_localhost(host)) return true;
  return !host.empty() && same_ignoring_case(host, host_of_origin(allowed_origin));
}

bool origin_is_allowed(std::string_view origin, std::string_view host, std::string_view allowed_origin) {
  if (origin.empty()) return true;
  if (!allowed_origin.empty() && same_ignoring_case(origin, allowed_origin)) return true;
  return same_ignoring_case(origin, "http://" + std::string(host));
}

bool offers_protocol(std::string_view header, std::string_view protocol) {
  while (true) {
    const std::size_t comma = header.find(',');
    if (trim(header.substr(0, comma)) == protocol) return true;
    if (comma == std::string_view::npos) return false;
    header.remove_prefix(comma + 1);
  }
}

}  // namespace ignis
