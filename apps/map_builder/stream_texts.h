// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "map/map_config.h"
#include "map_builder/view_board.h"
#include "runtime/hmi_config.h"

/// The JSON texts of the stream, as docs/wire_format.md lists them; hud.h and loop_table.h have the larger ones.
namespace ignis {

/// What the server tells each viewer first and never changes.
struct StreamTerms {
  std::string server_version;
  std::array<double, kLevels> cell_m{};
  std::array<double, kLevels> window_m{};
  double max_view_radius_m = 0.0;
  double frame_rate_hz = 0.0;
};
[[nodiscard]] StreamTerms stream_terms(const MapConfig& map, const runtime::HmiConfig& hmi);

[[nodiscard]] std::string hello_text(const StreamTerms& terms, std::int32_t session, std::int32_t revision);

/// Announces the binary message that follows. `sequence` is that of the connection.
[[nodiscard]] std::string frame_text(const MapPicture& picture, bool is_snapshot, std::int64_t sequence);

/// Keyframes that are new or have moved since `before`; all of them when there is no `before` or some are gone. Nothing
/// when there is nothing to tell.
[[nodiscard]] std::optional<std::string> keyframes_text(const KeyframeList* before, const KeyframeList& now);

enum class EventLevel : std::uint8_t { kInfo, kWarn, kError };

[[nodiscard]] std::string event_text(Utime utime, const char* kind, const std::string& text, EventLevel level);

[[nodiscard]] std::string error_text(const char* code, const std::string& reason);

}  // namespace ignis
