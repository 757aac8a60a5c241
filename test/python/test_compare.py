# SPDX-License-Identifier: Apache-2.0
"""Figures against trajectories whose errors are known by arithmetic."""

import json
from pathlib import Path

import numpy as np
import pytest

from ignis.compare import comparison, main
from ignis.errors import InputError
from ignis.mounts import R_OURS_FROM_FLU, rotation_from_yaw_pitch_roll
from ignis.poses import Poses, Trajectory, quaternion_from_matrix, quaternion_product, write_tum


def circle(count: int = 400, radius: float = 20.0) -> Trajectory:
    """One turn to the left, heading along the way, 5 cm of ups and downs."""
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    position = np.stack([radius * (np.cos(angle) - 1), 0.05 * np.sin(9 * angle), -radius * np.sin(angle)], axis=1)
    quaternion = np.array([quaternion_from_matrix(rotation_from_yaw_pitch_roll(yaw, 0, 0)) for yaw in angle])
    return Trajectory(1_000_000 + np.arange(count) * 50_000, Poses(position, quaternion))


def moved(trajectory: Trajectory, rotation: np.ndarray, shift: list[float]) -> Trajectory:
    by = Poses(np.array([shift]), quaternion_from_matrix(rotation)[None])
    return Trajectory(trajectory.utime, by[np.zeros(len(trajectory), dtype=int)] @ trajectory.poses)


def folder_with(path: Path, eskf: Trajectory, smoothed: Trajectory, truth: Trajectory | None) -> Path:
    path.mkdir(exist_ok=True)
    write_tum(path / "eskf.tum", eskf)
    write_tum(path / "smoothed.tum", smoothed)
    if truth is not None:
        write_tum(path / "ground_truth.tum", truth)
    return path


def with_positions(trajectory: Trajectory, position: np.ndarray) -> Trajectory:
    return Trajectory(trajectory.utime, Poses(position, trajectory.poses.quaternion))


def test_a_rigid_shift_is_no_error_and_a_tilt_counts_only_when_gravity_is_held(tmp_path: Path) -> None:
    truth = circle()
    turned = moved(truth, rotation_from_yaw_pitch_roll(0.7, 0, 0), [3.0, 2.0, 1.0])
    tilted = moved(truth, rotation_from_yaw_pitch_roll(0.0, 0.01, 0), [0.0, 0.0, 0.0])
    result = comparison(folder_with(tmp_path / "r", turned, tilted, truth), per_scan=True)["trajectories"]
    for key in ("ate_rmse_m", "ate_yaw_rmse_m", "rpe_10m_rmse_m", "end_error_m"):
        assert result["eskf"][key] == pytest.approx(0.0, abs=1e-6)
    assert result["eskf"]["per_scan"]["max_m"] == pytest.approx(0.0, abs=1e-6)
    assert result["smoothed"]["ate_rmse_m"] == pytest.approx(0.0, abs=1e-6)
    # Tilting by 0.01 about X lifts a point by 0.01 * -z; over a circle of 20 m that is 0.2 / sqrt(2) rms.
    assert result["smoothed"]["ate_yaw_rmse_m"] == pytest.approx(0.2 / np.sqrt(2.0), rel=0.01)


def test_a_scale_error_gives_the_figures_of_arithmetic(tmp_path: Path) -> None:
    truth = circle()
    long = with_positions(truth, truth.poses.position * 1.01)
    result = comparison(folder_with(tmp_path / "r", long, truth, truth))["trajectories"]["eskf"]
    # Alignment does not scale: every point of the circle ends 1 % of the radius outside.
    assert result["ate_rmse_m"] == pytest.approx(0.2, rel=0.01)
    # A chord of 10 m of path is 2 r sin(10 / 2 r) long, and 1 % of it is the relative error. Evo measures the 10 m
    # along the estimate and lets the last pairs be 10 % short, hence the tolerance.
    assert result["rpe_10m_rmse_m"] == pytest.approx(0.01 * 40.0 * np.sin(0.25), rel=0.03)
    # All pairs: one from each of the 400 poses but those within the last 9 m of 126.
    assert result["rpe_10m_pairs"] == pytest.approx(400 * (1 - 9 / 126), abs=3)
    assert result["end_error_m"] == pytest.approx(0.0, abs=1e-6)  # back at the start


