// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ignis::test {

/// By how much more processor time a build may take than the one that is shipped: with a sanitizer, or not optimised.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__OPTIMIZE__)
inline constexpr double kBuildSlowdown = 20.0;
#elif defined(__has_feature)  // clang's way to tell
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr double kBuildSlowdown = 20.0;
#else
inline constexpr double kBuildSlowdown = 1.0;
#endif
#else
inline constexpr double kBuildSlowdown = 1.0;
#endif

}  // namespace ignis::test
