// SPDX-License-Identifier: Apache-2.0
//
// Configurations and scenes from strangers: a text is refused with a message that is itself plain text, or gives values
// that are within their ranges, print, and load again to the same. The first byte chooses what the text is: three
// sections by themselves, which the fuzzer sees through sooner than the whole file, a scene, or that file.

#include <cstdint>
#include <string>

#include "common/config_json.h"
#include "common/extrinsics.h"
#include "drivers/driver_config.h"
#include "drivers/sim/scene_config.h"
#include "map/map_config.h"
#include "require.h"
#include "runtime/ignis_config.h"

namespace {

using namespace ignis;
using fuzz::require;

template <class Config>
void check(const std::string& text) {
  try {
    const auto config = config::load<Config>(config::parse_json(text, "input"));
    const config::Json printed = config::Printer::print(config);
    require(config::Printer::print(config::load<Config>(printed)) == printed);
  } catch (const config::ConfigError& error) {
    const std::string message = error.what();
    require(!message.empty());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 5) {
    case 0:
      check<DriverConfig>(text);
      break;
    case 1:
      check<MapConfig>(text);
      break;
    case 2:
      check<Extrinsics>(text);
      break;
    case 3:
      check<sim::SceneConfig>(text);
      break;
    default:
      check<runtime::IgnisConfig>(text);
  }
  return 0;
}
