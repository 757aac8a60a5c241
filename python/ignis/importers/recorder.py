# SPDX-License-Identifier: Apache-2.0
"""From raw sensor data to an LCM log in the body frame, in time order.

A record of the log is stamped with the instant at which its content is complete: the measurement for inertial samples
and ground truth, the last point for scans, as a driver would have published it.
"""

import heapq
from collections import Counter
from pathlib import Path
from typing import Any, Self

import numpy as np

from ignis.logs import LogWriter
from ignis.mounts import Extrinsics

IMU_CHANNEL = "L1_IMU"
SCAN_CHANNEL = "L1_SCAN"
TRUTH_CHANNEL = "GROUND_TRUTH"

# 2,900 points of five 4-byte values stay below 60 kB, one datagram.
POINTS_PER_PART = 2900
# Recordings are nearly in order: what is later than this against the newest content is dropped and counted.
REORDER_WINDOW_US = 3_000_000
# [us] a point farther than this from the middle of its scan has a damaged time.
MAX_TIME_FROM_MEDIAN_US = 5_000_000
# [m] sensors report "no return" as a point at their origin.
MIN_RANGE_M = 0.05
TEMPERATURE_UNKNOWN = -1000.0


class Recorder:
    """Collects sensor data in any order and writes the log."""

    def __init__(self, path: Path, extrinsics: Extrinsics) -> None:
        from ignis_lcm.ignis import imu_t, pose_t, scan_t

        self._types = {"imu": imu_t, "pose": pose_t, "scan": scan_t}
        self._writer = LogWriter(path)
        self._r_body_imu = extrinsics.imu.rotation()
        self._imu_position = extrinsics.imu.translation()
        self._r_body_lidar = extrinsics.lidar.rotation()
        self._lidar_position = extrinsics.lidar.translation()
        self._waiting: list[tuple[int, int, str, list[Any]]] = []
        self._added = 0
        self._newest = -(1 << 62)
        self._written_until: dict[str, int] = {}
        self._sequences: Counter[str] = Counter()
        self.counts: Counter[str] = Counter()
        self.dropped: Counter[str] = Counter()
        self.scan_utimes: list[int] = []

    def add_imu(self, utime: int, gyro: np.ndarray, accel: np.ndarray) -> None:
        """One inertial sample in the axes of the inertial unit [rad/s, m/s^2]."""
        if not (np.all(np.isfinite(gyro)) and np.all(np.isfinite(accel))):
            self.dropped["inertial samples that are not finite"] += 1
            return
        gyro_body = self._r_body_imu @ gyro
        # Specific force at the body origin: the unit at r feels the centripetal term w x (w x r) on top. The term of
        # the angular acceleration would need a derivative of noise and is left out.
        centripetal = np.cross(gyro_body, np.cross(gyro_body, self._imu_position))
        message = self._types["imu"]()
        message.utime = utime
        message.gyro = gyro_body.tolist()
        message.accel = (self._r_body_imu @ accel - centripetal).tolist()
        message.temperature = TEMPERATURE_UNKNOWN
        self._push(utime, IMU_CHANNEL, [message])

    def add_scan(self, point_utime: np.ndarray, points: np.ndarray, intensity: np.ndarray) -> None:
        """One scan in LiDAR axes: instants [us], (N, 3) positions [m], reflectivity 0..255."""
        usable = np.isfinite(points).all(axis=1)
        usable &= np.square(np.where(usable[:, None], points, 0.0)).sum(axis=1) > MIN_RANGE_M**2
        if usable.any():
            usable &= np.abs(point_utime - np.median(point_utime[usable])) < MAX_TIME_FROM_MEDIAN_US
        if not usable.any():
            self.dropped["scans without a usable point"] += 1
            return
        order = np.argsort(point_utime[usable], kind="stable")
        stamps = point_utime[usable][order]
        body = points[usable][order] @ self._r_body_lidar.T + self._lidar_position
        self._push(int(stamps[-1]), SCAN_CHANNEL, self._scan_parts(stamps, body, intensity[usable][order]))

    def add_truth(self, utime: int, position: np.ndarray, quaternion: np.ndarray, velocity: np.ndarray) -> None:
        """One true body pose (w x y z) in our world axes."""
        message = self._types["pose"]()
        message.utime = utime
        message.position, message.quaternion = position.tolist(), quaternion.tolist()
        message.velocity = velocity.tolist()
        self._push(utime, TRUTH_CHANNEL, [message])

    def _scan_parts(self, stamps: np.ndarray, body: np.ndarray, intensity: np.ndarray) -> list[Any]:
        dt_us = stamps - stamps[0]
        intensity = np.nan_to_num(np.clip(intensity, 0.0, 255.0))
        starts = range(0, len(stamps), POINTS_PER_PART)
        parts = []
        for number, start in enumerate(starts):
            chosen = slice(start, start + POINTS_PER_PART)
            part = self._types["scan"]()
            part.utime, part.duration_us = int(stamps[0]), int(dt_us[-1])
            part.part, part.part_count = number, len(starts)
            part.x, part.y, part.z = body[chosen].T.tolist()
            part.intensity, part.dt_us = intensity[chosen].tolist(), dt_us[chosen].tolist()
            part.num_points = len(part.x)
            parts.append(part)
        return parts

    def _push(self, utime: int, channel: str, messages: list[Any]) -> None:
        heapq.heappush(self._waiting, (utime, self._added, channel, messages))
        self._added += 1
        self._newest = max(self._newest, utime)
        while self._waiting[0][0] < self._newest - REORDER_WINDOW_US:
            self._write_next()

    def _write_next(self) -> None:
        utime, _, channel, messages = heapq.heappop(self._waiting)
        if utime <= self._written_until.get(channel, utime - 1):
            self.dropped[f"{channel} content that is late or doubled"] += 1
            return
        self._written_until[channel] = utime
        for message in messages:
            message.sequence = self._sequences[channel]
            self._writer.write(utime, channel, message.encode())
        self._sequences[channel] += 1
        self.counts[channel] += 1
        if channel == SCAN_CHANNEL:
            self.scan_utimes.append(messages[0].utime)

    def finish(self) -> None:
        """Writes what is still waiting."""
        while self._waiting:
            self._write_next()
        self._writer.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()