def test_the_end_point_error_lays_the_first_poses_on_one_another(tmp_path: Path) -> None:
    truth = circle()
    half = Trajectory(truth.utime[:200], truth.poses[:200])
    away = half.poses.position + np.linspace(0.0, 1.0, 200)[:, None] * [0.0, 0.6, 0.8]
    folder = folder_with(tmp_path / "r", with_positions(half, away), half, truth)
    result = comparison(folder)["trajectories"]["eskf"]
    assert result["end_error_m"] == pytest.approx(1.0, abs=1e-6)
    assert result["end_error_percent"] == pytest.approx(100.0 / half.path_length(), rel=1e-6)


def test_truth_at_other_stamps_is_interpolated(tmp_path: Path) -> None:
    steps = np.arange(50)
    line = Poses(np.stack([np.sin(steps), 0 * steps, -steps * 1.0], axis=1), np.tile([1.0, 0, 0, 0], (50, 1)))
    truth = Trajectory(steps * 100_000, line)
    estimate = truth.at(truth.utime[:-1] + 37_000)
    result = comparison(folder_with(tmp_path / "r", estimate, estimate, truth))
    assert result["trajectories"]["eskf"]["ate_rmse_m"] == pytest.approx(0.0, abs=1e-6)


def test_ground_truth_in_ros_axes_is_recognised(tmp_path: Path) -> None:
    ours = circle()
    back = R_OURS_FROM_FLU.T
    quaternion = [
        quaternion_from_matrix(back @ rotation @ R_OURS_FROM_FLU) for rotation in ours.poses.matrices()[:, :3, :3]
    ]
    ros = Trajectory(ours.utime, Poses(ours.poses.position @ back.T, np.array(quaternion)))
    write_tum(tmp_path / "ros.tum", ros)
    folder = folder_with(tmp_path / "r", ours, ours, None)
    result = comparison(folder, tmp_path / "ros.tum")
    assert result["trajectories"]["eskf"]["rpe_10m_rmse_m"] == pytest.approx(0.0, abs=1e-6)
    assert "forward-left-up" in result["notes"][0]
    stubborn = comparison(folder, tmp_path / "ros.tum", gt_axes="right_up_back")
    assert stubborn["trajectories"]["eskf"]["rpe_10m_rmse_m"] > 1.0


def test_a_straight_drive_is_aligned_by_yaw_alone(tmp_path: Path) -> None:
    steps = np.arange(30.0)
    line = np.stack([0 * steps, 0 * steps, -steps], axis=1)
    truth = Trajectory(np.arange(30) * 100_000, Poses(line, np.tile([1.0, 0, 0, 0], (30, 1))))
    result = comparison(folder_with(tmp_path / "r", truth, truth, truth))["trajectories"]["eskf"]
    assert "too straight" in result["alignment"]
    assert result["ate_rmse_m"] == pytest.approx(0.0, abs=1e-6)


def test_a_drive_below_ten_metres_has_no_rpe(tmp_path: Path) -> None:
    short = circle(radius=1.0)
    result = comparison(folder_with(tmp_path / "r", short, short, short))["trajectories"]["eskf"]
    assert (result["rpe_10m_rmse_m"], result["rpe_10m_pairs"]) == (None, 0)


def test_without_ground_truth_the_two_are_compared_with_each_other(tmp_path: Path, capsys) -> None:
    eskf = circle()
    smoothed = with_positions(eskf, eskf.poses.position + [0.0, 0.0, 0.5])
    assert main([str(folder_with(tmp_path / "r", eskf, smoothed, None))]) == 0
    said = capsys.readouterr().out
    assert "no ground truth" in said and "largest 0.500 m" in said
    content = json.loads((tmp_path / "r" / "compare.json").read_text())
    assert content["smoothing"]["words"] == ["Without ground truth nobody can say whether smoothing helped."]
    (result,) = content["runs"]
    assert result["ground_truth"] is False
    assert result["smoothed_minus_eskf"]["rmse_m"] == pytest.approx(0.5)
    assert result["trajectories"]["eskf"]["end_to_start_m"] == pytest.approx(0.0, abs=1e-6)
    assert (tmp_path / "r" / "trajectory.png").stat().st_size > 1000
    assert not (tmp_path / "r" / "error.png").exists()


def test_the_table_shows_what_compare_json_holds(tmp_path: Path, capsys) -> None:
    truth = circle()
    folder = folder_with(tmp_path / "r", with_positions(truth, truth.poses.position * 1.01), truth, truth)
    assert main([str(folder), "--per-scan"]) == 0
    said = capsys.readouterr().out
    figures = json.loads((folder / "compare.json").read_text())["runs"][0]["trajectories"]["eskf"]
    assert f"{figures['ate_rmse_m']:.3f}" in said and "per scan, p95" in said
    assert (folder / "error.png").stat().st_size > 1000
    assert not list(folder.glob("*.tmp"))


