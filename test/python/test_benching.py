# SPDX-License-Identifier: Apache-2.0
"""What `./ignis bench` hands to the peers, and how it reports them. No peer is needed."""

import dataclasses
import json
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

from ignis.bench import main, table
from ignis.benching import peer_runner, systems
from ignis.benching.inputs import Drive, recorded_drive, sensor_of
from ignis.benching.systems import CPU_LIMIT_S, Outcome, _judged, _run_on, failure_reason
from ignis.errors import InputError
from ignis.importers.recorder import Recorder
from ignis.mounts import Extrinsics
from ignis.poses import Poses, Trajectory, read_tum

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


def test_without_a_rest_every_scan_is_a_frame() -> None:
    first, time_us = np.arange(6) * POINTS, np.arange(5 * POINTS)
    moving = dataclasses.replace(peer_runner.SENSORS["spinning"], rest_s=0.0)
    assert peer_runner.frames(first, time_us, 1, moving) == [(10 * i, 10 * i + 10) for i in range(5)]


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


def recording(path: Path, points: int, truth: bool) -> Path:
    with Recorder(path, Extrinsics()) as recorder:
        for scan in range(3):
            utime = 1_000_000 + scan * 100_000
            recorder.add_imu(utime, np.zeros(3), np.array([0.0, 0.0, 9.81]))
            recorder.add_scan(utime + np.arange(points), np.full((points, 3), 5.0), np.zeros(points))
            if truth:
                recorder.add_truth(utime, np.array([0.0, 0.0, -float(scan)]), np.array([1.0, 0, 0, 0]), np.zeros(3))
        recorder.finish()
    return path


def config_file(folder: Path, start: str) -> Path:
    path = folder / "config.json"
    path.write_text(json.dumps({"frontend": {"start": start}}))
    return path


def test_a_recording_comes_with_its_truth_its_sensor_and_its_start(tmp_path: Path) -> None:
    log = recording(tmp_path / "around_the_block.lcm", 500, truth=True)
    drive = recorded_drive(log, config_file(tmp_path, "at_rest"), None, "auto", tmp_path / "inputs")
    assert (drive.scene, drive.sensor, drive.seed, drive.log) == ("around_the_block.lcm", "l1", None, log)
    assert drive.rest_s == peer_runner.REST_S
    assert drive.truth is not None and read_tum(drive.truth).poses.position[2].tolist() == [0.0, 0.0, -2.0]
    with np.load(drive.arrays) as arrays:
        assert arrays["first"].tolist() == [0, 500, 1000, 1500]
        # Axes of the peers: up is their third.
        assert arrays["accel"][0].tolist() == pytest.approx([0.0, 0.0, 9.81])


def test_a_recording_that_begins_in_motion_has_no_rest_and_dense_scans_are_a_spinning_lidars(tmp_path: Path) -> None:
    log = recording(tmp_path / "street.lcm", 5000, truth=False)
    drive = recorded_drive(log, config_file(tmp_path, "moving"), None, "auto", tmp_path / "inputs")
    assert (drive.sensor, drive.rest_s, drive.truth) == ("spinning", 0.0, None)


def test_truth_from_elsewhere_wins_and_is_turned_into_our_axes(tmp_path: Path) -> None:
    log = recording(tmp_path / "street.lcm", 500, truth=True)
    forward_along_x = tmp_path / "gt.tum"
    forward_along_x.write_text("".join(f"{1 + 0.1 * i} {3 * i} 0 0 0 0 0 1\n" for i in range(3)))
    drive = recorded_drive(log, config_file(tmp_path, "at_rest"), forward_along_x, "auto", tmp_path / "inputs")
    assert drive.truth is not None
    assert read_tum(drive.truth).poses.position[2].tolist() == pytest.approx([0.0, 0.0, -6.0])


def test_a_recording_among_the_inputs_is_not_thrown_away(tmp_path: Path) -> None:
    inputs = tmp_path / "inputs"
    (inputs / "recordings" / "street.lcm").mkdir(parents=True)
    log = recording(inputs / "recordings" / "street.lcm" / "street.lcm", 500, truth=True)
    config = config_file(tmp_path, "at_rest")
    with pytest.raises(InputError, match="another --out"):
        recorded_drive(inputs / "recordings" / "street.lcm", config, None, "auto", inputs)
    assert log.is_file()


@pytest.mark.parametrize("arguments", [["--gt", "a.tum"], ["--recording", "a.lcm", "--quick"]])
def test_options_that_contradict_one_another_are_refused(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as refused:
        main(arguments)
    assert refused.value.code == 2


def test_the_peers_process_is_told_how_long_the_rest_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    commands: list[list[object]] = []

    def run_on(command: list[object], core: int) -> tuple[str, dict[str, float]]:
        commands.append(command)
        return "not run", {}

    monkeypatch.setattr(systems, "_run_on", run_on)
    drive = Drive("street", "spinning", None, Path(), tmp_path / "a.npz", None, 0.0)
    assert systems.run_peer(Path("python"), "kiss-icp", drive, tmp_path, 0).figures == {"failed": "not run"}
    assert commands[0][-2:] == ["--rest", 0.0]


def test_a_table_of_failures_alone_is_one_of_equal_rows() -> None:
    lines = table([outcome("ours: ESKF", 1, failed="lost"), outcome("rko-lio", 1, failed="lost")]).splitlines()
    assert {line.count("|") for line in lines if line.startswith("|")} == {5}


def test_without_truth_the_way_from_the_end_back_to_the_start_is_told() -> None:
    trajectory = Trajectory(np.arange(3), Poses(np.array([[0, 0, 0], [9, 9, 9], [3, 4, 0.0]]), np.eye(4)[[0, 0, 0]]))
    drive = Drive("loop", "l1", None, Path(), Path(), None)
    judged = _judged("ours: ESKF", drive, trajectory, {"cpu_s": 1.0})
    assert judged.figures == {"end_to_start_m": 5.0, "cpu_s": 1.0}
    header = table([judged]).splitlines()[2]
    assert "### loop (recording)" in table([judged])
    assert "end to start m" in header and "ATE m" not in header


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


def test_a_replay_of_a_recording_with_losses_is_judged_with_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    losses = {"missing_imu": 0, "missing_scans": 2, "incomplete_scans": 0, "undecodable": 0, "damaged_bytes": 7}
    timing = {"scan_p50_ms": 1.0, "scan_p99_ms": 2.0, "wall_s": 1.0, "frontend": {"total_ms": 500.0}}
    made = tmp_path / "made"
    made.mkdir()
    (made / "report.json").write_text(json.dumps({"input": losses, "timing": timing}))
    for name in ("eskf.tum", "smoothed.tum"):
        (made / name).write_text("1.0 0 0 0 0 0 0 1\n2.0 3 4 0 0 0 0 1\n")
    program = tmp_path / "lio_replay"
    program.write_text(f'#!/bin/sh\ncp -r {made} "$5"\nexit 3\n')
    program.chmod(0o755)
    drive = Drive("street", "spinning", None, Path("street.lcm"), tmp_path / "a.npz", None, 0.0)
    for outcome_of_ours in systems.run_ours(program, drive, tmp_path / "config.json", tmp_path / "out", 0):
        assert outcome_of_ours.figures["end_to_start_m"] == pytest.approx(5.0)
    assert capsys.readouterr().err == "WARNING: street.lcm: 2 scans missing, 7 bytes damaged\n"


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
