// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <expected>
#include <string>
#include <variant>

namespace ignis {

inline constexpr double kDefaultViewRadius = 25.0;  ///< [m] until a client reports its own
inline constexpr double kMinViewRadius = 1.0;       ///< [m]

/// {"view": R}: how far the viewer sees [m], clamped to [kMinViewRadius, largest served].
struct ViewRequest {
  double radius_m = kDefaultViewRadius;
};

/// {"resync": true}: the viewer's voxels are not those that the server believes; it wants a snapshot.
struct ResyncRequest {};

/// {"loop": {"from": 12, "to": 3}}: the viewer wants to see the clouds of both keyframes.
struct LoopCloudsRequest {
  std::int32_t from_id = 0;
  std::int32_t to_id = 0;
};

/// {"veto": {...}} or {"withdraw": {...}}: the operator takes a loop out of the graph, for good or for now.
struct LoopCommandRequest {
  bool veto = false;
  std::int32_t from_id = 0;
  std::int32_t to_id = 0;
};

using ClientRequest = std::variant<ViewRequest, ResyncRequest, LoopCloudsRequest, LoopCommandRequest>;

/// Reads a client's text message: one JSON object with exactly one of the keys above. Returns the request, or what is
/// wrong with the message. Any bytes are safe.
[[nodiscard]] std::expected<ClientRequest, std::string> parse_client_request(const std::string& text,
                                                                             double max_radius_m);

}  // namespace ignis
