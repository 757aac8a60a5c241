// SPDX-License-Identifier: Apache-2.0
#pragma once

// gcc says by macros, clang by features that it has a sanitizer on.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(__OPTIMIZE__)
#define IGNIS_BUILD_IS_SLOW true
#elif defined(__has_feature)
#define IGNIS_BUILD_IS_SLOW (__has_feature(address_sanitizer) || __has_feature(thread_sanitizer))
#else
#define IGNIS_BUILD_IS_SLOW false
#endif

namespace ignis::test {

/// By how much more processor time a build may take than the one that is shipped: with a sanitizer, or not optimised.
inline constexpr double kBuildSlowdown = IGNIS_BUILD_IS_SLOW ? 20.0 : 1.0;

}  // namespace ignis::test
