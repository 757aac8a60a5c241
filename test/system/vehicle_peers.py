# SPDX-License-Identifier: Apache-2.0
"""What the vehicle tests share: HEALTH and sensor data as other processes would publish them."""

import math
import threading
import time

import lcm
from ignis_lcm.ignis import health_t, imu_t, scan_t


def health(process: str, pid: int = 4242, config_hash: str = "aa", version: str = "0.1.0", state: int = 0) -> health_t:
    """A HEALTH message."""
    message = health_t()
    message.process, message.pid, message.version, message.config_hash = process, pid, version, config_hash
    message.state, message.state_text = state, "OK" if state == 0 else "something is wrong"
    return message


class Talker:
    """Publishes an inertial unit, scans and HEALTH at their rates until it is left."""

    def __init__(
        self,
        url: str,
        *,
        accel: tuple[float, float, float] = (0.0, 9.81, 0.0),
        gyro: tuple[float, float, float] = (0.0, 0.0, 0.0),
        imu_hz: float = 250.0,
        lose_every: int = 0,
        points: int = 100,
        healths: tuple[health_t, ...] = (),
        age_s: float = 0.0,
    ) -> None:
        self.bus = lcm.LCM(url)
        self.accel, self.gyro, self.imu_hz, self.lose_every = accel, gyro, imu_hz, lose_every
        self.points, self.healths, self.age_s = points, healths, age_s
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._talk, daemon=True)

    def __enter__(self) -> "Talker":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _talk(self) -> None:
        began = time.monotonic()
        sent = {"imu": 0, "scan": 0, "health": 0}
        while not self._stop.is_set():
            elapsed = time.monotonic() - began
            while sent["imu"] < elapsed * self.imu_hz:
                sent["imu"] += 1
                if not self.lose_every or sent["imu"] % self.lose_every:
                    self._send_imu(sent["imu"])
            while sent["scan"] < elapsed * 20.0:
                sent["scan"] += 1
                self._send_scan(sent["scan"])
            while sent["health"] < elapsed:
                sent["health"] += 1
                for message in self.healths:
                    self.bus.publish("HEALTH", message.encode())
            time.sleep(0.002)

    def _send_imu(self, sequence: int) -> None:
        message = imu_t()
        message.utime = int((time.time() - self.age_s) * 1e6)
        message.sequence = sequence
        noise = 1e-3 * math.sin(sequence)
        message.gyro = [value + noise for value in self.gyro]
        message.accel = [value + noise for value in self.accel]
        self.bus.publish("L1_IMU", message.encode())

    def _send_scan(self, sequence: int) -> None:
        message = scan_t()
        message.utime, message.sequence, message.num_points = int(time.time() * 1e6), sequence, self.points
        message.part, message.part_count = 0, 1
        message.x = message.y = message.z = message.intensity = [1.0] * self.points
        message.dt_us = [0] * self.points
        self.bus.publish("L1_SCAN", message.encode())
