# SPDX-License-Identifier: Apache-2.0
"""What `./ignis replay` left in a folder, typed."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ignis.errors import InputError
from ignis.pose_graph import PoseGraph, read_pose_graph
from ignis.poses import Trajectory, read_tum
from ignis.tables import Columns, read_table


@dataclass(frozen=True)
class Run:
    """The results of one replay."""

    folder: Path
    report: dict[str, Any]
    config: dict[str, Any]
    eskf: Trajectory  # frame odom, one row per scan
    smoothed: Trajectory  # frame map, on the same stamps
    truth: Trajectory | None
    scans: Columns  # scan_stats.csv
    states: Columns  # eskf_states.csv: velocity, biases, sigmas, covariance of the pose
    loops: Columns
    timing: Columns | None
    graph: PoseGraph

    @property
    def name(self) -> str:
        return self.folder.resolve().name

    @property
    def log(self) -> Path | None:
        """The log that was replayed, where it still lies."""
        path = Path(self.report.get("log_path", ""))
        return path if path.is_file() else None


def is_run(folder: Path) -> bool:
    """True for a folder with the results of a replay."""
    return (folder / "report.json").is_file() and (folder / "eskf.tum").is_file()


def read_run(folder: Path | str) -> Run:
    """Reads a folder that `./ignis replay` wrote."""
    folder = Path(folder)
    if not is_run(folder):
        raise InputError(f"{folder} holds no results of a replay (report.json, eskf.tum); run ./ignis replay first")
    truth = folder / "ground_truth.tum"
    timing = folder / "timing.csv"
    return Run(
        folder=folder,
        report=read_json(folder / "report.json"),
        config=read_json(folder / "config.json"),
        eskf=read_tum(folder / "eskf.tum"),
        smoothed=read_tum(folder / "smoothed.tum"),
        truth=read_tum(truth) if truth.is_file() else None,
        scans=read_table(folder / "scan_stats.csv"),
        states=read_table(folder / "eskf_states.csv"),
        loops=read_table(folder / "loops.csv"),
        timing=read_table(timing) if timing.is_file() else None,
        graph=read_pose_graph(folder / "keyframes.g2o"),
    )


def losses_in(report: dict[str, Any]) -> str:
    """What the log of a replay lacks, in words; empty when it holds all that was measured."""
    content = report["input"]
    counts = [
        (content["missing_imu"], "IMU samples missing"),
        (content["missing_scans"], "scans missing"),
        (content["incomplete_scans"], "scans with a part missing"),
        (content["undecodable"], "messages undecodable"),
        (content["damaged_bytes"], "bytes damaged"),
    ]
    return ", ".join(f"{count} {what}" for count, what in counts if count)


def read_json(path: Path) -> dict[str, Any]:
    """One JSON object."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {path}: {error}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path} must hold one JSON object")
    return content
