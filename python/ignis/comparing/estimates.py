# SPDX-License-Identifier: Apache-2.0
"""The trajectories that are compared: of a run, of others, and the ground truth, all in our axes."""

from dataclasses import dataclass
from pathlib import Path

from ignis import trajectory_error
from ignis.errors import InputError
from ignis.poses import Trajectory, read_tum

NAMES = ("eskf", "smoothed")
LABELS = {"eskf": "ESKF only", "smoothed": "smoothed"}
AXES = ("auto", "right_up_back", "forward_left_up")


@dataclass(frozen=True)
class Estimates:
    """One drive: what was estimated, and what is true."""

    folder: Path
    trajectories: dict[str, Trajectory]  # eskf, smoothed, then others under their file's name
    truth: Trajectory | None
    notes: list[str]

    @property
    def name(self) -> str:
        return self.folder.resolve().name


def read_estimates(folder: Path, gt: Path | None, others: list[Path], axes: str) -> Estimates:
    """Reads a results folder; ground truth is the folder's own unless another is given."""
    missing = [f"{name}.tum" for name in NAMES if not (folder / f"{name}.tum").is_file()]
    if missing:
        raise InputError(f"{folder} has no {' and no '.join(missing)}; run ./ignis replay with --out {folder} first")
    notes: list[str] = []
    trajectories = {name: read_tum(folder / f"{name}.tum") for name in NAMES}
    for path in others:
        label = path.stem
        while label in trajectories:
            label += "'"
        trajectories[label] = read_in_our_axes(path, axes, notes)
    truth_file = gt if gt is not None else folder / "ground_truth.tum"
    if gt is None and not truth_file.is_file():
        notes.append("no ground truth: the trajectories are compared with each other")
        return Estimates(folder, trajectories, None, notes)
    return Estimates(folder, trajectories, read_in_our_axes(truth_file, axes, notes), notes)


def label_of(name: str) -> str:
    """What people read."""
    return LABELS.get(name, name)


def read_in_our_axes(path: Path, axes: str, notes: list[str]) -> Trajectory:
    """A trajectory from a file in any of AXES; `notes` gets a sentence where the axes were found out."""
    trajectory = read_tum(path)
    if axes == "forward_left_up":
        return trajectory_error.in_our_axes(trajectory)
    if axes == "auto" and trajectory_error.drives_along_x(trajectory):
        notes.append(f"{path.name} drives along its +X: read as forward-left-up in a z-up world (--gt-axes overrides)")
        return trajectory_error.in_our_axes(trajectory)
    return trajectory
