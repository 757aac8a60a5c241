# SPDX-License-Identifier: Apache-2.0
"""NEES of made-up replays whose errors are drawn from the covariance they state."""

import json
from pathlib import Path

import numpy as np
import pytest

from ignis.errors import InputError
from ignis.evaluate import Row, Variant, _row, table
from ignis.evaluation.consistency import band, inside_percent, nees_of, nis_of, silent_percent
from ignis.evaluation.drives import Simulation, changed_scene
from ignis.poses import Poses, Trajectory, quaternion_from_matrix, rotation_matrix, write_tum


def _rotation(vector: np.ndarray) -> np.ndarray:
    angle = np.linalg.norm(vector)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def _replay(folder: Path, seed: int, inflation: float, began: Poses | None = None) -> Trajectory:
    """A folder of a replay with errors `inflation` times what it says; returns the truth, which starts off level.
    `began`: where in frame odom the first pose lies (level)."""
    random = np.random.default_rng(seed)
    count = 400
    utime = np.arange(count) * 50_000 + 1_000_000
    root = 0.02 * random.normal(size=(6, 6)) + 0.01 * np.eye(6)
    covariance = root @ root.T
    start = Poses(np.array([[5.0, 1.0, -3.0]]), quaternion_from_matrix(_rotation(np.array([0.0, 0.7, 0.0])))[None])
    position, quaternion, true_position, true_quaternion = [], [], [], []
    for i in range(count):
        p, R = np.array([0.0, 0.0, -0.05 * i]), _rotation(np.array([0.0, 0.002 * i, 0.0]))
        error = inflation * root @ random.normal(size=6) if i > 0 else np.zeros(6)
        position.append(p)
        quaternion.append(quaternion_from_matrix(R))
        true_position.append(p + error[3:])
        true_quaternion.append(quaternion_from_matrix(R @ _rotation(error[:3])))
    folder.mkdir()
    estimated = Poses(np.array(position), np.array(quaternion))
    if began is not None:
        estimated = began[np.zeros(count, dtype=int)] @ estimated
        turn = np.eye(6)
        turn[3:, 3:] = rotation_matrix(began.quaternion)[0]
        covariance = turn @ covariance @ turn.T
    write_tum(folder / "eskf.tum", Trajectory(utime, estimated))
    upper = covariance[np.triu_indices(6)]
    names = [f"p{i}{k}" for i, k in zip(*np.triu_indices(6), strict=True)]
    rows = [",".join(map(str, [t, *upper])) for t in utime]
    (folder / "eskf_states.csv").write_text("\n".join([",".join(["utime", *names]), *rows]) + "\n")
    seen = start[np.zeros(count, dtype=int)] @ Poses(np.array(true_position), np.array(true_quaternion))
    return Trajectory(utime, seen)


def test_nees_is_one_when_errors_are_what_the_covariance_says(tmp_path: Path) -> None:
    position, attitude = nees_of(tmp_path / "a", _replay(tmp_path / "a", 1, 1.0))
    assert position == pytest.approx(1.0, abs=0.2)
    assert attitude == pytest.approx(1.0, abs=0.2)


def test_nees_is_the_square_of_how_much_larger_the_errors_are(tmp_path: Path) -> None:
    position, attitude = nees_of(tmp_path / "a", _replay(tmp_path / "a", 1, 3.0))
    assert position == pytest.approx(9.0, rel=0.2)
    assert attitude == pytest.approx(9.0, rel=0.25)


def test_a_vehicle_that_has_left_the_origin_by_its_first_pose_is_as_honest_as_one_that_has_not(tmp_path: Path) -> None:
    turn = quaternion_from_matrix(_rotation(np.array([0.0, 0.3, 0.0])))[None]
    began = Poses(np.array([[0.1, 0.0, -0.5]]), turn)
    moving = nees_of(tmp_path / "a", _replay(tmp_path / "a", 1, 1.0, began))
    assert moving == pytest.approx(nees_of(tmp_path / "b", _replay(tmp_path / "b", 1, 1.0)), rel=1e-3)


def test_nis_is_that_of_the_applied_scans_per_direction_that_they_observe(tmp_path: Path) -> None:
    """Two scans that observe six and three directions; what a refused one says of none does not count."""
    rows = ["utime,applied,nis,nis_directions", "1,1,3.0,6.0", "2,0,900.0,6.0", "3,1,1.5,3.0"]
    (tmp_path / "scan_stats.csv").write_text("\n".join(rows) + "\n")
    assert nis_of(tmp_path) == pytest.approx(0.5)
    (tmp_path / "scan_stats.csv").write_text("\n".join(rows[:1]) + "\n")
    assert nis_of(tmp_path) is None


def test_few_poses_lie_outside_three_sigma_of_an_honest_covariance(tmp_path: Path) -> None:
    """In one of six coordinates: 1.6 %. With errors three times as large each coordinate is inside with 68 %."""
    assert inside_percent(tmp_path / "a", _replay(tmp_path / "a", 1, 1.0)) > 97.0
    assert 5.0 < inside_percent(tmp_path / "b", _replay(tmp_path / "b", 1, 3.0)) < 40.0


