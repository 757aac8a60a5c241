// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

/// Who may talk to the server. Browsers do not apply their same-origin rule to WebSockets, so the server must.
namespace ignis {

/// True for a Host header that names an IP address or localhost. A page that lets its own host name point at this
/// machine (DNS rebinding) cannot send such a header. `allowed_origin` adds the host of that origin.
[[nodiscard]] bool host_is_allowed(std::string_view host, std::string_view allowed_origin);

/// True when the request comes from a page that this server delivered, from `allowed_origin`, or from no browser.
[[nodiscard]] bool origin_is_allowed(std::string_view origin, std::string_view host, std::string_view allowed_origin);

/// True when a comma-separated Sec-WebSocket-Protocol header offers `protocol`.
[[nodiscard]] bool offers_protocol(std::string_view header, std::string_view protocol);

}  // namespace ignis
