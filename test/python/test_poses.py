# SPDX-License-Identifier: Apache-2.0
"""Pose algebra against matrices, trajectories against hand-made ones."""

from pathlib import Path

import numpy as np
import pytest

from ignis.errors import InputError
from ignis.poses import (
    Poses,
    between,
    make_trajectory,
    quaternion_from_matrix,
    quaternion_product,
    read_tum,
    rotation_matrix,
    slerp,
    write_tum,
)


def random_poses(count: int, seed: int = 1) -> Poses:
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(count, 4))
    return Poses(rng.normal(size=(count, 3)), q / np.linalg.norm(q, axis=1, keepdims=True))


def test_composition_and_inverse_agree_with_matrices() -> None:
    a, b = random_poses(50, 1), random_poses(50, 2)
    np.testing.assert_allclose((a @ b).matrices(), a.matrices() @ b.matrices(), atol=1e-12)
    np.testing.assert_allclose(a.inverse().matrices(), np.linalg.inv(a.matrices()), atol=1e-12)


def test_quaternion_from_matrix_inverts_rotation_matrix_also_at_half_turns() -> None:
    quaternions = [*random_poses(100).quaternion, *np.eye(4)]
    for q in quaternions:
        matrix = rotation_matrix(q)
        np.testing.assert_allclose(rotation_matrix(quaternion_from_matrix(matrix)), matrix, atol=1e-12)


def test_slerp_turns_at_constant_rate_on_the_shortest_arc() -> None:
    start = np.array([1.0, 0.0, 0.0, 0.0])
    end = -np.array([np.cos(0.5), 0.0, np.sin(0.5), 0.0])  # one radian about Y, in the other sign
    ratios = np.array([0.0, 0.25, 0.5, 1.0])
    turned = slerp(np.tile(start, (4, 1)), np.tile(end, (4, 1)), ratios)
    np.testing.assert_allclose(2 * np.arctan2(turned[:, 2], turned[:, 0]), ratios, atol=1e-12)


def test_quaternion_product_follows_hamilton() -> None:
    i, j, k = np.eye(4)[1:]
    np.testing.assert_allclose(quaternion_product(i, j), k)
    np.testing.assert_allclose(quaternion_product(j, i), -k)


def test_between_interpolates_inside_and_clamps_outside() -> None:
    poses = Poses(np.array([[0.0, 0, 0], [2.0, 0, 0]]), np.tile([1.0, 0, 0, 0], (2, 1)))
    found = between(poses, np.array([0, 100]), np.array([-50, 0, 25, 100, 500]))
    np.testing.assert_allclose(found.position[:, 0], [0.0, 0.0, 0.5, 2.0, 2.0])


def test_tum_files_keep_microseconds_and_poses(tmp_path: Path) -> None:
    poses = random_poses(3)
    utimes = [1317042651175862, 1317042651275615, 1317042651385630]
    rows = list(zip(utimes, poses.position, poses.quaternion, strict=True))
    write_tum(tmp_path / "a.tum", make_trajectory(rows))
    back = read_tum(tmp_path / "a.tum")
    assert back.utime.tolist() == utimes
    np.testing.assert_allclose(back.poses.position, poses.position, atol=1e-9)
    np.testing.assert_allclose(back.poses.quaternion, poses.quaternion, atol=1e-8)


@pytest.mark.parametrize(
    "text", ["", "# only a comment\n", "1 2 3\n", "1 0 0 0 0 0 0 0\n", "1 0 0 0 0 0 0 nan\n", "a\n"]
)
def test_bad_tum_files_are_refused_by_name(tmp_path: Path, text: str) -> None:
    (tmp_path / "bad.tum").write_text(text)
    with pytest.raises(InputError, match=r"bad\.tum"):
        read_tum(tmp_path / "bad.tum")
