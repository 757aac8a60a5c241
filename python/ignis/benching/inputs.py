# SPDX-License-Identifier: Apache-2.0
"""The drives of a benchmark: one simulated log per scene and seed, or a recording, and the same data in the form that
peers take."""

import concurrent.futures
import json
import multiprocessing
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ignis.benching.peer_runner import REST_S
from ignis.comparing.estimates import read_in_our_axes
from ignis.errors import InputError
from ignis.evaluation.drives import simulate
from ignis.files import put_in_place
from ignis.importers.recorder import IMU_CHANNEL, SCAN_CHANNEL, TRUTH_CHANNEL
from ignis.importing import ImportChoice, detect, import_recording
from ignis.logs import PartAssembler, joined_arrays, read_log
from ignis.mounts import R_OURS_FROM_FLU, effective_config
from ignis.poses import Trajectory, make_trajectory, write_tum

# Scans of fewer points are taken for those of an L1, which peers get several at a time.
_SPARSE_SCAN_POINTS = 5000


@dataclass(frozen=True)
class Drive:
    """One input: the same measurements in two files, and the truth."""

    scene: str  # or the recording's name
    sensor: str  # "l1" or "spinning"
    seed: int | None  # of a recording there is none
    log: Path
    arrays: Path
    truth: Path | None  # in our axes
    rest_s: float = REST_S  # how long the vehicle stands at first [s]


def sensor_of(scene: Path) -> str:
    """Model of the LiDAR that a scene file asks for."""
    return json.loads(scene.read_text(encoding="utf-8")).get("lidar", {}).get("model", "l1")


def make_drive(l1_sim: Path, scene: Path, seed: int, config: Path, folder: Path) -> Drive:
    """Simulates the drive unless an earlier run left it there complete."""
    out = folder / f"{scene.stem}_{seed}"
    truth = out / "ground_truth.tum"
    drive = Drive(scene.stem, sensor_of(scene), seed, out / "drive.lcm", out / "drive.npz", truth)
    if drive.arrays.exists():
        return drive
    simulate(l1_sim, scene, seed, config, drive.log, truth)
    _elsewhere(_write_arrays, drive.log, drive.arrays)
    return drive


def recorded_drive(source: Path, config: Path, gt: Path | None, gt_axes: str, folder: Path) -> Drive:
    """A recording of any kind that `./ignis import` reads, or an LCM log, with the truth in it or that of `gt`. What an
    earlier run left there may be of another recording or configuration, so all is made anew."""
    out = folder / "recordings" / source.resolve().name
    if source.resolve().is_relative_to(out.resolve()):
        raise InputError(f"{source} lies where the bench keeps its inputs; give another --out")
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    log, arrays, truth_file = out / "drive.lcm", out / "drive.npz", out / "ground_truth.tum"
    if detect(source) == "lcm":
        log = source
    else:
        import_recording(source, log, config, ImportChoice())
    truth = read_in_our_axes(gt, gt_axes, []) if gt is not None else _recorded_truth(log)
    if truth is not None:
        write_tum(truth_file, truth)
    points_per_scan = _elsewhere(_write_arrays, log, arrays)
    sensor = "l1" if points_per_scan < _SPARSE_SCAN_POINTS else "spinning"
    starts_moving = effective_config(config).get("frontend", {}).get("start") == "moving"
    rest_s = 0.0 if starts_moving else REST_S
    return Drive(out.name, sensor, None, log, arrays, None if truth is None else truth_file, rest_s)


def _recorded_truth(log: Path) -> Trajectory | None:
    rows = [
        (event.message.utime, event.message.position, event.message.quaternion)
        for event in read_log(log, {TRUTH_CHANNEL})
    ]
    return make_trajectory(rows) if rows else None


def _elsewhere(function, *arguments):
    """Calls it in a process of its own: what this one has once held would count as memory of every system that it
    starts."""
    with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as other:
        return other.submit(function, *arguments).result()


def _write_arrays(log: Path, arrays: Path) -> float:
    """Returns the median number of points of a scan."""
    imu_us, gyro, accel = [], [], []
    points, times, first = [], [], [0]
    parts = PartAssembler()
    for event in read_log(log, {IMU_CHANNEL, SCAN_CHANNEL}):
        message = event.message
        if event.channel == IMU_CHANNEL:
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
    put_in_place(temporary, arrays)
    return float(np.median(np.diff(first)))
