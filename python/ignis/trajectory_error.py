# SPDX-License-Identifier: Apache-2.0
"""Errors of a trajectory against ground truth, by evo's definitions.

Ground truth is interpolated to the estimate's stamps first: at 10 m/s a nearest stamp 10 ms away would add 0.1 m.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from evo.core import metrics
from evo.core.geometry import GeometryException
from evo.core.trajectory import PoseTrajectory3D

from ignis.errors import InputError
from ignis.mounts import R_OURS_FROM_FLU
from ignis.poses import Poses, Trajectory, quaternion_from_matrix, quaternion_product, rotation_matrix

RPE_DELTAS_M = (1, 10)
_FORWARD_OURS = np.array([0.0, 0.0, -1.0])
_FORWARD_FLU = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class Pair:
    """An estimate and its ground truth at the same stamps."""

    estimate: Trajectory
    truth: Trajectory


def paired(estimate: Trajectory, truth: Trajectory) -> Pair:
    """Interpolates the truth; estimates outside of its span are left out."""
    at = truth.at(estimate.utime)
    if len(at) < 3:
        raise InputError(
            f"only {len(at)} poses lie within the ground truth's span "
            f"({truth.utime[0] * 1e-6:.3f} to {truth.utime[-1] * 1e-6:.3f} s); are both from the same drive?"
        )
    chosen = np.isin(estimate.utime, at.utime)
    return Pair(Trajectory(estimate.utime[chosen], estimate.poses[chosen]), at)


def in_our_axes(trajectory: Trajectory) -> Trajectory:
    """A trajectory with body axes forward-left-up in a z-up world, turned into ours."""
    turn = quaternion_from_matrix(R_OURS_FROM_FLU)
    back = quaternion_from_matrix(R_OURS_FROM_FLU.T)
    quaternion = quaternion_product(quaternion_product(turn, trajectory.poses.quaternion), back)
    return Trajectory(trajectory.utime, Poses(trajectory.poses.position @ R_OURS_FROM_FLU.T, quaternion))


def drives_along_x(trajectory: Trajectory) -> bool:
    """True when the body's way leads along its own +X rather than -Z: a file in forward-left-up axes."""
    steps = np.diff(trajectory.poses.position, axis=0)
    steps_body = np.einsum("nji,nj->ni", rotation_matrix(trajectory.poses.quaternion[:-1]), steps)
    total = steps_body.sum(axis=0)
    return bool(total @ _FORWARD_FLU > np.linalg.norm(total) * 0.8 and total @ _FORWARD_OURS < total @ _FORWARD_FLU)


def _as_evo(trajectory: Trajectory) -> PoseTrajectory3D:
    return PoseTrajectory3D(
        positions_xyz=trajectory.poses.position.copy(),
        orientations_quat_wxyz=trajectory.poses.quaternion.copy(),
        timestamps=trajectory.utime * 1e-6,
    )


def aligned_se3(pair: Pair) -> tuple[Trajectory, bool]:
    """The estimate under the best rigid transform (Umeyama, no scale). A perfectly straight or standing trajectory
    leaves rotations free; then yaw and position alone are aligned, and the second value is False."""
    estimate = _as_evo(pair.estimate)
    try:
        rotation, translation, _ = estimate.align(_as_evo(pair.truth))
    except GeometryException:
        return aligned_yaw(pair), False
    return _transformed(pair.estimate, rotation, translation), True


def aligned_yaw(pair: Pair) -> Trajectory:
    """The estimate under the best turn about up (+Y) and shift: gravity is observable, so roll and pitch count."""
    p, q = pair.estimate.poses.position, pair.truth.poses.position
    centred_p, centred_q = p - p.mean(axis=0), q - q.mean(axis=0)
    # Maximises sum q . Ry(yaw) p: with x' = c x + s z, z' = -s x + c z.
    sine = np.sum(centred_q[:, 0] * centred_p[:, 2] - centred_q[:, 2] * centred_p[:, 0])
    cosine = np.sum(centred_q[:, 0] * centred_p[:, 0] + centred_q[:, 2] * centred_p[:, 2])
    yaw = np.arctan2(sine, cosine)
    rotation = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    return _transformed(pair.estimate, rotation, q.mean(axis=0) - rotation @ p.mean(axis=0))


def aligned_at_start(pair: Pair) -> Trajectory:
    """The estimate with its first pose laid on the true one."""
    first = pair.truth.poses[:1] @ pair.estimate.poses[:1].inverse()
    return _transformed(pair.estimate, rotation_matrix(first.quaternion[0]), first.position[0])


