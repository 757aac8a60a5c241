# SPDX-License-Identifier: Apache-2.0
"""L1 captures: recognised by their bytes, decoded by the driver, put in order here. A script plays the driver."""

from pathlib import Path

import pytest
from ignis_lcm.ignis import imu_t, scan_t

from checkout import ROOT
from ignis.importers.l1_capture import is_capture
from ignis.importing import main
from ignis.logs import LogWriter, read_log

FRAMES = b"".join(bytes([0xFD, 5, 0, 0, n, 1, 1, 16, 0, 0]) + b"\1" * 7 for n in range(3))


@pytest.fixture
def arguments(tmp_path: Path, level_config: Path) -> list[str]:
    (tmp_path / "x.bin").write_bytes(b"noise\xfd" + FRAMES)
    return [str(tmp_path / "x.bin"), "-o", str(tmp_path / "x.lcmlog"), "--config", str(level_config)]


@pytest.fixture
def driver(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "build" / "bin" / "l1_driver"
    path.parent.mkdir(parents=True)
    path.touch(mode=0o755)
    monkeypatch.setenv("IGNIS_BUILD", str(tmp_path / "build"))
    return path


def play(driver: Path, recorded: Path) -> None:
    """The script writes a recorded log where LCM's file provider would."""
    driver.write_text(f'#!/bin/sh\nurl="${{LCM_DEFAULT_URL#file://}}"\ncp {recorded} "${{url%?mode=w}}"\n')


def test_our_golden_streams_are_captures_and_text_is_not() -> None:
    for stream in (ROOT / "test" / "data" / "l1").glob("golden_*.bin"):
        assert is_capture(stream.read_bytes()[: 1 << 16])
    assert is_capture(b"noise" + FRAMES)
    assert not is_capture(FRAMES[:-17])  # two frames may be chance
    assert not is_capture(b"\xfd" * 1000)


def test_without_a_build_there_is_no_driver(arguments: list[str], capsys) -> None:
    assert main(arguments) == 2
    assert "run ./ignis build first" in capsys.readouterr().err


def test_the_drivers_refusal_is_passed_on(arguments: list[str], driver: Path, tmp_path: Path, capsys) -> None:
    driver.write_text('#!/bin/sh\necho "l1_driver: no valid frame" >&2\nexit 2\n')
    assert main(arguments) == 2
    assert "x.bin: no valid frame" in capsys.readouterr().err
    assert not list(tmp_path.glob("x.lcmlog*"))


def test_records_are_put_in_the_order_in_which_they_were_complete(
    arguments: list[str], driver: Path, tmp_path: Path
) -> None:
    scan, sample = scan_t(), imu_t()
    scan.utime, scan.duration_us, scan.part_count = 1_000, 50_000, 1
    sample.utime = 2_000
    with LogWriter(tmp_path / "driver.log") as writer:
        writer.write(77, "L1_SCAN", scan.encode())
        writer.write(78, "L1_IMU", sample.encode())
    play(driver, tmp_path / "driver.log")
    assert main(arguments) == 0
    assert [(e.utime, e.channel) for e in read_log(tmp_path / "x.lcmlog")] == [(2_000, "L1_IMU"), (51_000, "L1_SCAN")]
    assert not list(tmp_path.glob("*.decoded")) and not list(tmp_path.glob("*.tmp"))


def test_a_damaged_capture_is_imported_as_far_as_it_is_whole_and_called_so(
    arguments: list[str], driver: Path, tmp_path: Path, capsys
) -> None:
    scan, sample = scan_t(), imu_t()
    scan.part_count = 1
    with LogWriter(tmp_path / "driver.log") as writer:
        writer.write(77, "L1_SCAN", scan.encode())
        writer.write(78, "L1_IMU", sample.encode())
    play(driver, tmp_path / "driver.log")
    with driver.open("a") as script:
        script.write('echo "l1_driver: damage in the stream: 2 checksum errors" >&2\nexit 3\n')
    assert main(arguments) == 0
    assert "  damage in the stream: 2 checksum errors" in capsys.readouterr().out
    assert (tmp_path / "x.lcmlog").is_file()


def test_changes_of_the_configuration_reach_the_driver(
    arguments: list[str], driver: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    driver.write_text('#!/bin/sh\necho "l1_driver: called with $*" >&2\nexit 2\n')
    front_end = driver.with_name("lio_frontend")
    front_end.write_text('#!/bin/sh\necho "{}"\n')
    front_end.chmod(0o755)
    assert main([*arguments, "--set", "extrinsics.lidar.yaw_deg=5", "--set", "extrinsics.imu.yaw_deg=6"]) == 2
    said = capsys.readouterr().err
    assert said.rstrip().endswith("--set extrinsics.lidar.yaw_deg=5 --set extrinsics.imu.yaw_deg=6")


def test_a_capture_without_scans_is_refused(arguments: list[str], driver: Path, tmp_path: Path, capsys) -> None:
    with LogWriter(tmp_path / "driver.log") as writer:
        writer.write(78, "L1_IMU", imu_t().encode())
    play(driver, tmp_path / "driver.log")
    assert main(arguments) == 2
    assert "holds 0 scans and 1 inertial samples; need both" in capsys.readouterr().err
    assert not (tmp_path / "x.lcmlog").exists()
