# SPDX-License-Identifier: Apache-2.0
"""Plain files: trajectories in TUM format, tables, pose graphs."""

import csv
import shutil
from pathlib import Path

import numpy as np

from ignis.exporters.axes import trajectory_to_ros
from ignis.files import replacing
from ignis.log_arrays import ChannelArrays, read_log
from ignis.poses import Trajectory, write_tum
from ignis.run_folder import Run

_TABLES = ("scan_stats.csv", "eskf_states.csv", "loops.csv", "timing.csv")
# Longer fixed arrays are covariances, which nobody reads in a table.
_MOST_COLUMNS = 16


def write_trajectories(trajectories: dict[str, Trajectory], folder: Path, in_ros_axes: bool) -> list[Path]:
    """NAME.tum each, as they are or in axes of ROS."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, trajectory in trajectories.items():
        write_tum(folder / f"{name}.tum", trajectory_to_ros(trajectory) if in_ros_axes else trajectory)
    return [folder / f"{name}.tum" for name in trajectories]


def write_run_tables(run: Run, folder: Path) -> list[Path]:
    """The tables of a run, and both trajectories as one table more."""
    folder.mkdir(parents=True, exist_ok=True)
    copied = [name for name in _TABLES if (run.folder / name).is_file()]
    for name in copied:
        with replacing(folder / name) as temporary:
            shutil.copyfile(run.folder / name, temporary)
    _write_rows(folder / "trajectories.csv", *_trajectory_rows(run))
    return [folder / name for name in (*copied, "trajectories.csv")]


def _trajectory_rows(run: Run) -> tuple[list[str], list[list[object]]]:
    names = ("x", "y", "z", "qw", "qx", "qy", "qz")
    head = ["utime", *(f"eskf_{n}" for n in names), *(f"smoothed_{n}" for n in names)]
    parts = [np.hstack([t.poses.position, t.poses.quaternion]).tolist() for t in (run.eskf, run.smoothed)]
    return head, [[utime, *a, *b] for utime, a, b in zip(run.eskf.utime.tolist(), *parts, strict=True)]


def write_log_tables(log: Path, folder: Path) -> list[Path]:
    """CHANNEL.csv each: stamps, scalars and short arrays; of arrays whose length varies, only the length."""
    folder.mkdir(parents=True, exist_ok=True)
    channels = read_log(log)
    for name, channel in channels.items():
        _write_rows(folder / f"{name}.csv", *_channel_rows(channel))
    return [folder / f"{name}.csv" for name in channels]


def _channel_rows(channel: ChannelArrays) -> tuple[list[str], list[list[object]]]:
    head = ["log_utime"]
    columns: list[list[object]] = [channel.log_utime.tolist()]
    for name, values in channel.columns.items():
        if values.ndim == 1:
            head.append(name)
            columns.append(values.tolist())
        elif values.shape[1] <= _MOST_COLUMNS:
            head += [f"{name}_{index}" for index in range(values.shape[1])]
            columns += [values[:, index].tolist() for index in range(values.shape[1])]
    return head, [list(row) for row in zip(*columns, strict=True)]


def _write_rows(path: Path, head: list[str], rows: list[list[object]]) -> None:
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows(rows)
