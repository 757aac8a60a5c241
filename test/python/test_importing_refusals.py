# SPDX-License-Identifier: Apache-2.0
"""What cannot be imported gets one sentence, exit code 2 and leaves no file."""

import lzma
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import bags
from checkout import ROOT
from ignis.importing import main
from ignis.logs import LogWriter

BOTH = {"/points": bags.CLOUD, "/imu": bags.IMU}


def text_file(folder: Path) -> Path:
    (folder / "notes.txt").write_text("hello, this is no recording\n" * 10)
    return folder / "notes.txt"


def empty_file(folder: Path) -> Path:
    (folder / "empty.bag").touch()
    return folder / "empty.bag"


def lcm_log(folder: Path) -> Path:
    with LogWriter(folder / "a.lcmlog") as writer:
        writer.write(0, "X", b"data")
    return folder / "a.lcmlog"


def damaged_bag(folder: Path) -> Path:
    bag = bags.write_bag(folder, "ros1", BOTH)
    bag.write_bytes(bag.read_bytes()[:3000])
    return bag


def damaged_mcap(folder: Path) -> Path:
    (file,) = bags.write_bag(folder, "mcap", BOTH).glob("*.mcap")
    file.write_bytes(file.read_bytes()[:2000])
    return file


def bare_folder(folder: Path) -> Path:
    (folder / "bare").mkdir()
    return folder / "bare"


def two_drives(folder: Path) -> Path:
    for name in ("a", "b"):
        (folder / "drives" / name / "oxts").mkdir(parents=True)
        (folder / "drives" / name / "velodyne_points").mkdir()
    return folder / "drives"


def drive_without_scans(folder: Path) -> Path:
    for name in ("velodyne_points/timestamps_start.txt", "velodyne_points/timestamps_end.txt", "oxts/timestamps.txt"):
        (folder / "drive" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "drive" / name).write_text("2011-09-26 13:10:51.1\n")
    return folder / "drive"


def drive_with_cut_scan(folder: Path) -> Path:
    drive = drive_without_scans(folder)
    (drive / "velodyne_points" / "data").mkdir()
    (drive / "velodyne_points" / "data" / "0000000000.bin").write_bytes(b"\0" * 33)
    return drive


def drive_with_foreign_file(folder: Path) -> Path:
    drive = drive_without_scans(folder)
    (drive / "velodyne_points" / "data").mkdir()
    (drive / "velodyne_points" / "data" / "notes.bin").write_bytes(b"\0" * 16)
    return drive


def drive_with_bad_calibration(folder: Path) -> Path:
    drive = drive_without_scans(folder)
    (folder / "calib_imu_to_velo.txt").write_text("R: 1 2 3\n")
    return drive


def drive_with_damaged_archive(folder: Path) -> Path:
    drive = drive_without_scans(folder)
    packed = lzma.compress(bytes(range(256)) * 100)
    (drive / "velodyne_points" / "data.tar.xz").write_bytes(packed[: len(packed) // 2])
    return drive


REFUSALS: list[tuple[Callable[[Path], Path], str]] = [
    (lambda folder: folder / "nothing.bag", "does not exist"),
    (text_file, "is of no known kind"),
    (empty_file, "is empty"),
    (lcm_log, "is already an LCM log"),
    (damaged_bag, "cannot read the bag"),
    (damaged_mcap, "cannot read the bag"),
    (bare_folder, "holds neither"),
    (two_drives, "holds several drives"),
    (drive_without_scans, "holds no scan"),
    (drive_with_cut_scan, "not a multiple of 16"),
    (drive_with_foreign_file, "its name should be a number"),
    (drive_with_bad_calibration, "has no lines `R:` and `T:`"),
    (drive_with_damaged_archive, "is damaged"),
    (lambda folder: bags.write_bag(folder, "ros1", {"/points": bags.CLOUD}), "has no inertial data"),
    (lambda folder: bags.write_bag(folder, "ros2", {"/imu": bags.IMU}), "has no point cloud"),
    (lambda folder: bags.write_bag(folder, "ros2", {}), "is empty"),
    (lambda folder: bags.write_bag(folder, "ros2", BOTH, time_name=None), "have no per-point time"),
    (lambda folder: bags.write_bag(folder, "mcap", {**BOTH, "/rear": bags.CLOUD}), "choose with --cloud: /points (5"),
    (lambda folder: bags.write_bag(folder, "mcap", {**BOTH, "/imu2": bags.IMU}), "choose with --imu: /imu (50"),
]


@pytest.mark.parametrize(("make", "said"), REFUSALS, ids=[said for _, said in REFUSALS])
def test_unusable_input(make: Callable, said: str, tmp_path: Path, level_config: Path, capsys) -> None:
    output = tmp_path / "out" / "x.lcmlog"
    output.parent.mkdir()
    assert main([str(make(tmp_path)), "-o", str(output), "--config", str(level_config)]) == 2
    message = capsys.readouterr().err
    assert said in message and message.startswith("ignis: ") and message.count("\n") == 1
    assert list(output.parent.iterdir()) == []


def test_a_wrong_topic_lists_the_right_ones(tmp_path: Path, level_config: Path, capsys) -> None:
    bag = bags.write_bag(tmp_path, "ros1", BOTH)
    arguments = [str(bag), "-o", str(tmp_path / "x"), "--config", str(level_config), "--cloud", "/nope"]
    assert main(arguments) == 2
    assert "no point cloud on /nope; it has /points (5 messages)" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("output", "config", "said"),
    [
        ("missing/x.lcmlog", "level.json", "does not exist; make it first"),
        (".", "level.json", "is a folder"),
        ("x.lcmlog", "none.json", "no such file"),
        ("x.lcmlog", "bad.json", "is not JSON"),
    ],
)
def test_bad_outputs_and_configurations(
    output: str, config: str, said: str, tmp_path: Path, level_config: Path, capsys
) -> None:
    (tmp_path / "bad.json").write_text("{")
    bag = bags.write_bag(tmp_path, "ros1", BOTH)
    assert main([str(bag), "-o", str(tmp_path / output), "--config", str(tmp_path / config)]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "x.lcmlog").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_leaves_nothing(number: int, kitti: Path, tmp_path: Path) -> None:
    output = tmp_path / "x.lcmlog"
    types = next(path for path in sys.path if (Path(path) / "ignis_lcm").is_dir())
    environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'python'}:{types}"}
    command = ["-m", "ignis.importing", str(kitti), "-o", str(output), "--config", str(ROOT / "config" / "kitti.json")]
    process = subprocess.Popen([sys.executable, *command], env=environment, stderr=subprocess.PIPE, text=True)
    waited = time.monotonic() + 30.0
    while not list(tmp_path.iterdir()) and time.monotonic() < waited:
        time.sleep(0.02)
    process.send_signal(number)
    _, said = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "interrupted" in said and "Traceback" not in said
    assert list(tmp_path.iterdir()) == []
