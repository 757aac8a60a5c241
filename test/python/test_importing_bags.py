# SPDX-License-Identifier: Apache-2.0
"""Bags of every kind come out as the same log."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import bags
from ignis.importers.point_clouds import from_livox, from_point_cloud2
from ignis.importing import main
from ignis.logs import joined_arrays, read_log

START_US = bags.START_NS // 1000
BOTH = {"/points": bags.CLOUD, "/imu": bags.IMU}


@pytest.mark.parametrize("form", bags.FORMATS)
def test_clouds_and_inertial_data_arrive_in_the_body_frame(form: str, tmp_path: Path, level_config: Path) -> None:
    bag = bags.write_bag(tmp_path, form, BOTH)
    output = tmp_path / "x.lcmlog"
    assert main([str(bag), "-o", str(output), "--config", str(level_config)]) == 0
    events = list(read_log(output))
    scans = [e.message for e in events if e.channel == "L1_SCAN"]
    samples = [e.message for e in events if e.channel == "L1_IMU"]
    assert [e.utime for e in events] == sorted(e.utime for e in events)
    assert [s.utime for s in scans] == [START_US + i * 100_000 for i in range(5)]
    assert [s.duration_us for s in scans] == [90_000] * 5
    arrays = joined_arrays([scans[0]])
    expected = np.stack([-bags.POINTS[:, 1], bags.POINTS[:, 2], -bags.POINTS[:, 0]], axis=1)
    np.testing.assert_allclose(np.stack([arrays[n] for n in "xyz"], axis=1), expected)
    assert arrays["dt_us"].tolist() == [0, 30_000, 60_000, 90_000]
    assert arrays["intensity"].tolist() == [10, 20, 30, 40]
    assert [s.utime for s in samples] == [START_US + i * 10_000 for i in range(50)]
    assert samples[7].accel == pytest.approx([0.0, 9.81, 0.0])
    assert samples[7].gyro == pytest.approx([-0.2, 0.3, -0.1])


def test_a_single_mcap_file_is_as_good_as_its_folder(tmp_path: Path, level_config: Path) -> None:
    bag = bags.write_bag(tmp_path, "mcap", BOTH)
    (file,) = bag.glob("*.mcap")
    assert main([str(file), "-o", str(tmp_path / "x.lcmlog"), "--config", str(level_config)]) == 0


def test_topics_can_be_chosen(tmp_path: Path, level_config: Path) -> None:
    bag = bags.write_bag(tmp_path, "ros2", {**BOTH, "/rear": bags.CLOUD, "/other_imu": bags.IMU})
    choice = ["--cloud", "/rear", "--imu", "/imu"]
    assert main([str(bag), "-o", str(tmp_path / "x.lcmlog"), "--config", str(level_config), *choice]) == 0


def test_accelerations_in_g_are_noticed(tmp_path: Path, level_config: Path, capsys) -> None:
    bag = bags.write_bag(tmp_path, "ros1", BOTH, gravity=1.0)
    assert main([str(bag), "-o", str(tmp_path / "x.lcmlog"), "--config", str(level_config)]) == 0
    assert "accelerations are in g" in capsys.readouterr().out
    sample = next(e.message for e in read_log(tmp_path / "x.lcmlog", ("L1_IMU",)))
    assert sample.accel[1] == pytest.approx(9.80665)


@pytest.mark.parametrize(("brightest", "expected"), [(1.0, 255.0), (200.0, 200.0), (4000.0, 255.0)])
def test_intensities_end_between_0_and_255(
    brightest: float, expected: float, tmp_path: Path, level_config: Path
) -> None:
    bag = bags.write_bag(tmp_path, "ros2", BOTH, brightest=brightest)
    assert main([str(bag), "-o", str(tmp_path / "x.lcmlog"), "--config", str(level_config)]) == 0
    assert next(e.message for e in read_log(tmp_path / "x.lcmlog", ("L1_SCAN",))).intensity[-1] == expected


def test_rows_of_an_organised_cloud_may_be_padded() -> None:
    cloud = bags.Messages(ros1=False).cloud(bags.START_NS)
    cloud.height, cloud.width = 2, 2
    cloud.row_step = 2 * cloud.point_step + 12
    rows = np.asarray(cloud.data).reshape(2, 2 * cloud.point_step)
    cloud.data = np.hstack([rows, np.full((2, 12), 255, dtype=np.uint8)]).reshape(-1)
    read = from_point_cloud2(cloud, "/points")
    np.testing.assert_allclose(read.points, bags.POINTS)
    np.testing.assert_array_equal(read.times, bags.OFFSETS_NS)


def test_livox_clouds_count_from_the_stamp() -> None:
    messages = bags.Messages(ros1=False)
    points = [
        SimpleNamespace(x=x, y=y, z=z, reflectivity=7, offset_time=int(offset))
        for (x, y, z), offset in zip(bags.POINTS, bags.OFFSETS_NS, strict=True)
    ]
    message = SimpleNamespace(header=messages.header(bags.START_NS), timebase=5, point_num=len(points), points=points)
    read = from_livox(message)
    assert (read.header_ns, read.time_name) == (bags.START_NS, "offset_time")
    np.testing.assert_allclose(read.points, bags.POINTS)
    np.testing.assert_array_equal(read.times, bags.OFFSETS_NS)


def test_the_decision_about_times_is_told(tmp_path: Path, level_config: Path, capsys) -> None:
    bag = bags.write_bag(tmp_path, "ros2", BOTH, time_name="offset_time")
    assert main([str(bag), "-o", str(tmp_path / "x.lcmlog"), "--config", str(level_config)]) == 0
    assert "per-point time: field offset_time, ns, relative to the header's stamp" in capsys.readouterr().out


@pytest.mark.parametrize("package", ["livox_ros_driver", "livox_ros_driver2"])
@pytest.mark.parametrize("form", ["ros2", "mcap"])
def test_livox_bags_come_in_without_their_definitions(
    package: str, form: str, tmp_path: Path, level_config: Path, capsys
) -> None:
    bag = bags.write_livox_bag(tmp_path, form, package)
    assert main([str(bag), "-o", str(tmp_path / "x.lcmlog"), "--config", str(level_config)]) == 0
    assert "per-point time: field offset_time, ns" in capsys.readouterr().out
    scans = [e.message for e in read_log(tmp_path / "x.lcmlog", ("L1_SCAN",))]
    assert [s.utime for s in scans] == [START_US + i * 100_000 for i in range(5)]
    np.testing.assert_allclose(np.array(scans[0].x), -bags.POINTS[:, 1])
    assert list(scans[0].dt_us) == [0, 30_000, 60_000, 90_000]


def test_clouds_without_times_come_in_when_nobody_wants_deskewing(tmp_path: Path, level_config: Path, capsys) -> None:
    bag = bags.write_bag(tmp_path, "ros2", BOTH, time_name=None)
    arguments = [str(bag), "-o", str(tmp_path / "x.lcmlog"), "--config", str(level_config)]
    assert main(arguments) == 2
    assert "--no-deskew imports them all the same" in capsys.readouterr().err
    assert main([*arguments, "--no-deskew"]) == 0
    assert "no per-point time: every point has its cloud's stamp" in capsys.readouterr().out
    scans = [e.message for e in read_log(tmp_path / "x.lcmlog", ("L1_SCAN",))]
    assert [s.utime for s in scans] == [START_US + i * 100_000 for i in range(5)]
    assert {s.duration_us for s in scans} == {0}
