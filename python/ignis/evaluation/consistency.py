# SPDX-License-Identifier: Apache-2.0
"""Normalised squares of errors (NEES) and innovations (NIS): are they what the covariances of a drive announce?

Y. Bar-Shalom, X. Li, T. Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.4.
"""

import csv
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from ignis.poses import Poses, Trajectory, quaternion_from_matrix, read_tum, rotation_matrix
from ignis.trajectory_error import aligned_at_start, paired, position_errors

BAND = 0.95
SIGMAS = 3.0  # within which an honest pose nearly always lies, in each coordinate
SILENT_M = 0.5  # a pose that is farther off and reported as OK
_OK = 0
_STANDING_M_S, _STANDING_RAD_S = 0.1, 0.02


def band(degrees: int) -> tuple[float, float]:
    """Where the mean per degree of freedom lies with probability BAND. Scans of one drive share their errors, so a
    drive counts as one draw."""
    tail = 0.5 * (1.0 - BAND)
    return float(chi2.ppf(tail, degrees) / degrees), float(chi2.ppf(1.0 - tail, degrees) / degrees)


def read_pose_covariances(file: Path) -> np.ndarray:
    """n x 6 x 6 from eskf_states.csv: attitude in body axes, then position in odom axes."""
    with file.open(newline="") as stream:
        rows = csv.reader(stream)
        first = next(rows).index("p00")
        upper = np.array([[float(value) for value in row[first : first + 21]] for row in rows])
    covariance = np.zeros((len(upper), 6, 6))
    row, column = np.triu_indices(6)
    covariance[:, row, column] = upper
    covariance[:, column, row] = upper
    return covariance


def silent_percent(folder: Path, truth: Trajectory) -> float:
    """[%] Scans whose pose was reported as OK while it was SILENT_M off, the first poses laid on each other."""
    estimate = read_tum(folder / "eskf.tum")
    with (folder / "eskf_states.csv").open(newline="") as stream:
        trust = np.array([int(row["trust"]) for row in csv.DictReader(stream)])
    pair = paired(estimate, truth)
    trust = trust[np.isin(estimate.utime, pair.estimate.utime)]
    off = position_errors(aligned_at_start(pair), pair.truth) > SILENT_M
    return float(100.0 * np.mean(off & (trust == _OK)))


def nis_of(folder: Path) -> float | None:
    """Normalised innovation squared of a replay's scans, per direction that they observe; none when none was applied.
    The filter is told `residual_inflation` times the variance that single residuals have, so 1 is its upper end."""
    with (folder / "scan_stats.csv").open(newline="") as stream:
        applied = [row for row in csv.DictReader(stream) if row["applied"] == "1"]
    directions = sum(float(row["nis_directions"]) for row in applied)
    return sum(float(row["nis"]) for row in applied) / directions if directions else None


def nees_of(folder: Path, truth: Trajectory) -> tuple[float, float]:
    """Of the filter's poses, mean over the scans of a replay's folder."""
    return nees(read_tum(folder / "eskf.tum"), read_pose_covariances(folder / "eskf_states.csv"), truth)


def nees(estimate: Trajectory, covariance: np.ndarray, truth: Trajectory) -> tuple[float, float]:
    """Of position and attitude, per degree of freedom; covariances (n, 6, 6), attitude in body axes, then position in
    those of the trajectory."""
    errors, covariance = _pose_errors(estimate, covariance, truth)
    return _mean_square(errors[:, 3:], covariance[:, 3:, 3:]), _mean_square(errors[:, :3], covariance[:, :3, :3])


def inside_percent(folder: Path, truth: Trajectory) -> float:
    """[%] Scans of a replay's folder whose pose is off by less than SIGMAS sigma in each of its six coordinates."""
    covariance = read_pose_covariances(folder / "eskf_states.csv")
    errors, covariance = _pose_errors(read_tum(folder / "eskf.tum"), covariance, truth)
    sigmas = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return float(100.0 * np.mean(np.all(np.abs(errors) < SIGMAS * sigmas, axis=1)))


def _pose_errors(estimate: Trajectory, covariance: np.ndarray, truth: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """(n, 6), attitude in body axes, then position, where there is truth, and the covariances there. The frame of
    reference is level and has its origin and heading at the first pose, so the tilt of the start is an error."""
    pair = paired(estimate, truth)
    covariance = covariance[np.isin(estimate.utime, pair.estimate.utime)]
    true, estimated = _from(_level_start(pair.truth.poses[:1]), pair.truth.poses), pair.estimate.poses
    if _begins_in_motion(pair.truth):
        start = _level_start(estimated[:1])
        estimated = _from(start, estimated)
        turn_of_axes = np.eye(6)
        turn_of_axes[3:, 3:] = rotation_matrix(start.quaternion)[0]
        covariance = turn_of_axes.T @ covariance @ turn_of_axes
    shift = true.position - estimated.position
    R_estimate = rotation_matrix(estimated.quaternion)
    R_error = np.einsum("nji,njk->nik", R_estimate, rotation_matrix(true.quaternion))
    # The errors are fractions of a degree or the pose is lost anyhow: the skew part is the rotation vector.
    turn = 0.5 * np.stack(
        [R_error[:, 2, 1] - R_error[:, 1, 2], R_error[:, 0, 2] - R_error[:, 2, 0], R_error[:, 1, 0] - R_error[:, 0, 1]],
        axis=1,
    )
    return np.hstack([turn, shift]), covariance


def _from(frame: Poses, poses: Poses) -> Poses:
    return frame.inverse()[np.zeros(len(poses), dtype=int)] @ poses


def _begins_in_motion(truth: Trajectory) -> bool:
    """Then it has left the origin of frame odom by the first scan. One that stands is off by what that scan erred."""
    seconds = 1e-6 * float(truth.utime[1] - truth.utime[0])
    step = (truth.poses[:1].inverse() @ truth.poses[1:2]).position[0]
    turn = 2.0 * (truth.poses[:1].inverse() @ truth.poses[1:2]).quaternion[0, 1:]
    return bool(np.linalg.norm(step) > _STANDING_M_S * seconds or np.linalg.norm(turn) > _STANDING_RAD_S * seconds)


def _level_start(first: Poses) -> Poses:
    forward = rotation_matrix(first.quaternion)[0] @ np.array([0.0, 0.0, -1.0])
    yaw = np.arctan2(-forward[0], -forward[2])
    level = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    return Poses(first.position, quaternion_from_matrix(level)[None])


def _mean_square(errors: np.ndarray, covariances: np.ndarray) -> float:
    weighted = np.linalg.solve(covariances, errors[:, :, None])[:, :, 0]
    return float(np.mean(np.einsum("ni,ni->n", errors, weighted)) / errors.shape[1])
