// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/pose.h"

namespace ignis {

/// What the graph may count on of a keyframe's scan information (attitude then position, body axes). What scans say
/// along a direction that they hardly observe comes from planes whose errors are alike from scan to scan, so that an
/// interval of many scans claims more there than it knows. Attitude and position are each compared with their own best
/// known direction: one that is known as well counts in full, one that is far worse known for an eighth.
[[nodiscard]] Matrix6d trusted_information(const Matrix6d& scan_information);

}  // namespace ignis
