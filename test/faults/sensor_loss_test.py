# SPDX-License-Identifier: Apache-2.0
"""Rows B1 and F9 for the sensor's channels: messages of a drive lost in bursts, doubled and swapped, then replayed."""

import random
import subprocess
from pathlib import Path

import numpy as np
import pytest

from fault_drive import CONFIG, SCENE, lossy
from ignis.errors import EXIT_DAMAGED
from ignis.logs import LogEvent, LogWriter, read_events
from ignis.pipeline import binary
from ignis.poses import read_tum
from ignis.run_folder import losses_in, read_json
from ignis.trajectory_error import aligned_at_start, paired, position_errors

SEED = 5
DRIVE_S = 30.0
FLOOR_M = 0.01  # errors of a few millimetres are noise


def run(name: str, *arguments: object) -> subprocess.CompletedProcess:
    return subprocess.run([binary(name), *map(str, arguments)], capture_output=True, text=True, timeout=300.0)


def replayed(events: list[LogEvent], folder: Path) -> float:
    """Rms position error of the odometry [m]."""
    folder.mkdir()
    with LogWriter(folder / "in.lcmlog") as log:
        for event in events:
            log.write(*event)
    done = run("lio_replay", folder / "in.lcmlog", "--config", CONFIG, "--out", folder / "out")
    assert done.returncode == (EXIT_DAMAGED if losses_in(read_json(folder / "out" / "report.json")) else 0), done.stderr
    pair = paired(read_tum(folder / "out" / "eskf.tum"), read_tum(folder / "out" / "ground_truth.tum"))
    errors = position_errors(aligned_at_start(pair), pair.truth)
    assert np.isfinite(errors).all()
    return float(np.sqrt((errors**2).mean()))


@pytest.fixture(scope="module")
def events(tmp_path_factory: pytest.TempPathFactory) -> list[LogEvent]:
    log = tmp_path_factory.mktemp("lossy") / "drive.lcmlog"
    done = run("l1_sim", "--scene", SCENE, "--config", CONFIG, "--log", log, "--duration", DRIVE_S)
    assert done.returncode == 0, done.stderr
    return list(read_events(log))


@pytest.fixture(scope="module")
def clean_error(events: list[LogEvent], tmp_path_factory: pytest.TempPathFactory) -> float:
    return replayed(events, tmp_path_factory.mktemp("clean") / "run")


@pytest.mark.parametrize(("share", "factor"), [(0.05, 1.2), (0.10, 1.5)])
def test_fault_b1_lost_sensor_messages_cost_little_accuracy(
    share: float, factor: float, events: list[LogEvent], clean_error: float, tmp_path: Path
) -> None:
    kept = lossy(events, share, random.Random(SEED))
    error = replayed(kept, tmp_path / "run")
    print(
        f"seed {SEED}: {len(events) - len(kept)} of {len(events)} lost, error {error:.4f} m, clean {clean_error:.4f} m"
    )
    assert error < factor * clean_error + FLOOR_M


def test_fault_b1_a_third_of_the_sensor_messages_lost_is_no_divergence(
    events: list[LogEvent], clean_error: float, tmp_path: Path
) -> None:
    kept = lossy(events, 0.30, random.Random(SEED))
    error = replayed(kept, tmp_path / "run")
    print(
        f"seed {SEED}: {len(events) - len(kept)} of {len(events)} lost, error {error:.4f} m, clean {clean_error:.4f} m"
    )
    assert error < 0.5


def test_fault_f9_doubled_and_swapped_messages_change_nothing(
    events: list[LogEvent], clean_error: float, tmp_path: Path
) -> None:
    generator = random.Random(SEED)
    disturbed: list[LogEvent] = []
    for event in events:
        disturbed.append(event)
        if event.channel == "L1_IMU" and generator.random() < 0.05:
            disturbed.append(event)
    for at in range(1, len(disturbed)):
        if generator.random() < 0.02:
            disturbed[at - 1], disturbed[at] = disturbed[at], disturbed[at - 1]
    error = replayed(disturbed, tmp_path / "run")
    assert abs(error - clean_error) < 1e-9, "the replay sorts by stamps and takes each measurement once"
