// SPDX-License-Identifier: Apache-2.0
#include "map/view_request.h"

#include <algorithm>
#include <cmath>

#include "common/config_json.h"

namespace ignis {

std::expected<double, std::string> parse_view_request(const std::string& text, double max_radius) {
  constexpr std::size_t kLongestRequest = 200;
  if (text.size() > kLongestRequest) return std::unexpected("request is too long");
  try {
    const config::Json request = config::parse_json(text, "request");
    if (request.size() != 1 || !request.contains("view")) return std::unexpected(R"(expected {"view": radius})");
    const config::Json& radius = request["view"];
    if (!radius.is_number() || !std::isfinite(radius.get<double>())) {
      return std::unexpected(R"("view" must be a number of metres)");
    }
    return std::clamp(radius.get<double>(), kMinViewRadius, max_radius);
  } catch (const config::ConfigError&) {
    return std::unexpected("request is not a JSON object");
  }
}

}  // namespace ignis