def test_a_pose_that_is_off_and_said_to_be_ok_is_silent(tmp_path: Path) -> None:
    """Ten scans a metre off: five are reported as OK, three as degraded, two as lost; the ninety others are right."""
    utime = np.arange(100) * 50_000 + 1_000_000
    true_position = np.stack([np.zeros(100), np.zeros(100), -0.05 * np.arange(100)], axis=1)
    level = np.tile([1.0, 0.0, 0.0, 0.0], (100, 1))
    position = true_position.copy()
    position[40:50, 0] += 1.0
    trust = np.zeros(100, dtype=int)
    trust[40:43], trust[43:45], trust[80:90] = 1, 2, 1
    write_tum(tmp_path / "eskf.tum", Trajectory(utime, Poses(position, level)))
    rows = [f"{t},{value}" for t, value in zip(utime, trust, strict=True)]
    (tmp_path / "eskf_states.csv").write_text("\n".join(["utime,trust", *rows]) + "\n")
    truth = Trajectory(utime, Poses(true_position, level))
    assert silent_percent(tmp_path, truth) == pytest.approx(5.0)


def test_band_narrows_with_the_number_of_drives() -> None:
    few, many = band(3), band(60)
    assert few[0] < many[0] < 1.0 < many[1] < few[1]


def test_changed_scene_keeps_its_geometry_within_reach(tmp_path: Path) -> None:
    scenes, work = tmp_path / "scenes", tmp_path / "work" / "deep"
    scenes.mkdir()
    (scenes / "hall.json").write_text("{}")
    (scenes / "quick.json").write_text(
        '{"geometry": "hall.json", "meshes": [{"file": "meshes/rock.ply"}], "imu": {"gyro_bias_walk": 1}}'
    )
    changed = changed_scene(scenes / "quick.json", ["imu.gyro_bias_walk=2", "lidar.range_noise_m=0.02"], work)
    content = json.loads(changed.read_text())
    assert (changed.parent / content["geometry"]).resolve() == (scenes / "hall.json").resolve()
    assert (changed.parent / content["meshes"][0]["file"]).resolve() == (scenes / "meshes/rock.ply").resolve()
    assert content["imu"]["gyro_bias_walk"] == 2
    assert content["lidar"] == {"range_noise_m": 0.02}
    with pytest.raises(InputError, match=r"section\.key=value"):
        changed_scene(scenes / "quick.json", ["nonsense"], work)


def test_table_lists_drives_in_order_and_means_over_seeds() -> None:
    def row(seed: int, nees: float) -> Row:
        figures = dict.fromkeys(
            (
                "ate_m",
                "smoothed_ate_m",
                "drift_percent",
                "inside_percent",
                "silent_percent",
                "applied_percent",
                "named_percent",
                "scan_p50_ms",
                "scan_p99_ms",
            ),
            0.5,
        )
        figures |= {
            "rpe_10m_m": None,
            "loops": 2,
            "nees_position": nees,
            "nees_attitude": 1.0,
            "nis": None,
            "scan_p99_ms": 2.0,
        }
        return Row(Simulation("hall", seed, Path("a"), Path("b")), Variant("plain"), figures)

    text = table([row(2, 3.0), row(1, 1.0)])
    assert text.index("hall, 1") < text.index("hall, 2")
    assert "| hall | plain | 2.00 | 1.00 |" in text


def test_table_names_what_failed_and_leaves_it_out_of_the_means() -> None:
    drive = Simulation("hall", 1, Path("a"), Path("b"))
    text = table([Row(drive, Variant("never"), {}, "start refused")])
    assert "| hall, 1 | never | failed: start refused |" in text
    assert "| hall | never |" not in text


def test_a_drive_whose_log_lacks_samples_is_scored_with_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    replayed = tmp_path / "replayed"
    truth = _replay(replayed, 1, 1.0)
    (replayed / "smoothed.tum").write_bytes((replayed / "eskf.tum").read_bytes())
    (replayed / "scan_stats.csv").write_text("utime,applied,nis,nis_directions\n1,1,3.0,6.0\n")
    losses = {"missing_imu": 4, "missing_scans": 0, "incomplete_scans": 1, "undecodable": 0, "damaged_bytes": 0}
    counts = {"scans": 9, "scans_applied": 9, "scans_with_unobserved_directions": 0, "loops_kept": 0}
    timing = {"scan_p50_ms": 1.0, "scan_p99_ms": 2.0}
    (replayed / "report.json").write_text(json.dumps({"input": losses, "timing": timing, **counts}))
    states = (replayed / "eskf_states.csv").read_text().splitlines()
    trusted = [states[0] + ",trust", *(row + ",0" for row in states[1:])]
    (replayed / "eskf_states.csv").write_text("\n".join(trusted) + "\n")
    write_tum(tmp_path / "drive.tum", truth)
    for code, problem in ((3, ""), (1, "ended with code 1")):
        program = tmp_path / f"binaries{code}" / "lio_replay"
        program.parent.mkdir()
        program.write_text(f'#!/bin/sh\ncp -r {replayed} "$5"\nexit {code}\n')
        program.chmod(0o755)
        drive = Simulation("hall", code, tmp_path / "drive.lcmlog", tmp_path / "drive.tum")
        row = _row(drive, Variant("tuned"), tmp_path / "config.json", tmp_path, program.parent)
        assert problem in row.problem and bool(row.problem) == bool(problem), row.problem
    assert capsys.readouterr().err == f"WARNING: {drive.log}: 4 IMU samples missing, 1 scans with a part missing\n"
