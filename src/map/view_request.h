// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <string>

namespace ignis {

inline constexpr double kDefaultViewRadius = 25.0;  ///< [m] until a client reports its own
inline constexpr double kMinViewRadius = 1.0;       ///< [m]

/// Reads a client's message {"view": R}: exactly this one key with a finite number. Returns R clamped to
/// [kMinViewRadius, max_radius] in metres, or what is wrong with the message.
[[nodiscard]] std::expected<double, std::string> parse_view_request(const std::string& text, double max_radius);

}  // namespace ignis
