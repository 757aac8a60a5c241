# SPDX-License-Identifier: Apache-2.0
"""Clouds out of files and logs, and pictures that show them where they are."""

from pathlib import Path

import numpy as np
import pytest
from ignis_lcm.ignis import cloud_t
from matplotlib import image

from ignis.clouds import read_ply, registered_scans
from ignis.errors import InputError
from ignis.logs import LogWriter
from ignis.pictures import main, write_pictures

HEADER = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}end_header\n"
POINTS = np.array([[1.0, 2.0, 3.0], [-4.0, 0.5, -6.0]])


def write_ply(path: Path, points: np.ndarray, order: str = "<") -> None:
    name = "binary_little_endian" if order == "<" else "binary_big_endian"
    rows = np.hstack([points, np.arange(len(points))[:, None]]).astype(order + "f4")
    header = HEADER.format(name, len(points), "property float intensity\n")
    path.write_bytes(header.encode() + rows.tobytes())


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_ply(tmp_path: Path, order: str) -> None:
    write_ply(tmp_path / "a.ply", POINTS, order)
    points, intensity = read_ply(tmp_path / "a.ply")
    np.testing.assert_array_equal(points, POINTS)
    assert intensity.tolist() == [0.0, 1.0]


def test_ascii_ply_without_intensity(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_text(HEADER.format("ascii", 2, "") + "1 2 3\n-4 0.5 -6\n")
    points, intensity = read_ply(tmp_path / "a.ply")
    np.testing.assert_array_equal(points, POINTS)
    assert intensity.tolist() == [0.0, 0.0]


def test_cut_and_foreign_files_are_refused(tmp_path: Path) -> None:
    write_ply(tmp_path / "a.ply", POINTS)
    (tmp_path / "a.ply").write_bytes((tmp_path / "a.ply").read_bytes()[:-1])
    with pytest.raises(InputError, match="ends before its 2 points"):
        read_ply(tmp_path / "a.ply")
    (tmp_path / "a.ply").write_bytes(b"solid")
    with pytest.raises(InputError, match="not a PLY"):
        read_ply(tmp_path / "a.ply")


def test_scans_of_a_log_are_placed_by_their_pose(tmp_path: Path) -> None:
    half = np.sqrt(0.5)
    with LogWriter(tmp_path / "run.lcmlog") as writer:
        for number in range(2):
            message = cloud_t()
            message.part, message.part_count, message.num_points = number, 2, 1
            message.position, message.quaternion = [10.0, 0.0, 0.0], [half, 0.0, half, 0.0]  # a quarter turn left
            message.x, message.y, message.z, message.intensity = [0.0], [1.0], [-2.0 - number], [7.0]
            writer.write(0, "LIO_CLOUD", message.encode())
    points, intensity = registered_scans(tmp_path / "run.lcmlog")
    np.testing.assert_allclose(points, [[8.0, 1.0, 0.0], [7.0, 1.0, 0.0]], atol=1e-6)
    assert intensity.tolist() == [7.0, 7.0]


def test_the_view_from_above_shows_the_way_ahead_to_the_right_and_the_left_side_above(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    way = np.stack([np.zeros(40), np.zeros(40), -np.arange(40.0)], axis=1)
    ground = np.stack([rng.uniform(-10, 10, 5000), np.full(5000, -1.0), rng.uniform(-40, 0, 5000)], axis=1)
    # A wall on the left half-way, high enough to be coloured apart from the ground.
    wall = np.stack([np.full(3000, -8.0), rng.uniform(0.0, 1.8, 3000), rng.uniform(-22, -18, 3000)], axis=1)
    write_ply(tmp_path / "map.ply", np.vstack([ground, wall]))
    rows = [f"{i} {p[0]} {p[1]} {p[2]} 0 0 0 1" for i, p in enumerate(way)]
    (tmp_path / "smoothed.tum").write_text("\n".join(rows))
    names = [path.name for path in write_pictures(tmp_path)]
    assert names == ["map_top.png", "map_oblique.png", "map_side.png"]
    picture = image.imread(tmp_path / "map_top.png")[:, :, :3]
    warm = np.argwhere(picture[:, :, 0] - picture[:, :, 2] > 0.3)
    row, column = warm.mean(axis=0) / picture.shape[:2]
    assert column == pytest.approx(0.5, abs=0.05)
    assert row < 0.3


def test_a_folder_without_a_map_is_refused(tmp_path: Path, capsys) -> None:
    assert main([str(tmp_path)]) == 2
    assert "neither map.ply nor run.lcmlog" in capsys.readouterr().err
