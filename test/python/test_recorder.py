# SPDX-License-Identifier: Apache-2.0
"""What the recorder writes: body frame, time order, parts of one datagram."""

from pathlib import Path

import numpy as np
import pytest

from ignis.importers.recorder import Recorder
from ignis.logs import PartAssembler, joined_arrays, read_events, read_log
from ignis.mounts import Extrinsics, Mount

START = 1_700_000_000_000_000


def messages(path: Path, channel: str) -> list:
    return [event.message for event in read_log(path, (channel,))]


def test_scans_are_in_the_body_frame_in_parts_below_60_kb_sorted_by_time(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    points = rng.uniform(1.0, 30.0, size=(7000, 3))
    stamps = START + rng.permutation(7000) * 10
    mount = Mount("forward_left_up", translation_m=(0.5, 1.0, -2.0))
    with Recorder(tmp_path / "a", Extrinsics(lidar=mount)) as recorder:
        recorder.add_scan(stamps, points, np.full(7000, 300.0))
        recorder.finish()
    assert all(len(event.data) < 60_000 for event in read_events(tmp_path / "a"))
    parts = None
    assembler = PartAssembler()
    for message in messages(tmp_path / "a", "L1_SCAN"):
        parts = assembler.add(message)
    assert parts is not None and len(parts) == 3
    assert {(p.utime, p.sequence, p.duration_us) for p in parts} == {(START, 0, 69_990)}
    joined = joined_arrays(parts)
    order = np.argsort(stamps)
    expected = np.stack([-points[:, 1], points[:, 2], -points[:, 0]], axis=1)[order] + [0.5, 1.0, -2.0]
    np.testing.assert_allclose(np.stack([joined[n] for n in "xyz"], axis=1), expected, rtol=1e-6)
    np.testing.assert_array_equal(joined["dt_us"], stamps[order] - START)
    assert set(joined["intensity"]) == {255.0}


def test_missing_returns_and_non_finite_points_are_left_out(tmp_path: Path) -> None:
    points = np.array([[0.0, 0, 0], [np.nan, 1, 1], [5.0, 0, 0]])
    with Recorder(tmp_path / "a", Extrinsics()) as recorder:
        recorder.add_scan(np.array([START, START + 1, START + 2]), points, np.zeros(3))
        recorder.add_scan(np.array([START + 9]), np.zeros((1, 3)), np.zeros(1))
        recorder.finish()
    (scan,) = messages(tmp_path / "a", "L1_SCAN")
    assert (scan.num_points, scan.utime, scan.z) == (1, START + 2, (-5.0,))
    assert recorder.dropped["scans without a usable point"] == 1


def test_points_with_damaged_times_are_left_out(tmp_path: Path) -> None:
    stamps = START + np.array([0, 10, 20, 10_000_000_000_000, -10_000_000])
    with Recorder(tmp_path / "a", Extrinsics()) as recorder:
        recorder.add_scan(stamps, np.ones((5, 3)), np.zeros(5))
        recorder.finish()
    (scan,) = messages(tmp_path / "a", "L1_SCAN")
    assert (scan.utime, scan.dt_us) == (START, (0, 10, 20))


def test_records_are_stamped_when_complete_and_come_in_that_order(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a", Extrinsics()) as recorder:
        recorder.add_scan(np.array([START, START + 100_000]), np.ones((2, 3)), np.zeros(2))
        for offset in (150_000, 50_000, 50_000):  # out of order, and one twice
            recorder.add_imu(START + offset, np.zeros(3), np.array([0.0, 0.0, 9.81]))
        recorder.finish()
    events = [(event.utime - START, event.channel) for event in read_events(tmp_path / "a")]
    assert events == [(50_000, "L1_IMU"), (100_000, "L1_SCAN"), (150_000, "L1_IMU")]
    assert [m.sequence for m in messages(tmp_path / "a", "L1_IMU")] == [0, 1]
    assert sum(recorder.dropped.values()) == 1


def test_what_is_later_than_the_window_is_dropped_and_counted(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a", Extrinsics()) as recorder:
        for offset in (0, 1_000, 10_000_000, 500):
            recorder.add_imu(START + offset, np.zeros(3), np.ones(3))
        recorder.finish()
    assert [m.utime - START for m in messages(tmp_path / "a", "L1_IMU")] == [0, 1_000, 10_000_000]
    assert sum(recorder.dropped.values()) == 1


def test_an_inertial_unit_off_the_origin_loses_its_centripetal_term(tmp_path: Path) -> None:
    # Turning about up at 2 rad/s, 0.5 m right of the origin: the unit feels 2 m/s^2 towards the axis, to the left.
    mount = Mount("right_up_back", translation_m=(0.5, 0.0, 0.0))
    with Recorder(tmp_path / "a", Extrinsics(imu=mount)) as recorder:
        recorder.add_imu(START, np.array([0.0, 2.0, 0.0]), np.array([-2.0, 9.81, 0.0]))
        recorder.finish()
    (sample,) = messages(tmp_path / "a", "L1_IMU")
    assert sample.accel == pytest.approx([0.0, 9.81, 0.0])
    assert sample.gyro == pytest.approx([0.0, 2.0, 0.0])
