// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ignis::runtime {

/// From now on SIGINT and SIGTERM only raise a flag, so that each main loop ends by itself and keeps what it has.
void catch_stop_signals();

/// True once a stop was asked for.
[[nodiscard]] bool stop_requested();

}  // namespace ignis::runtime
