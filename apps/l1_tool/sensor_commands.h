// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "runtime/application.h"
#include "sensor_session.h"

/// Commands to the sensor. Each repeats itself until the stream shows its effect, says what it saw, and gives kFailed
/// when nothing happened.
namespace ignis {

[[nodiscard]] runtime::ExitCode set_working_mode(SensorSession& session, l1::WorkingMode mode);

/// Prints the four version texts.
[[nodiscard]] runtime::ExitCode print_version(SensorSession& session);

/// `mode` 1: all lights as `lit`; 2..8: a built-in pattern. The effect shows in the work status of AUX frames, which a
/// sensor in standby does not send.
[[nodiscard]] runtime::ExitCode set_led(SensorSession& session, int mode, bool lit);

}  // namespace ignis
