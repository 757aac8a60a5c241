// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>

namespace ignis {

/// How a coroutine of the server ends that nobody awaits: an exception leaves the context's run(), and ViewServer hands
/// it to the map's thread. boost::asio::detached would swallow it, and the server be dead without a word.
inline constexpr auto kRethrow = [](const std::exception_ptr& failure) {
  if (failure) std::rethrow_exception(failure);
};

}  // namespace ignis
