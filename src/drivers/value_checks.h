// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "drivers/driver_config.h"
#include "drivers/l1_messages.h"

/// A right checksum does not make content right: accelerations of 1e28 were seen in the field. Each check names the
/// first field that cannot be true, or gives an empty text.
namespace ignis::l1 {

[[nodiscard]] std::string_view fault_in(const Auxiliary& message, const DriverConfig& config);
[[nodiscard]] std::string_view fault_in(const Distance& message, const DriverConfig& config);
[[nodiscard]] std::string_view fault_in(const ImuAttitude& message, const DriverConfig& config);

/// Whether an axis stands at the sensor's full scale.
[[nodiscard]] bool is_saturated(const ImuAttitude& message, const DriverConfig& config);

}  // namespace ignis::l1