def test_missing_files_foreign_truth_and_unrelated_runs_are_refused(tmp_path: Path, capsys) -> None:
    assert main([str(tmp_path)]) == 2
    assert "has no eskf.tum and no smoothed.tum" in capsys.readouterr().err
    truth = circle()
    late = Trajectory(truth.utime + 10**12, truth.poses)
    with pytest.raises(InputError, match="same drive"):
        comparison(folder_with(tmp_path / "a", truth, truth, late))
    with pytest.raises(InputError, match="same run"):
        comparison(folder_with(tmp_path / "b", truth, late, None))


def test_several_runs_are_one_table_with_the_mean_and_an_interval(tmp_path: Path, capsys) -> None:
    truth = circle()
    folders = []
    for seed, scale in enumerate((1.010, 1.012, 1.008, 1.011)):
        eskf = with_positions(truth, truth.poses.position * scale)
        smoothed = with_positions(truth, truth.poses.position * (1.0 + (scale - 1.0) / 2))
        folders.append(str(folder_with(tmp_path / f"seed{seed}", eskf, smoothed, truth)))
    assert main([*folders, "--out", str(tmp_path / "all")]) == 0
    said = capsys.readouterr().out
    assert "seed3" in said and "mean" in said and "Smoothing helped. ATE" in said
    content = json.loads((tmp_path / "all" / "compare.json").read_text())
    gain = content["smoothing"]["gains"]["ate_rmse_m"]
    # Half of 1.025 % of the radius of 20 m, and drives that differ little.
    assert gain["gain_mean"] == pytest.approx(0.1025, rel=0.01)
    assert 0.08 < gain["interval"][0] < gain["gain_mean"] < gain["interval"][1] < 0.12
    page = (tmp_path / "all" / "compare.html").read_text()
    assert page.count("<svg") >= 4 + 4 * 3 and "seed2" in page


def test_another_estimate_stands_beside_ours(tmp_path: Path, capsys) -> None:
    truth = circle()
    folder = folder_with(tmp_path / "r", truth, truth, truth)
    write_tum(tmp_path / "peer.tum", with_positions(truth, truth.poses.position * 1.02))
    assert main([str(folder), "--against", str(tmp_path / "peer.tum")]) == 0
    assert "peer" in capsys.readouterr().out
    (result,) = json.loads((folder / "compare.json").read_text())["runs"]
    assert result["trajectories"]["peer"]["ate_rmse_m"] == pytest.approx(0.4, rel=0.01)
    (folder / "ground_truth.tum").unlink()
    assert main([str(folder), "--against", str(tmp_path / "peer.tum")]) == 0
    (blind,) = json.loads((folder / "compare.json").read_text())["runs"]
    assert blind["trajectories"]["peer"]["distance_from_smoothed"]["rmse_m"] == pytest.approx(0.4, rel=0.01)
    assert main([str(folder), str(folder), "--against", str(tmp_path / "peer.tum")]) == 2


def test_tilt_and_yaw_are_what_was_put_in(tmp_path: Path) -> None:
    truth = circle()
    # Tilted by 1 degree at every pose about its own right axis; heading off by 2 degrees for the second half only.
    nodding = quaternion_from_matrix(rotation_from_yaw_pitch_roll(0.0, np.radians(1.0), 0.0))
    tilted = Trajectory(
        truth.utime,
        Poses(truth.poses.position, quaternion_product(truth.poses.quaternion, np.tile(nodding, (len(truth), 1)))),
    )
    turned = truth.poses.quaternion.copy()
    turned[200:] = quaternion_product(
        np.tile(quaternion_from_matrix(rotation_from_yaw_pitch_roll(np.radians(2.0), 0.0, 0.0)), (200, 1)), turned[200:]
    )
    yawed = Trajectory(truth.utime, Poses(truth.poses.position, turned))
    figures = comparison(folder_with(tmp_path / "r", tilted, yawed, truth))["trajectories"]
    assert figures["eskf"]["tilt_rmse_deg"] == pytest.approx(1.0, abs=1e-6)
    assert figures["eskf"]["yaw_rmse_deg"] == pytest.approx(0.0, abs=1e-6)
    assert figures["smoothed"]["tilt_rmse_deg"] == pytest.approx(0.0, abs=1e-5)
    assert figures["smoothed"]["yaw_rmse_deg"] == pytest.approx(2.0 / np.sqrt(2.0), abs=1e-6)
    assert figures["smoothed"]["yaw_max_deg"] == pytest.approx(2.0, abs=1e-6)
