# SPDX-License-Identifier: Apache-2.0
"""What `./ignis bench` hands to the peers, and how it reports them. No peer is needed."""

import json
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

from ignis.bench import table
from ignis.benching import peer_runner
from ignis.benching.inputs import Drive, sensor_of
from ignis.benching.systems import CPU_LIMIT_S, Outcome, _run_on, failure_reason

SCAN_US = 50_000
POINTS = 10


def frames(scans: int, merge: int, sensor: str) -> list[tuple[int, int]]:
    """Frames of a drive of evenly stamped scans, as counts of scans."""
    first = np.arange(scans + 1) * POINTS
    time_us = np.arange(scans * POINTS) * (SCAN_US // POINTS) + 7_000_000
    given = peer_runner.frames(first, time_us, merge, peer_runner.SENSORS[sensor])
    return [(int(begin) // POINTS, int(end) // POINTS) for begin, end in given]


def test_sparse_scans_of_the_rest_are_one_frame_and_the_others_are_merged() -> None:
    assert frames(67, 2, "l1") == [(0, 1), (1, 60), (60, 62), (62, 64), (64, 66)]
    assert frames(63, 1, "l1")[1:] == [(1, 60), (60, 61), (61, 62), (62, 63)]


def test_dense_scans_of_the_rest_are_left_out_but_the_last() -> None:
    assert frames(63, 1, "spinning") == [(0, 1), (59, 60), (60, 61), (61, 62), (62, 63)]


def test_drive_shorter_than_the_rest_still_gives_two_frames() -> None:
    assert frames(5, 2, "l1") == [(0, 1), (1, 5)]


class Recording:
    """A peer that keeps what it gets and stands still."""

    def __init__(self, drive: dict, sensor: peer_runner.Sensor) -> None:
        self.merge = 2
        self.sizes: list[int] = []

    def add(self, xyz: np.ndarray, time_us: np.ndarray) -> np.ndarray:
        self.sizes.append(len(xyz))
        return np.eye(4)


def test_run_stamps_each_frame_with_its_last_point(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(peer_runner.PEERS, "recording", Recording)
    scans = 64
    time_us = np.arange(scans * POINTS) * (SCAN_US // POINTS)
    drive = {"first": np.arange(scans + 1) * POINTS, "time_us": time_us, "xyz": np.zeros((scans * POINTS, 3))}
    stamps, poses, cost = peer_runner.run("recording", drive, peer_runner.SENSORS["l1"])
    assert stamps == [time_us[end * POINTS - 1] for end in (1, 60, 62, 64)]
    assert len(poses) == 4 and cost["merged_scans"] == 2 and cost["cpu_s"] >= 0.0


def test_scene_names_its_sensor(tmp_path: Path) -> None:
    scene = tmp_path / "a.json"
    scene.write_text("{}")
    assert sensor_of(scene) == "l1"
    scene.write_text(json.dumps({"lidar": {"model": "spinning"}}))
    assert sensor_of(scene) == "spinning"


def test_reason_of_a_failure_is_told_in_one_line() -> None:
    assert failure_reason(0, "warning") == ""
    assert failure_reason(1, "Traceback\nValueError: a | b\n") == "exit code 1: ValueError: a / b"
    assert failure_reason(3, "") == "exit code 3"
    assert failure_reason(-signal.SIGSEGV, "") == "died of SIGSEGV"
    assert failure_reason(-signal.SIGXCPU, "") == f"more than {CPU_LIMIT_S} s of CPU"


def test_process_that_fails_is_reported_with_what_it_said_last() -> None:
    reason, _ = _run_on([sys.executable, "-c", "raise SystemExit('out of luck')"], 0)
    assert reason == "exit code 1: out of luck"
    reason, cost = _run_on([sys.executable, "-c", "pass"], 0)
    assert reason == "" and cost["peak_mb"] > 1.0


def outcome(system: str, seed: int, **figures: object) -> Outcome:
    drive = Drive("hall", "l1", seed, Path(), Path(), Path())
    return Outcome(system, drive, figures)


def test_table_has_ratios_to_the_best_peer_and_rows_for_failures() -> None:
    text = table(
        [
            outcome("ours: ESKF", 1, ate_rmse_m=0.1, cpu_s=2.0),
            outcome("rko-lio", 1, ate_rmse_m=0.4, cpu_s=4.0),
            outcome("kiss-icp", 1, ate_rmse_m=0.2, cpu_s=8.0),
            outcome("kiss-icp", 2, failed="died of SIGSEGV"),
            outcome("genz-icp", 1, failed="exit code 1: lost"),
        ]
    )
    lines = [[cell.strip() for cell in line.split("|")] for line in text.splitlines() if line.startswith("|")]
    rows = {cells[1]: cells for cells in lines}
    assert rows["ours: ESKF"][-3:-1] == ["0.50", "0.50"]
    assert rows["rko-lio"][-3:-1] == ["2.00", "1.00"]
    assert rows["kiss-icp"][2] == "0.200 (1 of 2 failed: died of SIGSEGV)"
    assert rows["genz-icp"][2] == "failed: exit code 1: lost"
    assert len({len(row) for row in rows.values()}) == 1
