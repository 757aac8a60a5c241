# SPDX-License-Identifier: Apache-2.0
"""Row F10: where geometry says too little, that is named at once, and nowhere else; the covariance bears the error."""

import csv
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from moving_scenes import people_in_a_hall, trucks_on_both_sides, write_scene

SEEDS = (1, 2)
_CONFIG = Path(__file__).parents[2] / "config"


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, Any]]]:
    """Folder and rows of an evaluation: a hall, and a corridor with and without door frames."""
    folder = tmp_path_factory.mktemp("geometry")
    scenes, seeds = "battery_hall,corridor,corridor_bare", ",".join(map(str, SEEDS))
    done = subprocess.run(
        [sys.executable, "-m", "ignis.evaluate", "--scenes", scenes, "--seeds", seeds, "--out", folder],
        capture_output=True,
        text=True,
        timeout=300.0,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder, json.loads((folder / "evaluation.json").read_text())


def _evaluated(folder: Path, config: Path, seeds: tuple[int, ...], scene_sets: list[str]) -> list[dict[str, Any]]:
    """Rows of an evaluation of the scenes in a folder, with the noise of the peers' drives."""
    sets = ["imu.gyro_bias_walk=1e-4", "imu.accel_bias_walk=1e-3", *scene_sets]
    command = [sys.executable, "-m", "ignis.evaluate", "--scene-folder", folder, "--config", config]
    command += ["--scenes", ",".join(sorted(file.stem for file in folder.glob("*.json")))]
    command += ["--seeds", ",".join(map(str, seeds)), "--out", folder.parent / "out"]
    for each in sets:
        command += ["--scene-set", each]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300.0)
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads((folder.parent / "out" / "evaluation.json").read_text())


def test_fault_f10_among_trucks_that_four_of_five_points_lie_on_the_pose_is_never_ok_and_far_off(
    tmp_path: Path,
) -> None:
    """What is beside the trucks says little of the way along the street: dead reckoning, and told so. These two drives
    are as honest without a look at what moves; the people of the next test are what it is needed for."""
    write_scene(tmp_path / "scenes", "trucks", trucks_on_both_sides())
    lidar = 'lidar={"model":"spinning","spinning":{"beams":64}}'
    for row in _evaluated(tmp_path / "scenes", _CONFIG / "spinning.json", (4, 6), [lidar]):
        assert row["silent_percent"] == 0.0, f"seed {row['seed']}"
        assert row["named_percent"] >= 50.0, f"seed {row['seed']}"


def test_fault_f10_people_on_both_sides_do_not_take_the_vehicle_with_them_unnoticed(tmp_path: Path) -> None:
    """Of the points of an L1 that face along the way most lie on people; without a look at what moves 72 % of the scans
    of the first drive are OK and far off, and its NEES is 7,000."""
    write_scene(tmp_path / "scenes", "people", people_in_a_hall(50))
    for row in _evaluated(tmp_path / "scenes", _CONFIG / "ignis8_tuned.json", SEEDS, ["lidar.range_noise_m=0.02"]):
        assert row["silent_percent"] == 0.0, f"seed {row['seed']}"
        assert row["nees_position"] <= 20.0, f"seed {row['seed']}"


def _of_starts_that_noise_sets_off(folder: Path, config: Path) -> list[dict[str, Any]]:
    """Noise of four sigma takes the velocity of these two of 240 drives beyond what passes for standing."""
    (folder / "scenes").mkdir()
    shutil.copy(_CONFIG / "scenes" / "open_hall_ramp.json", folder / "scenes")
    return _evaluated(folder / "scenes", config, (97, 137), ["lidar.range_noise_m=0.02"])


def test_fault_f10_a_vehicle_that_noise_sets_off_where_nothing_is_in_sight_is_not_lost_for_good(tmp_path: Path) -> None:
    """What they map from then on goes along with their velocity, and a hall that stands still seems to move: before,
    they ended 2.2 and 38 m off. With the planes that they had then; which of them find back is chance with others."""
    settings = json.loads((_CONFIG / "ignis8_tuned.json").read_text())
    settings["frontend"]["min_plane_width_m"] = 0.0
    (tmp_path / "config.json").write_text(json.dumps(settings))
    for row in _of_starts_that_noise_sets_off(tmp_path, tmp_path / "config.json"):
        assert row["ate_m"] <= 1.0, f"seed {row['seed']}"
        assert row["nees_position"] <= 3.0 and row["silent_percent"] <= 3.0, f"seed {row['seed']}"


def test_fault_f10_a_vehicle_that_noise_sets_off_where_nothing_is_in_sight_tells_how_lost_it_is(tmp_path: Path) -> None:
    """With the shipped settings seed 97 ends 11 m off; what is asked is that this is told."""
    for row in _of_starts_that_noise_sets_off(tmp_path, _CONFIG / "ignis8_tuned.json"):
        assert row["nees_position"] <= 3.0 and row["silent_percent"] <= 3.0, f"seed {row['seed']}"


def test_fault_f10_a_direction_that_no_scan_observes_is_named_within_five_scans(
    drives: tuple[Path, list[dict[str, Any]]],
) -> None:
    for scene in ("corridor", "corridor_bare"):
        for seed in SEEDS:
            file = drives[0] / "runs" / f"{scene}_{seed}_as configured" / "scan_stats.csv"
            with file.open(newline="") as stream:
                applied = [row for row in csv.DictReader(stream) if row["applied"] == "1"]
            assert any(int(row["degenerate_directions"]) > 0 for row in applied[:5]), f"{scene}, seed {seed}"


def test_fault_f10_a_hall_raises_no_false_alarm_and_drifts_by_less_than_a_thousandth(
    drives: tuple[Path, list[dict[str, Any]]],
) -> None:
    hall = [row for row in drives[1] if row["scene"] == "battery_hall"]
    assert len(hall) == len(SEEDS)
    for row in hall:
        assert row["named_percent"] <= 1.0 and row["drift_percent"] <= 0.1


def test_fault_f10_the_error_is_within_three_sigma_in_ninety_nine_of_a_hundred_scans(
    drives: tuple[Path, list[dict[str, Any]]],
) -> None:
    for row in drives[1]:
        assert row["inside_percent"] >= 99.0, f"{row['scene']}, seed {row['seed']}"
