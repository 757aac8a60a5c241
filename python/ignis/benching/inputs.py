# SPDX-License-Identifier: Apache-2.0
"""The drives of a benchmark: one simulated log per scene and seed, and the same data in the form that peers take."""

import concurrent.futures
import json
import multiprocessing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ignis.evaluation.drives import simulate
from ignis.logs import PartAssembler, joined_arrays, read_log
from ignis.mounts import R_OURS_FROM_FLU


@dataclass(frozen=True)
class Drive:
    """One input: the same measurements in two files, and the truth."""

    scene: str
    sensor: str  # "l1" or "spinning"
    seed: int
    log: Path
    arrays: Path
    truth: Path


def sensor_of(scene: Path) -> str:
    """Model of the LiDAR that a scene file asks for."""
    return json.loads(scene.read_text(encoding="utf-8")).get("lidar", {}).get("model", "l1")


def make_drive(l1_sim: Path, scene: Path, seed: int, config: Path, folder: Path) -> Drive:
    """Simulates the drive unless an earlier run left it there complete."""
    out = folder / f"{scene.stem}_{seed}"
    drive = Drive(scene.stem, sensor_of(scene), seed, out / "drive.lcm", out / "drive.npz", out / "ground_truth.tum")
    if drive.arrays.exists():
        return drive
    simulate(l1_sim, scene, seed, config, drive.log, drive.truth)
    # In a process of its own: what this one has once held would count as memory of every system that it starts.
    with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as other:
        other.submit(_write_arrays, drive.log, drive.arrays).result()
    return drive


def _write_arrays(log: Path, arrays: Path) -> None:
    imu_us, gyro, accel = [], [], []
    points, times, first = [], [], [0]
    parts = PartAssembler()
    for event in read_log(log, {"L1_IMU", "L1_SCAN"}):
        message = event.message
        if event.channel == "L1_IMU":
            imu_us.append(message.utime)
            gyro.append(message.gyro)
            accel.append(message.accel)
            continue
        whole = parts.add(message)
        if whole is None:
            continue
        scan = joined_arrays(whole)
        points.append(np.stack([scan["x"], scan["y"], scan["z"]], axis=1))
        times.append(message.utime + scan["dt_us"].astype(np.int64))
        first.append(first[-1] + len(points[-1]))
    to_flu = R_OURS_FROM_FLU
    temporary = arrays.with_suffix(".tmp.npz")
    np.savez(
        temporary,
        xyz=(np.concatenate(points) @ to_flu).astype(np.float32),
        time_us=np.concatenate(times),
        first=np.array(first),
        imu_us=np.array(imu_us, dtype=np.int64),
        gyro=np.array(gyro) @ to_flu,
        accel=np.array(accel) @ to_flu,
    )
    temporary.rename(arrays)
