# SPDX-License-Identifier: Apache-2.0
"""`./ignis compare`: ESKF-only against smoothed, with ground truth where there is one."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ignis import trajectory_error
from ignis.comparison_plots import plot_errors, plot_trajectories
from ignis.errors import InputError, run_command
from ignis.files import write_text
from ignis.poses import Trajectory, read_tum

NAMES = ("eskf", "smoothed")
LABELS = {"eskf": "ESKF only", "smoothed": "smoothed"}
_GT_AXES = ("auto", "right_up_back", "forward_left_up")


def comparison(folder: Path, gt: Path | None = None, per_scan: bool = False, gt_axes: str = "auto") -> dict[str, Any]:
    """Compares DIR/eskf.tum and DIR/smoothed.tum; writes compare.json, trajectory.png and error.png into DIR."""
    trajectories = _read_trajectories(folder)
    truth, notes = _read_truth(folder, gt, gt_axes)
    result: dict[str, Any] = {
        "folder": str(folder),
        "ground_truth": truth is not None,
        "notes": notes,
        "duration_s": float(np.ptp(trajectories["eskf"].utime)) * 1e-6,
        "trajectories": {},
        "smoothed_minus_eskf": _difference(trajectories),
    }
    aligned = trajectories
    if truth is not None:
        pairs = {name: trajectory_error.paired(trajectories[name], truth) for name in NAMES}
        aligned = {name: trajectory_error.aligned_se3(pair)[0] for name, pair in pairs.items()}
        result["path_length_m"] = pairs["eskf"].truth.path_length()
        for name, pair in pairs.items():
            result["trajectories"][name] = trajectory_error.errors_of(pair, per_scan)
        plot_errors(folder / "error.png", _labelled(aligned), truth)
    else:
        result["path_length_m"] = trajectories["smoothed"].path_length()
    for name, trajectory in trajectories.items():
        ends = trajectory.poses.position[[0, -1]]
        result["trajectories"].setdefault(name, {})["end_to_start_m"] = float(np.linalg.norm(ends[1] - ends[0]))
    plot_trajectories(folder / "trajectory.png", _labelled(aligned), truth)
    write_text(folder / "compare.json", json.dumps(result, indent=2) + "\n")
    return result


def _labelled(trajectories: dict[str, Trajectory]) -> dict[str, Trajectory]:
    return {LABELS[name]: trajectory for name, trajectory in trajectories.items()}


def _read_trajectories(folder: Path) -> dict[str, Trajectory]:
    missing = [f"{name}.tum" for name in NAMES if not (folder / f"{name}.tum").is_file()]
    if missing:
        raise InputError(f"{folder} has no {' and no '.join(missing)}; run ./ignis replay with --out {folder} first")
    return {name: read_tum(folder / f"{name}.tum") for name in NAMES}


def _read_truth(folder: Path, gt: Path | None, axes: str) -> tuple[Trajectory | None, list[str]]:
    path = gt if gt is not None else folder / "ground_truth.tum"
    if gt is None and not path.is_file():
        return None, ["no ground truth: the two trajectories are compared with each other"]
    truth = read_tum(path)
    if axes == "forward_left_up":
        return trajectory_error.in_our_axes(truth), []
    if axes == "auto" and trajectory_error.drives_along_x(truth):
        note = f"{path.name} drives along its +X: read as forward-left-up in a z-up world (--gt-axes overrides)"
        return trajectory_error.in_our_axes(truth), [note]
    return truth, []


def _difference(trajectories: dict[str, Trajectory]) -> dict[str, float]:
    """Distance between the two estimates at common stamps, both in their own frames, which share the start."""
    first, second = trajectories["eskf"], trajectories["smoothed"]
    _, at_first, at_second = np.intersect1d(first.utime, second.utime, return_indices=True)
    if at_first.size == 0:
        raise InputError("eskf.tum and smoothed.tum have no stamp in common; are they from the same run?")
    steps = first.poses.position[at_first] - second.poses.position[at_second]
    distances = np.linalg.norm(steps, axis=1)
    return {
        "rmse_m": float(np.sqrt(np.mean(distances**2))),
        "max_m": float(distances.max()),
        "end_m": float(distances[-1]),
    }


def table(result: dict[str, Any]) -> str:
    """The comparison as text for people."""
    lines = [f"{result['folder']}: {result['path_length_m']:.1f} m in {result['duration_s']:.1f} s"]
    lines += [f"  {note}" for note in result["notes"]]
    rows = _rows_with_truth(result) if result["ground_truth"] else []
    rows.append(("end to start", "m", [result["trajectories"][name]["end_to_start_m"] for name in NAMES]))
    lines.append(f"  {'':34}{'ESKF only':>12}{'smoothed':>12}")
    for title, unit, values in rows:
        cells = "".join(f"{'-' if value is None else format(value, '.3f'):>12}" for value in values)
        lines.append(f"  {title + ' [' + unit + ']':34}{cells}")
    difference = result["smoothed_minus_eskf"]
    lines.append(
        f"  smoothed against ESKF: rms {difference['rmse_m']:.3f} m, largest {difference['max_m']:.3f} m, "
        f"at the end {difference['end_m']:.3f} m"
    )
    return "\n".join(lines)


def _rows_with_truth(result: dict[str, Any]) -> list[tuple[str, str, list[float | None]]]:
    figures = [result["trajectories"][name] for name in NAMES]
    titles = {
        "ate_rmse_m": ("ATE, rms", "m"),
        "ate_max_m": ("ATE, largest", "m"),
        "ate_yaw_rmse_m": ("ATE, yaw and position aligned", "m"),
        "rpe_10m_rmse_m": ("RPE per 10 m, rms", "m"),
        "end_error_m": ("end-point error", "m"),
        "end_error_percent": ("end-point error", "%"),
    }
    rows = [(title, unit, [f[key] for f in figures]) for key, (title, unit) in titles.items()]
    if "per_scan" in figures[0]:
        per_scan = {
            "mean_m": ("per scan, mean", "m"),
            "p95_m": ("per scan, p95", "m"),
            "max_m": ("per scan, max", "m"),
            "mean_deg": ("per scan, rotation, mean", "deg"),
        }
        rows += [(title, unit, [f["per_scan"][key] for f in figures]) for key, (title, unit) in per_scan.items()]
    return rows


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./ignis compare", description=__doc__)
    parser.add_argument("folder", type=Path, help="results folder with eskf.tum and smoothed.tum")
    parser.add_argument("--gt", type=Path, help="ground truth in TUM format; default: ground_truth.tum of the folder")
    parser.add_argument("--gt-axes", choices=_GT_AXES, default="auto", help="axes of the ground truth file")
    parser.add_argument("--per-scan", action="store_true", help="report the relative error from scan to scan as well")
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parsed = _parse(sys.argv[1:] if arguments is None else arguments)

    def body() -> None:
        print(table(comparison(parsed.folder, parsed.gt, parsed.per_scan, parsed.gt_axes)))
        print(f"  wrote compare.json, trajectory.png and, with ground truth, error.png into {parsed.folder}")

    return run_command(body)


if __name__ == "__main__":
    sys.exit(main())
