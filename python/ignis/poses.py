# SPDX-License-Identifier: Apache-2.0
"""Batches of rigid transforms and stamped trajectories, in numpy.

A pose takes source to target coordinates, p_target = R(q) p_source + position. Quaternions are Hamilton, (w, x, y, z).
Units: metres, int64 microseconds. TUM files are `t x y z qx qy qz qw`, t in seconds.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from ignis.errors import InputError
from ignis.files import write_text

Array = np.ndarray


def quaternion_product(a: Array, b: Array) -> Array:
    """Hamilton product, row by row."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def quaternion_conjugate(q: Array) -> Array:
    """The inverse of a unit quaternion."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def rotation_matrix(q: Array) -> Array:
    """Unit quaternions (..., 4) to matrices (..., 3, 3)."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_matrix(rotation: Array) -> Array:
    """One 3x3 rotation matrix to a quaternion with w >= 0 (largest-component form, stable at half turns)."""
    r = rotation
    squares = np.array(
        [
            1 + r[0, 0] + r[1, 1] + r[2, 2],
            1 + r[0, 0] - r[1, 1] - r[2, 2],
            1 - r[0, 0] + r[1, 1] - r[2, 2],
            1 - r[0, 0] - r[1, 1] + r[2, 2],
        ]
    )
    products = np.array(
        [
            [squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], squares[1], r[1, 0] + r[0, 1], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[1, 0] + r[0, 1], squares[2], r[2, 1] + r[1, 2]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[2, 1] + r[1, 2], squares[3]],
        ]
    )
    q = products[int(np.argmax(squares))]
    q = q / np.linalg.norm(q)
    return q if q[0] >= 0 else -q


def slerp(a: Array, b: Array, ratio: Array) -> Array:
    """Interpolates unit quaternions on the shortest arc, row by row."""
    dot = np.sum(a * b, axis=-1)
    b = np.where(dot[..., None] < 0, -b, b)
    angle = np.arccos(np.clip(np.abs(dot), 0.0, 1.0))
    near = angle < 1e-6
    sine = np.where(near, 1.0, np.sin(angle))
    weight_a = np.where(near, 1.0 - ratio, np.sin((1.0 - ratio) * angle) / sine)
    weight_b = np.where(near, ratio, np.sin(ratio * angle) / sine)
    q = weight_a[..., None] * a + weight_b[..., None] * b
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


@dataclass(frozen=True)
class Poses:
    """N rigid transforms with the same source and target frames."""

    position: Array  # (N, 3) [m]
    quaternion: Array  # (N, 4) w x y z

    def __len__(self) -> int:
        return len(self.position)

    def __getitem__(self, index: Array | slice) -> Self:
        return type(self)(self.position[index], self.quaternion[index])

    def __matmul__(self, other: Self) -> Self:
        """Composition, row by row: T_a_b @ T_b_c = T_a_c."""
        position = self.position + np.einsum("...ij,...j->...i", rotation_matrix(self.quaternion), other.position)
        return type(self)(position, quaternion_product(self.quaternion, other.quaternion))

    def inverse(self) -> Self:
        conjugate = quaternion_conjugate(self.quaternion)
        return type(self)(-np.einsum("...ij,...j->...i", rotation_matrix(conjugate), self.position), conjugate)

    def interpolate(self, other: Self, ratio: Array) -> Self:
        """Slerp of the rotation, linear in the translation; ratio 0 gives self, 1 gives other."""
        position = self.position + ratio[..., None] * (other.position - self.position)
        return type(self)(position, slerp(self.quaternion, other.quaternion, ratio))

    def matrices(self) -> Array:
        """(N, 4, 4) homogeneous matrices."""
        result = np.tile(np.eye(4), (len(self), 1, 1))
        result[:, :3, :3] = rotation_matrix(self.quaternion)
        result[:, :3, 3] = self.position
        return result


def between(poses: Poses, utime: Array, at: Array) -> Poses:
    """Poses at the instants `at`, interpolated between stamped poses; the nearest pose outside of their span."""
    if len(utime) == 1:
        return poses[np.zeros(len(at), dtype=int)]
    after = np.clip(np.searchsorted(utime, at, side="right"), 1, len(utime) - 1)
    before = after - 1
    ratio = np.clip((at - utime[before]) / (utime[after] - utime[before]), 0.0, 1.0)
    return poses[before].interpolate(poses[after], ratio)


@dataclass(frozen=True)
class Trajectory:
    """Stamped poses of the body in one world frame, strictly increasing in time."""

    utime: Array  # (N,) int64 [us]
    poses: Poses

    def __len__(self) -> int:
        return len(self.utime)

    def at(self, utime: Array) -> "Trajectory":
        """Interpolated poses at those instants that lie inside the span of this trajectory."""
        inside = utime[(utime >= self.utime[0]) & (utime <= self.utime[-1])]
        return Trajectory(inside, between(self.poses, self.utime, inside))

    def path_length(self) -> float:
        """[m] along the positions."""
        return float(np.linalg.norm(np.diff(self.poses.position, axis=0), axis=1).sum())


def make_trajectory(rows: list[tuple[int, Array, Array]]) -> Trajectory:
    """Trajectory from (utime, position, quaternion) rows; sorts them and keeps the first of equal stamps."""
    utime = np.array([row[0] for row in rows], dtype=np.int64)
    position = np.array([row[1] for row in rows], dtype=float).reshape(-1, 3)
    quaternion = np.array([row[2] for row in rows], dtype=float).reshape(-1, 4)
    unique, index = np.unique(utime, return_index=True)
    return Trajectory(unique, Poses(position[index], quaternion[index]))


def read_tum(path: Path) -> Trajectory:
    """Reads a TUM file; lines that begin with # are comments."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the trajectory {path}: {error}") from None
    rows = []
    for number, line in enumerate(lines, start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        try:
            values = np.array([float(word) for word in line.replace(",", " ").split()])
        except ValueError:
            values = np.empty(0)
        quaternion = values[[7, 4, 5, 6]] if values.size == 8 else np.zeros(4)
        if not np.all(np.isfinite(values)) or np.linalg.norm(quaternion) < 0.5:
            raise InputError(f"{path}:{number}: expected eight numbers `t x y z qx qy qz qw`")
        rows.append((round(values[0] * 1e6), values[1:4], quaternion / np.linalg.norm(quaternion)))
    if not rows:
        raise InputError(f"the trajectory {path} has no rows")
    return make_trajectory(rows)


def write_tum(path: Path, trajectory: Trajectory) -> None:
    """Writes a TUM file, stamps with six exact decimals."""
    lines = []
    for utime, p, q in zip(trajectory.utime, trajectory.poses.position, trajectory.poses.quaternion, strict=True):
        numbers = " ".join(f"{value:.9f}" for value in (*p, q[1], q[2], q[3], q[0]))
        lines.append(f"{utime // 1_000_000}.{utime % 1_000_000:06d} {numbers}\n")
    write_text(path, "".join(lines))
