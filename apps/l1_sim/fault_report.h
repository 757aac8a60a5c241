// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "drivers/sim/byte_faults.h"

namespace ignis {

/// What was injected, in one line: "12210 frames; injected: 61 drop, 55 flip".
[[nodiscard]] std::string summary(const sim::ByteFaults& faults);

/// Writes one line per injected fault: offset in the damaged stream [bytes], frame of the undamaged one, fault.
void write_fault_list(const std::filesystem::path& file, const sim::ByteFaults& faults);

}  // namespace ignis
