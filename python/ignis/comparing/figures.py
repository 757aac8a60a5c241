# SPDX-License-Identifier: Apache-2.0
"""Figures of one drive: each estimate against the truth, and the two of ours against each other."""

from typing import Any

import numpy as np

from ignis import trajectory_error
from ignis.comparing.estimates import Estimates
from ignis.errors import InputError
from ignis.evaluation.consistency import band, nees_of
from ignis.poses import Trajectory
from ignis.run_folder import read_json

ALIGNMENT = {
    "ate": "SE(3) alignment of the whole trajectory, no scale (evo, Umeyama)",
    "ate_yaw": "yaw and position aligned, gravity kept",
    "rpe": "no alignment: relative poses over 1 m and 10 m of the way, all pairs (evo)",
    "end": "first poses laid on one another",
    "tilt": "no alignment: angle between the estimated and the true direction of up",
    "yaw": "yaw and position aligned; difference of heading",
    "nees": "level frame at the first pose; per degree of freedom, 1 is consistent",
}


def figures_of(estimates: Estimates, per_scan: bool) -> dict[str, Any]:
    """Everything that compare.json says about one drive."""
    ours = estimates.trajectories
    result: dict[str, Any] = {
        "folder": str(estimates.folder),
        "ground_truth": estimates.truth is not None,
        "notes": estimates.notes,
        "duration_s": float(np.ptp(ours["eskf"].utime)) * 1e-6,
        "path_length_m": ours["smoothed"].path_length(),
        "loops_kept": _loops_kept(estimates),
        "trajectories": {},
        "smoothed_minus_eskf": _difference(ours["eskf"], ours["smoothed"]),
    }
    for name, trajectory in ours.items():
        ends = trajectory.poses.position[[0, -1]]
        figures: dict[str, Any] = {"end_to_start_m": float(np.linalg.norm(ends[1] - ends[0]))}
        if estimates.truth is not None:
            pair = trajectory_error.paired(trajectory, estimates.truth)
            figures |= trajectory_error.errors_of(pair, per_scan)
            if name == "eskf":
                result["path_length_m"] = pair.truth.path_length()
                figures |= _consistency(estimates)
        elif name not in ("eskf", "smoothed"):
            figures |= _against_smoothed(trajectory, ours["smoothed"])
        result["trajectories"][name] = figures
    return result


def aligned(estimates: Estimates) -> dict[str, Trajectory]:
    """For drawing: laid on the truth, or as they are without one."""
    if estimates.truth is None:
        return dict(estimates.trajectories)
    pairs = {name: trajectory_error.paired(t, estimates.truth) for name, t in estimates.trajectories.items()}
    return {name: trajectory_error.aligned_se3(pair)[0] for name, pair in pairs.items()}


def _consistency(estimates: Estimates) -> dict[str, Any]:
    """NEES of the filter, where the run left its covariances."""
    if not (estimates.folder / "eskf_states.csv").is_file() or estimates.truth is None:
        return {}
    position, attitude = nees_of(estimates.folder, estimates.truth)
    return {"nees_position": position, "nees_attitude": attitude, "nees_band": list(band(3))}


def _loops_kept(estimates: Estimates) -> int | None:
    report = estimates.folder / "report.json"
    kept = read_json(report).get("loops_kept") if report.is_file() else None
    return kept if isinstance(kept, int) else None


def _difference(first: Trajectory, second: Trajectory) -> dict[str, float]:
    """Distance between the two estimates at common stamps, both in their own frames, which share the start."""
    _, at_first, at_second = np.intersect1d(first.utime, second.utime, return_indices=True)
    if at_first.size == 0:
        raise InputError("eskf.tum and smoothed.tum have no stamp in common; are they from the same run?")
    steps = first.poses.position[at_first] - second.poses.position[at_second]
    return _distances(steps)


def _against_smoothed(other: Trajectory, smoothed: Trajectory) -> dict[str, Any]:
    pair = trajectory_error.paired(other, smoothed)
    laid, full = trajectory_error.aligned_se3(pair)
    steps = laid.poses.position - pair.truth.poses.position
    return {"distance_from_smoothed": _distances(steps), "alignment": "se3" if full else "yaw and position"}


def _distances(steps: np.ndarray) -> dict[str, float]:
    distances = np.linalg.norm(steps, axis=1)
    return {
        "rmse_m": float(np.sqrt(np.mean(distances**2))),
        "max_m": float(distances.max()),
        "end_m": float(distances[-1]),
    }
