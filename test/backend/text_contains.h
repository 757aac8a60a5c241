// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string_view>

namespace ignis::testing {

/// For EXPECT_TRUE: shows the whole text when the part is not in it.
inline ::testing::AssertionResult contains(std::string_view text, std::string_view part) {
  if (text.contains(part)) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << '"' << part << "\" is not in \"" << text << '"';
}

}  // namespace ignis::testing