def _transformed(trajectory: Trajectory, rotation: np.ndarray, translation: np.ndarray) -> Trajectory:
    shift = Poses(translation[None], quaternion_from_matrix(rotation)[None])
    count = np.zeros(len(trajectory), dtype=int)
    return Trajectory(trajectory.utime, shift[count] @ trajectory.poses)


def position_errors(estimate: Trajectory, truth: Trajectory) -> np.ndarray:
    """evo's absolute pose error, translation part [m], of trajectories that are already aligned."""
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data((_as_evo(truth), _as_evo(estimate)))
    return np.asarray(ape.error)


def relative_errors(pair: Pair, relation: metrics.PoseRelation, delta: float, unit: metrics.Unit) -> np.ndarray:
    """evo's relative pose error over all pairs; empty when the drive is shorter than delta."""
    rpe = metrics.RPE(relation, delta=delta, delta_unit=unit, all_pairs=True)
    try:
        rpe.process_data((_as_evo(pair.truth), _as_evo(pair.estimate)))
    except metrics.MetricsException:
        return np.empty(0)
    except metrics.filters.FilterException:
        return np.empty(0)
    return np.asarray(rpe.error)


def tilt_errors(pair: Pair) -> np.ndarray:
    """[deg] angle between estimated and true direction of up, seen from the body. Both worlds have +Y up, so no
    alignment is needed and none could hide it."""
    up_estimate = rotation_matrix(pair.estimate.poses.quaternion)[:, 1, :]
    up_truth = rotation_matrix(pair.truth.poses.quaternion)[:, 1, :]
    across = np.linalg.norm(np.cross(up_estimate, up_truth), axis=1)
    return np.asarray(np.degrees(np.arctan2(across, np.sum(up_estimate * up_truth, axis=1))))


def yaw_errors(pair: Pair) -> np.ndarray:
    """[deg] estimated minus true heading after aligning yaw and position, positive to the left."""
    difference = _heading(aligned_yaw(pair)) - _heading(pair.truth)
    return np.asarray(np.degrees(np.arctan2(np.sin(difference), np.cos(difference))))


def _heading(trajectory: Trajectory) -> np.ndarray:
    forward = rotation_matrix(trajectory.poses.quaternion) @ _FORWARD_OURS
    return np.asarray(np.arctan2(-forward[:, 0], -forward[:, 2]))


def errors_of(pair: Pair, per_scan: bool) -> dict[str, Any]:
    """All figures of one estimate, in metres and degrees."""
    full, is_full = aligned_se3(pair)
    absolute = position_errors(full, pair.truth)
    yaw_only = position_errors(aligned_yaw(pair), pair.truth)
    end = position_errors(aligned_at_start(pair), pair.truth)[-1]
    length = pair.truth.path_length()
    figures: dict[str, Any] = {
        "poses": len(pair.truth),
        "alignment": "se3" if is_full else "yaw and position (the drive is too straight for more)",
        "ate_rmse_m": _rms(absolute),
        "ate_max_m": float(absolute.max()),
        "ate_yaw_rmse_m": _rms(yaw_only),
        "end_error_m": float(end),
        "end_error_percent": 100.0 * float(end) / length if length > 0.0 else None,
    }
    for delta in RPE_DELTAS_M:
        rpe = relative_errors(pair, metrics.PoseRelation.translation_part, delta, metrics.Unit.meters)
        figures |= {f"rpe_{delta}m_rmse_m": _rms(rpe) if rpe.size else None, f"rpe_{delta}m_pairs": int(rpe.size)}
    tilt, yaw = tilt_errors(pair), yaw_errors(pair)
    figures |= {"tilt_rmse_deg": _rms(tilt), "tilt_max_deg": float(tilt.max())}
    figures |= {"yaw_rmse_deg": _rms(yaw), "yaw_max_deg": float(np.abs(yaw).max())}
    if per_scan:
        figures["per_scan"] = _per_scan(pair)
    return figures


def _per_scan(pair: Pair) -> dict[str, float]:
    translation = relative_errors(pair, metrics.PoseRelation.translation_part, 1, metrics.Unit.frames)
    rotation = relative_errors(pair, metrics.PoseRelation.rotation_angle_deg, 1, metrics.Unit.frames)
    return {
        "mean_m": float(translation.mean()),
        "p95_m": float(np.percentile(translation, 95)),
        "max_m": float(translation.max()),
        "mean_deg": float(rotation.mean()),
    }


def _rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))
