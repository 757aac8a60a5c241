r"""What a change of the back end does: one row per drive and variant. The keyframes of each drive are recorded once
(keyframe_log), then graph_drive runs the back end alone over them.

    ninja -C build/release benchmarks
    ./ignis shell env PYTHONPATH=python python3 bench/graph_table.py DRIVE_FOLDER... --work FOLDER \
        [--variant NAME:section.key=value,...]

A drive's folder holds drive.lcm and ground_truth.tum, as `./ignis evaluate` leaves them under inputs/. Columns: loops
in the graph; those of them that are more than 0.5 m from the truth; recall, the share of keyframes that came back to a
place (4 m, 45 degrees, 10 keyframes apart) and are within 2 keyframes of a loop; root mean square error of the loops'
position; error of the trajectory before and after; NEES of the newest pose per degree of freedom (position and
attitude: an honest covariance gives 1); processor time of the back end in all, per second of drive, and per keyframe.
"""

import argparse
import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from loop_truth import loop_edges, revisiting

from ignis import trajectory_error
from ignis.evaluation.consistency import nees
from ignis.poses import Poses, Trajectory, read_tum, rotation_matrix

ROOT = Path(__file__).resolve().parent.parent
BIN = ROOT / "build" / "release" / "bin"
WRONG_M = 0.5
NEAR = 2  # keyframes between which one loop serves


@dataclass(frozen=True)
class Variant:
    name: str
    settings: list[str]

    @staticmethod
    def parse(text: str) -> "Variant":
        name, _, settings = text.partition(":")
        return Variant(name, [part for part in settings.split(",") if part])


def recorded_keyframes(drive: Path, work: Path, config: Path) -> Path:
    log = work / f"{drive.name}.lcm"
    if not log.exists():
        command = [BIN / "keyframe_log", drive / "drive.lcm", "-o", log, "--config", config]
        subprocess.run(command, check=True, capture_output=True)
    return log


def run_graph(keyframes: Path, variant: Variant, config: Path, out: Path) -> dict[str, float]:
    command = [BIN / "graph_drive", keyframes, "--config", config, "--out", out]
    for setting in variant.settings:
        command += ["--set", setting]
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


def row(drive: Path, variant: Variant, figures: dict[str, float], results: Path) -> str:
    truth = read_tum(drive / "ground_truth.tum")
    odometry, smoothed = (read_tum(results / f"{name}.tum") for name in ("eskf", "smoothed"))
    at_keyframes = truth.at(smoothed.utime).poses
    errors = loop_errors(results, at_keyframes)
    position, attitude = nees(*newest_poses(results), truth)
    error_mm = 1e3 * float(np.sqrt(np.mean(errors[errors < WRONG_M] ** 2))) if np.any(errors < WRONG_M) else 0.0
    return (
        f"{drive.name:28s} {variant.name:14s} {len(errors):5d} {int(np.sum(errors > WRONG_M)):5d}"
        f" {recall(results, at_keyframes):6.3f} {error_mm:8.1f} {rms(odometry, truth):8.4f} {rms(smoothed, truth):8.4f}"
        f" {position:6.2f} {attitude:6.2f} {figures['cpu_s']:7.2f} {figures['cpu_ms_per_drive_s']:7.2f}"
        f" {figures['p50_ms']:6.1f} {figures['p99_ms']:7.1f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("drives", type=Path, nargs="+")
    parser.add_argument("--config", type=Path, default=ROOT / "config" / "ignis8_tuned.json")
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
    for drive in arguments.drives:
        keyframes = recorded_keyframes(drive, arguments.work, arguments.config)
        for variant in variants:
            results = arguments.work / f"{drive.name}-{variant.name.replace(' ', '_')}"
            figures = run_graph(keyframes, variant, arguments.config, results)
            print(row(drive, variant, figures, results), flush=True)


if __name__ == "__main__":
    main()
