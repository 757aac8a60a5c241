# SPDX-License-Identifier: Apache-2.0
"""Axis conventions and mounts: the same meaning as src/common/extrinsics.h."""

import json
import stat
from pathlib import Path

import numpy as np
import pytest

from checkout import ROOT
from ignis.errors import InputError
from ignis.importers.kitti_raw import lidar_mount
from ignis.mounts import (
    R_OURS_FROM_ENU,
    R_OURS_FROM_FLU,
    Mount,
    read_extrinsics,
    rotation_from_yaw_pitch_roll,
    yaw_pitch_roll_from_rotation,
)
from ignis.poses import Poses, quaternion_from_matrix, read_tum


def test_ros_axes_become_ours() -> None:
    np.testing.assert_array_equal(Mount("forward_left_up").rotation() @ [1.0, 2.0, 3.0], [-2.0, 3.0, -1.0])
    np.testing.assert_array_equal(Mount("right_up_back").rotation() @ [1.0, 2.0, 3.0], [1.0, 2.0, 3.0])


def test_axis_changes_are_rotations_so_that_there_and_back_is_identity() -> None:
    for rotation in (R_OURS_FROM_FLU, R_OURS_FROM_ENU):
        np.testing.assert_array_equal(rotation @ rotation.T, np.eye(3))
        assert np.linalg.det(rotation) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("mount", "expected"),
    [
        (Mount("right_up_back", yaw_deg=90.0), [-1.0, 0.0, 0.0]),  # yaw to the left: forward points left
        (Mount("right_up_back", pitch_deg=90.0), [0.0, 1.0, 0.0]),  # nose up: forward points up
        (Mount("right_up_back", roll_deg=90.0), [0.0, 0.0, -1.0]),  # roll leaves forward alone
    ],
)
def test_angles_turn_the_forward_axis_as_people_expect(mount: Mount, expected: list[float]) -> None:
    np.testing.assert_allclose(mount.rotation() @ [0.0, 0.0, -1.0], expected, atol=1e-12)


def test_roll_lowers_the_right_side() -> None:
    np.testing.assert_allclose(Mount("right_up_back", roll_deg=90.0).rotation() @ [1.0, 0, 0], [0, -1.0, 0], atol=1e-12)


def test_yaw_pitch_roll_round_trip() -> None:
    for angles in np.random.default_rng(3).uniform(-1.5, 1.5, size=(50, 3)):
        np.testing.assert_allclose(yaw_pitch_roll_from_rotation(rotation_from_yaw_pitch_roll(*angles)), angles)


def test_kitti_configuration_holds_the_calibration_of_the_drive(kitti: Path) -> None:
    expected = lidar_mount(kitti / "2011_09_26" / "calib_imu_to_velo.txt")
    configured = read_extrinsics(ROOT / "config" / "kitti.json")
    np.testing.assert_allclose(configured.lidar.rotation(), expected.rotation(), atol=1e-9)
    np.testing.assert_allclose(configured.lidar.translation(), expected.translation(), atol=1e-8)
    np.testing.assert_array_equal(configured.imu.translation(), np.zeros(3))


def test_kitti_mount_takes_inertial_poses_to_lidar_poses(kitti: Path) -> None:
    # The recording's two ground-truth files were made independently of our mount: IMU pose * mount = LiDAR pose.
    lidar, imu = read_tum(kitti / "gt_velodyne_vel.tum"), read_tum(kitti / "gt_imu_vel.tum")
    lidar_at = lidar.at(lidar.utime[lidar.utime > imu.utime[0]])
    mount = lidar_mount(kitti / "2011_09_26" / "calib_imu_to_velo.txt")
    to_flu = R_OURS_FROM_FLU.T
    one = Poses((to_flu @ mount.translation())[None], quaternion_from_matrix(to_flu @ mount.rotation())[None])
    inside = imu.at(lidar_at.utime)
    composed = inside.poses @ one[np.zeros(len(inside), dtype=int)]
    matched = lidar_at.poses.position[: len(inside)]
    np.testing.assert_allclose(composed.position, matched, atol=0.02)  # rounding of both files' interpolation


@pytest.mark.parametrize(
    ("lidar", "said"),
    [
        ({"axes": "up_up_up"}, "axes must be one of"),
        ({"yaw": 3}, "unknown key yaw"),
        ({"yaw_deg": "left"}, "must be numbers"),
        ({"translation_m": [1, 2]}, "three numbers"),
    ],
)
def test_bad_mounts_are_refused(tmp_path: Path, lidar: dict, said: str) -> None:
    path = tmp_path / "c.json"
    path.write_text(json.dumps({"extrinsics": {"lidar": lidar}}))
    with pytest.raises(InputError, match=said):
        read_extrinsics(path)


@pytest.mark.parametrize("name", ["kitti", "ouster", "spinning"])
def test_a_vehicle_without_an_l1_inherits_nothing_of_its_mount(name: str) -> None:
    mounts = json.loads((ROOT / "config" / f"{name}.json").read_text())["extrinsics"]
    for sensor in ("lidar", "imu"):
        assert set(mounts[sensor]) == set(Mount.__dataclass_fields__), f"{name}: {sensor}"


def test_the_spinning_vehicle_is_level_with_its_inertial_unit_at_the_origin() -> None:
    mounts = read_extrinsics(ROOT / "config" / "spinning.json")
    np.testing.assert_array_equal(mounts.imu.rotation(), R_OURS_FROM_FLU)
    np.testing.assert_array_equal(mounts.imu.translation(), np.zeros(3))
    np.testing.assert_array_equal(mounts.lidar.rotation(), R_OURS_FROM_FLU)


def test_changes_reach_the_front_end_that_checks_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "bin" / "lio_frontend"
    program.parent.mkdir()
    config = tmp_path / "c.json"
    config.write_text("{}")
    program.write_text('#!/bin/sh\ntest "$3 $4" = "--set extrinsics.imu.yaw_deg=7" || exit 2\n'
                       'echo \'{"extrinsics": {"lidar": {}, "imu": {"yaw_deg": 7}}}\'\n')  # fmt: skip
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    with pytest.raises(InputError, match=r"run \./ignis build first"):
        read_extrinsics(config, ["extrinsics.imu.yaw_deg=7"])
    monkeypatch.setenv("IGNIS_BUILD", str(tmp_path))
    assert read_extrinsics(config, ["extrinsics.imu.yaw_deg=7"]).imu.yaw_deg == 7


def test_the_front_end_validates_where_it_is_built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "bin" / "lio_frontend"
    program.parent.mkdir()
    config = tmp_path / "c.json"
    config.write_text("{}")
    monkeypatch.setenv("IGNIS_BUILD", str(tmp_path))
    program.write_text('#!/bin/sh\necho \'{"extrinsics": {"lidar": {"yaw_deg": 90}, "imu": {}}}\'\n')
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    assert read_extrinsics(config).lidar.yaw_deg == 90
    program.write_text("#!/bin/sh\necho 'lio_frontend: frontend.x is 7' >&2\nexit 2\n")
    with pytest.raises(InputError, match=r"^frontend\.x is 7$"):
        read_extrinsics(config)
