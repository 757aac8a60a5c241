// SPDX-License-Identifier: Apache-2.0
//
// The texts that a browser may send, under a coverage-guided fuzzer. Whatever comes, the parser either refuses with a
// reason or returns values within their ranges.

#include <cmath>
#include <cstdint>
#include <string>
#include <variant>

#include "map/client_request.h"
#include "require.h"

namespace {

using namespace ignis;
using fuzz::require;

constexpr double kMaxRadius = 150.0;

struct Judge {
  void operator()(const ViewRequest& view) const {
    require(view.radius_m >= kMinViewRadius && view.radius_m <= kMaxRadius);
  }
  void operator()(const ResyncRequest&) const {}
  void operator()(const LoopCloudsRequest& loop) const { require(loop.from_id >= 0 && loop.to_id >= 0); }
  void operator()(const LoopCommandRequest& loop) const { require(loop.from_id >= 0 && loop.to_id >= 0); }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto request = parse_client_request(text, kMaxRadius);
  if (request) {
    std::visit(Judge{}, *request);
  } else {
    require(!request.error().empty());
  }
  return 0;
}
