# SPDX-License-Identifier: Apache-2.0
"""Logs as arrays: shapes, types, parts, and what is not ours."""

from pathlib import Path

import numpy as np
import pytest

import ignis
from ignis.logs import LogWriter
from recorded_run import CONFIG, POINTS, START_US, write_live_log


@pytest.fixture
def log(tmp_path: Path) -> ignis.LogArrays:
    return ignis.read_log(write_live_log(tmp_path / "a.lcmlog"))


def test_columns_have_a_row_per_message_and_the_type_of_the_field(log: ignis.LogArrays) -> None:
    imu = log["L1_IMU"]
    assert imu["accel"].shape == (50, 3) and imu["accel"].dtype == np.float64
    assert imu["temperature"].dtype == np.float32 and imu["sequence"].dtype == np.int32
    np.testing.assert_array_equal(imu.utime, START_US + 10_000 * np.arange(50))
    np.testing.assert_array_equal(imu.log_utime, imu.utime + 700)
    assert imu.seconds[-1] == pytest.approx(0.49)
    assert log["LIO_STATE"]["frame"].tolist() == ["odom"] * 10


def test_parts_of_a_scan_are_one_row(log: ignis.LogArrays) -> None:
    scans = log["L1_SCAN"]
    assert scans.count == 10 and scans["num_points"].tolist() == [6] * 10
    np.testing.assert_array_equal(scans.ragged["x"][7], np.tile(POINTS[:, 0], 2))
    assert scans.ragged["x"][7].dtype == np.float32 and scans.ragged["dt_us"][7].dtype == np.int32


def test_constants_go_by_name(log: ignis.LogArrays) -> None:
    stats = log["LIO_SCAN_STATS"]
    assert np.flatnonzero(stats.is_constant("NO_IMU")).tolist() == [3]
    assert log["LOOP_RESULT"].is_constant("STAGE_WITHDRAWN").tolist() == [False, True]
    assert log["HEALTH"].is_constant("DEGRADED").tolist() == [True]


def test_the_configuration_comes_along_and_counts_as_no_damage(log: ignis.LogArrays) -> None:
    assert log.config == CONFIG
    assert not log.damage


def test_wrong_names_are_answered_with_the_right_ones(log: ignis.LogArrays) -> None:
    with pytest.raises(KeyError, match="L1_IMU"):
        log["IMU"]
    with pytest.raises(KeyError, match="gyro"):
        log["L1_IMU"]["gyros"]
    with pytest.raises(KeyError, match="ragged"):
        log["L1_SCAN"]["x"]


def test_channels_can_be_chosen(tmp_path: Path) -> None:
    log = ignis.read_log(write_live_log(tmp_path / "a.lcmlog"), ["L1_IMU"])
    assert list(log) == ["L1_IMU"]
    assert log.config is None


def test_a_foreign_log_has_no_channels_and_says_how_much_it_left_out(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "f.lcmlog") as writer:
        for index in range(4):
            writer.write(index, "POSE_BODY", b"12345678 not ours")
    log = ignis.read_log(tmp_path / "f.lcmlog")
    assert len(log) == 0 and log.damage.undecodable == 4
