# SPDX-License-Identifier: Apache-2.0
"""What is on the bus: rates, gaps, units of the inertial unit, gravity, mount angle, health of the processes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ignis.bus import Listener
from ignis.doctoring.finding import Finding, Severity

PROCESSES = ("l1_driver", "lio_frontend", "graph_backend", "map_builder")
GRAVITY = 9.81
_RATES = {"L1_IMU": (250.0, 0.1), "L1_SCAN": (20.0, 0.2)}
_MOUNT_CHECK = "./ignis mount-check"
_REST_GYRO = 0.3  # [rad/s]
_TILT_WARNING_DEG = 5.0
_AGE_WARNING_S = 2.0


@dataclass
class Heard:
    """What a few seconds of listening brought."""

    seconds: float
    gyro: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    accel: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    counts: dict[str, int] = field(default_factory=dict)
    lost: dict[str, int] = field(default_factory=dict)
    undecodable: dict[str, int] = field(default_factory=dict)
    health: list[Any] = field(default_factory=list)
    scan_points: int = 0
    age_s: float = 0.0

    def runs(self, process: str) -> bool:
        """Whether a process was heard."""
        return any(message.process == process for message in self.health)


def hear(url: str, seconds: float) -> Heard:
    """Listens."""
    samples: list[tuple[float, ...]] = []
    scans: set[int] = set()
    points = 0
    ages: list[float] = []

    def take(channel: str, message: Any) -> None:
        nonlocal points
        if channel == "L1_IMU":
            samples.append((*message.gyro, *message.accel))
            ages.append(time.time() - 1e-6 * message.utime)
        elif channel == "L1_SCAN":
            scans.add(message.sequence)
            points += message.num_points

    listener = Listener(url, on_message=take)
    listener.listen(seconds)
    table = np.array(samples, dtype=float).reshape(-1, 6)
    counts = {name: count.received for name, count in listener.channels.items()}
    if scans:
        counts["L1_SCAN"] = len(scans)  # a scan may travel in parts
    return Heard(
        seconds=seconds,
        gyro=table[:, :3],
        accel=table[:, 3:],
        counts=counts,
        lost={name: count.lost for name, count in listener.channels.items()},
        undecodable={name: count.undecodable for name, count in listener.channels.items()},
        health=[message for _, message in listener.health.values()],
        scan_points=points,
        age_s=float(np.median(ages)) if ages else 0.0,
    )


def check_data(heard: Heard) -> Iterator[Finding]:
    """All of this module."""
    yield from check_processes(heard)
    if not heard.counts.get("L1_IMU") and not heard.counts.get("L1_SCAN"):
        if heard.runs("l1_driver"):
            fix = "./ignis l1 version   # does the sensor answer? 12 V, plug, ./ignis l1 normal"
            yield Finding("data", "sensor data", Severity.ERROR, "l1_driver runs, but no sensor data comes", fix)
        else:
            text = "nobody publishes sensor data, so rates, units and mount angle were not looked at"
            yield Finding("data", "sensor data", Severity.NOTE, text, "./ignis up   # then ./ignis doctor again")
        return
    yield from check_rates(heard)
    yield from check_inertial(heard.gyro, heard.accel)
    if heard.counts.get("L1_SCAN") and heard.scan_points == 0:
        yield Finding(
            "data",
            "points",
            Severity.ERROR,
            "scans hold no points: cover on, or range limits wrong",
            "./ignis echo L1_STATUS",
        )
    if abs(heard.age_s) > _AGE_WARNING_S:
        text = f"stamps of measurements are {heard.age_s:+.1f} s from this computer's clock"
        yield Finding("data", "stamps", Severity.WARNING, text, "sudo timedatectl set-ntp true   # on each computer")


def check_processes(heard: Heard) -> Iterator[Finding]:
    """States, and agreement about configuration and version."""
    for message in heard.health:
        severity = {0: Severity.OK, 1: Severity.WARNING}.get(message.state, Severity.ERROR)
        fix = "" if severity == Severity.OK else "./ignis status   # and docs/troubleshooting.md"
        yield Finding("data", message.process, severity, message.state_text, fix)
    ours = [m for m in heard.health if m.process in PROCESSES]
    for what in ("config_hash", "version"):
        values = {getattr(m, what) for m in ours}
        if len(values) > 1:
            each = ", ".join(f"{m.process} {getattr(m, what)}" for m in ours)
            fix = "./ignis down && ./ignis up --config CONFIG   # all with one file"
            yield Finding("data", what, Severity.ERROR, f"processes disagree: {each}", fix)
    if ours and (missing := [name for name in PROCESSES if not heard.runs(name)]):
        yield Finding("data", "processes", Severity.WARNING, f"not on the bus: {', '.join(missing)}", "./ignis up")
    for channel, count in heard.undecodable.items():
        if count and channel.startswith(("L1_", "LIO_", "SMOOTHED_", "HEALTH")):
            text = f"{count} messages on {channel} are of another type or version"
            yield Finding("data", channel, Severity.ERROR, text, "./ignis hz   # stop whoever else publishes there")


def check_rates(heard: Heard) -> Iterator[Finding]:
    """Rates of the sensor's two streams, and gaps by the running number."""
    for channel, (expected, tolerance) in _RATES.items():
        rate = heard.counts.get(channel, 0) / heard.seconds
        lost = heard.lost.get(channel, 0)
        fix = "./ignis echo L1_STATUS   # crc_errors, imu_gaps, scan_gaps tell where it is lost"
        if abs(rate - expected) > tolerance * expected:
            severity = Severity.ERROR if rate < 0.5 * expected else Severity.WARNING
            yield Finding("data", channel, severity, f"{rate:.1f} Hz instead of {expected:.0f}", fix)
        elif lost:
            text = f"{rate:.1f} Hz, but {lost} messages missing in {heard.seconds:.0f} s"
            yield Finding("data", channel, Severity.WARNING, text, "sudo sysctl -w net.core.rmem_max=8388608")
        else:
            yield Finding("data", channel, Severity.OK, f"{rate:.1f} Hz, none missing")


