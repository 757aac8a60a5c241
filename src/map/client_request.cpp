// SPDX-License-Identifier: Apache-2.0
#include "map/client_request.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/config_json.h"

namespace ignis {
namespace {

using config::Json;
using Parsed = std::expected<ClientRequest, std::string>;

Parsed parse_view(const Json& value, double max_radius_m) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) {
    return std::unexpected(R"("view" must be a number of metres)");
  }
  return ViewRequest{std::clamp(value.get<double>(), kMinViewRadius, max_radius_m)};
}

Parsed parse_resync(const Json& value) {
  if (!value.is_boolean() || !value.get<bool>()) return std::unexpected(R"("resync" must be true)");
  return ResyncRequest{};
}

/// A keyframe id: a whole number from 0 on that fits 32 bits.
std::optional<std::int32_t> keyframe_id(const Json& loop, const char* name) {
  const auto found = loop.find(name);
  if (found == loop.end() || !found->is_number_unsigned()) return std::nullopt;
  const auto id = found->get<std::uint64_t>();
  if (id > static_cast<std::uint64_t>(std::numeric_limits<std::int32_t>::max())) return std::nullopt;
  return static_cast<std::int32_t>(id);
}

Parsed parse_loop(const std::string& key, const Json& value) {
  const bool has_two_keys = value.is_object() && value.size() == 2;
  const auto from_id = has_two_keys ? keyframe_id(value, "from") : std::nullopt;
  const auto to_id = has_two_keys ? keyframe_id(value, "to") : std::nullopt;
  if (!from_id || !to_id) return std::unexpected('"' + key + R"(" must be {"from": id, "to": id})");
  if (key == "loop") return LoopCloudsRequest{*from_id, *to_id};
  return LoopCommandRequest{key == "veto", *from_id, *to_id};
}

}  // namespace

Parsed parse_client_request(const std::string& text, double max_radius_m) {
  constexpr std::size_t kLongestRequest = 200;
  if (text.size() > kLongestRequest) return std::unexpected("request is too long");
  try {
    const Json request = config::parse_json(text, "request");
    if (request.size() == 1) {
      const std::string& key = request.begin().key();
      if (key == "view") return parse_view(*request.begin(), max_radius_m);
      if (key == "resync") return parse_resync(*request.begin());
      if (key == "loop" || key == "veto" || key == "withdraw") return parse_loop(key, *request.begin());
    }
    return std::unexpected(R"(expected one of "view", "resync", "loop", "veto", "withdraw")");
  } catch (const config::ConfigError&) {
    return std::unexpected("request is not a JSON object");
  }
}

}  // namespace ignis
