r"""What a change of the back end does: one row per drive and variant. The keyframes of each drive are recorded once
(keyframe_log), then graph_drive runs the back end alone over them.

    ninja -C build/release benchmarks
    ./ignis shell env PYTHONPATH=python python3 bench/graph_table.py DRIVE_FOLDER... --work FOLDER \
        [--variant NAME:section.key=value,--option=value,...]

A drive's folder holds drive.lcm and ground_truth.tum, as `./ignis evaluate` leaves them under inputs/. Columns: loops
in the graph; those of them that are more than 0.5 m from the truth; recall, the share of keyframes that came back to a
place (4 m, 45 degrees, 10 keyframes apart) and are within 2 keyframes of a loop; root mean square error of the loops'
position; error of the trajectory before and after; NEES of the newest pose per degree of freedom (position and
attitude: an honest covariance gives 1); processor time of the back end in all, per second of drive, and per keyframe.
After several drives, each variant's mean over them (of percentiles too; loops are sums).
"""

import argparse
import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from loop_truth import loop_edges, revisiting

from ignis import trajectory_error
from ignis.evaluation.consistency import nees
from ignis.poses import Poses, Trajectory, read_tum, rotation_matrix

ROOT = Path(__file__).resolve().parent.parent
WRONG_M = 0.5
NEAR = 2  # keyframes between which one loop serves


@dataclass(frozen=True)
class Variant:
    name: str
    arguments: list[str]  # of graph_drive

    @staticmethod
    def parse(text: str) -> "Variant":
        name, _, settings = text.partition(":")
        parts = [part for part in settings.split(",") if part]
        arguments = [[part] if part.startswith("--") else ["--set", part] for part in parts]
        return Variant(name, [argument for pair in arguments for argument in pair])


class Row(NamedTuple):
    loops: int
    wrong: int
    recall: float
    error_mm: float
    ate_eskf: float
    ate_smoothed: float
    nees_position: float
    nees_attitude: float
    cpu_s: float
    ms_per_s: float
    p50_ms: float
    p99_ms: float


def recorded_keyframes(drive: Path, arguments: argparse.Namespace) -> Path:
    log = arguments.work / f"{drive.name}.lcm"
    if not log.exists():
        command = [arguments.bin / "keyframe_log", drive / "drive.lcm", "-o", log, "--config", arguments.config]
        subprocess.run(command, check=True, capture_output=True)
    return log


def run_graph(keyframes: Path, variant: Variant, arguments: argparse.Namespace, out: Path) -> dict[str, float]:
    config = ["--config", arguments.config]
    command = [arguments.bin / "graph_drive", keyframes, *config, "--out", out, *variant.arguments]
    finished = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(finished.stdout)


def loop_errors(results: Path, truth: Poses) -> np.ndarray:
    """Distance of each loop's place from the true one [m]."""
    errors = []
    for target, source, position in loop_edges(results):
        between = truth[np.array([target])].inverse() @ truth[np.array([source])]
        errors.append(float(np.linalg.norm(between.position[0] - position)))
    return np.array(errors)


def recall(results: Path, truth: Poses) -> float:
    came_back = revisiting(truth)
    closed = np.array([source for _, source, _ in loop_edges(results)])
    if not len(came_back):
        return float("nan")
    if not len(closed):
        return 0.0
    return float(np.mean([np.min(np.abs(closed - place)) <= NEAR for place in came_back]))


def newest_poses(results: Path) -> tuple[Trajectory, np.ndarray]:
    """After each keyframe its own pose as published, and its covariance: attitude in body axes, position in map."""
    table = np.genfromtxt(results / "newest.csv", delimiter=",", skip_header=1)
    covariance = np.zeros((len(table), 6, 6))
    row, column = np.triu_indices(6)
    covariance[:, row, column] = table[:, 8:29]
    covariance[:, column, row] = table[:, 8:29]
    poses = Poses(table[:, 1:4], table[:, [7, 4, 5, 6]])
    turn = np.tile(np.eye(6), (len(table), 1, 1))
    turn[:, 3:, 3:] = rotation_matrix(poses.quaternion)
    covariance = turn @ covariance @ turn.transpose(0, 2, 1)
    return Trajectory(table[:, 0].astype(np.int64), poses), covariance


def rms(trajectory: Trajectory, truth: Trajectory) -> float:
    return trajectory_error.errors_of(trajectory_error.paired(trajectory, truth), False)["ate_rmse_m"]


def figures_of(drive: Path, figures: dict[str, float], results: Path) -> Row:
    truth = read_tum(drive / "ground_truth.tum")
    odometry, smoothed = (read_tum(results / f"{name}.tum") for name in ("eskf", "smoothed"))
    at_keyframes = truth.at(smoothed.utime).poses
    errors = loop_errors(results, at_keyframes)
    position, attitude = nees(*newest_poses(results), truth)
    right = errors[errors < WRONG_M]
    return Row(
        len(errors),
        len(errors) - len(right),
        recall(results, at_keyframes),
        1e3 * float(np.sqrt(np.mean(right**2))) if len(right) else float("nan"),
        rms(odometry, truth),
        rms(smoothed, truth),
        position,
        attitude,
        figures["cpu_s"],
        figures["cpu_ms_per_drive_s"],
        figures["p50_ms"],
        figures["p99_ms"],
    )


def mean_row(rows: list[Row]) -> Row:
    table = np.array(rows, dtype=float)
    known = np.sum(~np.isnan(table), axis=0)
    mean = np.where(known > 0, np.nansum(table, axis=0) / np.maximum(known, 1), np.nan)
    return Row(int(table[:, 0].sum()), int(table[:, 1].sum()), *mean[2:].tolist())


def print_row(drive: str, variant: str, row: Row) -> None:
    print(
        f"{drive:28s} {variant:14s} {row.loops:5d} {row.wrong:5d} {row.recall:6.3f} {row.error_mm:8.1f}"
        f" {row.ate_eskf:8.4f} {row.ate_smoothed:8.4f} {row.nees_position:6.2f} {row.nees_attitude:6.2f}"
        f" {row.cpu_s:7.2f} {row.ms_per_s:7.2f} {row.p50_ms:6.1f} {row.p99_ms:7.1f}",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("drives", type=Path, nargs="+")
    parser.add_argument("--config", type=Path, default=ROOT / "config" / "ignis8_tuned.json")
    parser.add_argument("--bin", type=Path, default=ROOT / "build" / "release" / "bin")
    parser.add_argument("--work", type=Path, required=True, help="folder for keyframes (kept) and results")
    parser.add_argument("--variant", type=Variant.parse, action="append", default=None)
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    variants = arguments.variant or [Variant("as configured", [])]
    print(
        f"{'drive':28s} {'variant':14s} loops wrong recall error_mm ATE_eskf  ATE_smo NEES_p NEES_a   cpu_s    ms/s"
        "    p50     p99",
        flush=True,
    )
    rows: dict[str, list[Row]] = {variant.name: [] for variant in variants}
    for drive in arguments.drives:
        keyframes = recorded_keyframes(drive, arguments)
        for variant in variants:
            results = arguments.work / f"{drive.name}-{variant.name.replace(' ', '_')}"
            figures = run_graph(keyframes, variant, arguments, results)
            rows[variant.name].append(figures_of(drive, figures, results))
            print_row(drive.name, variant.name, rows[variant.name][-1])
    if len(arguments.drives) > 1:
        for variant in variants:
            print_row("mean", variant.name, mean_row(rows[variant.name]))


if __name__ == "__main__":
    main()
