// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Names of the channels, once. What each carries stands in lcmtypes/.
namespace ignis::runtime::channels {

inline constexpr char kImu[] = "L1_IMU";
inline constexpr char kScan[] = "L1_SCAN";
inline constexpr char kDriverStatus[] = "L1_STATUS";
inline constexpr char kState[] = "LIO_STATE";
inline constexpr char kScanStats[] = "LIO_SCAN_STATS";
inline constexpr char kCloud[] = "LIO_CLOUD";
inline constexpr char kCloudAgain[] = "LIO_CLOUD_AGAIN";
inline constexpr char kCloudRequest[] = "CLOUD_REQUEST";
inline constexpr char kLioCommand[] = "LIO_COMMAND";
inline constexpr char kKeyframe[] = "LIO_KEYFRAME";
inline constexpr char kKeyframeRequest[] = "KEYFRAME_REQUEST";
inline constexpr char kGraphCommand[] = "GRAPH_COMMAND";
inline constexpr char kSmoothedKeyframes[] = "SMOOTHED_KEYFRAMES";
inline constexpr char kSmoothedState[] = "SMOOTHED_STATE";
inline constexpr char kLoopResult[] = "LOOP_RESULT";
inline constexpr char kMapStatus[] = "MAP_STATUS";
inline constexpr char kGroundTruth[] = "GROUND_TRUTH";
inline constexpr char kHealth[] = "HEALTH";

}  // namespace ignis::runtime::channels