def check_inertial(gyro: np.ndarray, accel: np.ndarray) -> Iterator[Finding]:
    """Units and direction of gravity, in the body frame (X right, Y up, -Z forward)."""
    if len(accel) < 50:
        return
    if not (np.all(np.isfinite(accel)) and np.all(np.isfinite(gyro))):
        yield Finding("data", "inertial unit", Severity.ERROR, "values that are no numbers", "./ignis echo L1_IMU")
        return
    if np.all(accel == accel[0]) and np.all(gyro == gyro[0]):
        yield Finding(
            "data", "inertial unit", Severity.ERROR, "values are frozen", "./ignis l1 standby && ./ignis l1 normal"
        )
        return
    mean, turning = accel.mean(axis=0), float(np.median(np.linalg.norm(gyro, axis=1)))
    size = float(np.linalg.norm(mean))
    if 0.8 < size < 1.2:
        text = f"gravity measures {size:.2f}: the unit is g, must be m/s^2"
        yield Finding(
            "data", "gravity", Severity.ERROR, text, f"{_MOUNT_CHECK}   # the importer or driver must convert"
        )
        return
    if turning > _REST_GYRO:
        hint = "degrees instead of radians?" if turning > 5.0 else "stand still and try again"
        severity = Severity.ERROR if turning > 5.0 else Severity.NOTE
        yield Finding("data", "rest", severity, f"turning at {turning:.2f} rad/s: {hint}", _MOUNT_CHECK)
        return
    if abs(size - GRAVITY) > 0.5:
        text = f"gravity measures {size:.2f} m/s^2 instead of {GRAVITY}"
        yield Finding("data", "gravity", Severity.ERROR, text, _MOUNT_CHECK)
        return
    yield Finding("data", "gravity", Severity.OK, f"{size:.2f} m/s^2")
    yield _mount_angle(mean / size)


def _mount_angle(up: np.ndarray) -> Finding:
    """`up`: direction of gravity's reaction in the body frame; (0, 1, 0) when the configured mount is right."""
    tilt = float(np.degrees(np.arccos(np.clip(up[1], -1.0, 1.0))))
    # Nose up by p: gravity's reaction leans towards the nose, -Z. Right side down by r: it leans to the left, -X.
    pitch, roll = (float(np.degrees(np.arctan2(-up[2], up[1]))), float(np.degrees(np.arctan2(-up[0], up[1]))))
    text = f"gravity is {tilt:.1f} degrees off vertical in the body frame (pitch {pitch:+.1f}, roll {roll:+.1f})"
    if tilt > 45.0:
        fix = f"{_MOUNT_CHECK}   # extrinsics.*.axes or angles are wrong"
        return Finding("data", "mount angle", Severity.ERROR, text, fix)
    if tilt > _TILT_WARNING_DEG:
        fix = f"{_MOUNT_CHECK}   # on level ground; then correct extrinsics"
        return Finding("data", "mount angle", Severity.WARNING, text, fix)
    return Finding("data", "mount angle", Severity.OK, text)
