// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>

namespace ignis::testing {

/// A path among the recordings, which a checkout may come without: environment IGNIS_DATA, or beside the checkout.
inline std::filesystem::path recorded_data(const std::filesystem::path& relative) {
  const char* root = std::getenv("IGNIS_DATA");
  return std::filesystem::path(root != nullptr ? root : IGNIS_DATA_DEFAULT) / relative;
}

}  // namespace ignis::testing

/// The one reason for which a test may stand aside, and it says so.
#define IGNIS_REQUIRE_DATA(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "not run, data absent: " << (path).string()
