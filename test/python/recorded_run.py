# SPDX-License-Identifier: Apache-2.0
"""A small log of a live run, message by message: what the processes publish during half a second."""

from pathlib import Path
from typing import Any

import numpy as np
from ignis_lcm.ignis import (
    cloud_t,
    health_t,
    imu_t,
    keyframe_t,
    loop_result_t,
    pose_t,
    scan_stats_t,
    scan_t,
    smoothed_keyframes_t,
    state_t,
)

from ignis.log_config import CONFIG_CHANNEL, encoded
from ignis.logs import LogWriter

START_US = 1_700_000_000_000_000
POINTS = np.array([[1.0, 2.0, -3.0], [0.5, -0.25, -8.0], [4.0, 0.0, 1.0]], dtype=np.float32)
CONFIG = {"frontend": {"voxel_size_m": 0.1}}
TURNED = [np.cos(0.2), 0.0, np.sin(0.2), 0.0]  # to the left


def fill(message: Any, **values: Any) -> Any:
    for name, value in values.items():
        setattr(message, name, value)
    return message


def scan_parts(index: int) -> list[scan_t]:
    """A scan in two parts of three points each."""
    columns = {name: POINTS[:, axis].tolist() for axis, name in enumerate("xyz")}
    common = {"utime": START_US + 50_000 * index, "sequence": index, "part_count": 2, "duration_us": 40_000}
    return [
        fill(scan_t(), **common, **columns, part=part, num_points=3, intensity=[10.0, 20.0, 30.0],
             dt_us=[20_000 * part, 20_000 * part + 5_000, 20_000 * part + 20_000])
        for part in (0, 1)
    ]  # fmt: skip


def write_live_log(path: Path, seconds: float = 0.5) -> Path:
    """IMU at 100 Hz, scans at 20 Hz, and what front end and back end say; one loop that is withdrawn again."""
    with LogWriter(path) as writer:

        def say(utime: int, channel: str, message: Any) -> None:
            writer.write(utime + 700, channel, message.encode())

        writer.write(START_US, CONFIG_CHANNEL, encoded(CONFIG))
        for index in range(round(seconds * 100)):
            utime = START_US + 10_000 * index
            say(
                utime,
                "L1_IMU",
                fill(imu_t(), utime=utime, sequence=index, gyro=[0.1, 0.2, 0.3], accel=[0.0, 9.81, 1.0]),
            )
        for index in range(round(seconds * 20)):
            utime = START_US + 50_000 * index
            pose = {"position": [0.1 * index, 0.0, -0.5 * index], "quaternion": TURNED}
            for part in scan_parts(index):
                say(utime, "L1_SCAN", part)
            say(utime, "GROUND_TRUTH", fill(pose_t(), utime=utime, sequence=index, **pose))
            say(utime, "LIO_STATE", fill(state_t(), utime=utime, sequence=index, frame="odom", covariance_valid=1,
                                         num_covariance=225, covariance=[0.0] * 225, **pose))  # fmt: skip
            cloud = {name: POINTS[:, axis].tolist() for axis, name in enumerate("xyz")}
            say(utime, "LIO_CLOUD", fill(cloud_t(), utime=utime, sequence=index, part_count=1, num_points=3,
                                         intensity=[1.0, 2.0, 3.0], **cloud, **pose))  # fmt: skip
            reason = scan_stats_t.APPLIED if index != 3 else scan_stats_t.NO_IMU
            say(utime, "LIO_SCAN_STATS", fill(scan_stats_t(), utime=utime, sequence=index, applied=int(index != 3),
                                              reason=reason, reason_text="no IMU", **pose))  # fmt: skip
        end = START_US + round(seconds * 1e6)
        for number in (0, 1):
            utime = START_US + 50_000 * (1 + 5 * number)
            say(utime, "LIO_KEYFRAME", fill(keyframe_t(), utime=utime, id=number, part_count=1, quaternion=TURNED))
        at_rest = {"qw": [1.0, 1.0], "qx": [0.0, 0.0], "qy": [0.0, 0.0], "qz": [0.0, 0.0]}
        moved = fill(smoothed_keyframes_t(), utime=end, part_count=1, num_keyframes=2, ids=[0, 1], **at_rest)
        moved.px, moved.py, moved.pz, moved.map_odom_quaternion = [0.0, 1.0], [0.0, 2.0], [0.0, -3.0], [1.0, 0, 0, 0]
        say(end, "SMOOTHED_KEYFRAMES", moved)
        for stage, text in ((loop_result_t.STAGE_ON_TRIAL, "accepted"), (loop_result_t.STAGE_WITHDRAWN, "withdrawn")):
            say(end, "LOOP_RESULT", fill(loop_result_t(), utime=end, from_id=1, to_id=0, stage=stage, reason_text=text))
        say(end, "HEALTH", fill(health_t(), utime=end, process="lio_frontend", state=health_t.DEGRADED,
                                state_text="one direction is not observed"))  # fmt: skip
    return path
