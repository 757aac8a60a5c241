# SPDX-License-Identifier: Apache-2.0
"""What l1_sim writes: its log against its capture, its list of faults, and its refusals."""

import csv
import json
import os
from pathlib import Path

import pytest

from ignis.importers.l1_capture import import_capture
from ignis.logs import PartAssembler, joined_arrays, read_events, read_log

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
SECONDS = 5
SPINNING_CONFIG = CHECKOUT / "config" / "spinning.json"
BEAMS, COLUMNS = 32, 512


@pytest.fixture
def simulate(run_binary):
    """Runs l1_sim for five seconds of sensor time; returns the finished process."""

    def run(*arguments: object):
        return run_binary(
            "l1_sim", "--scene", SCENE, "--config", CONFIG, "--duration", SECONDS, *arguments, seconds=120
        )

    return run


def test_log_holds_what_the_import_of_the_capture_gives(simulate, tmp_path: Path) -> None:
    capture, log, imported = (tmp_path / name for name in ("capture.bin", "drive.lcm", "imported.lcm"))
    assert simulate("--capture", capture).returncode == 0
    assert simulate("--log", log).returncode == 0
    import_capture(capture, CONFIG, imported)
    for channel in ("L1_IMU", "L1_SCAN"):
        ours = [event.data for event in read_events(log) if event.channel == channel]
        theirs = [event.data for event in read_events(imported) if event.channel == channel]
        assert len(ours) >= SECONDS * 20 - 1
        assert ours == theirs, channel


def test_log_carries_the_truth_and_is_the_same_each_time(simulate, tmp_path: Path) -> None:
    first, second, truth = tmp_path / "first.lcm", tmp_path / "second.lcm", tmp_path / "truth.tum"
    assert simulate("--log", first, "--ground-truth", truth).returncode == 0
    assert simulate("--log", second).returncode == 0
    assert first.read_bytes() == second.read_bytes()
    poses = [event.message for event in read_log(first) if event.channel == "GROUND_TRUTH"]
    rows = [line for line in truth.read_text().splitlines() if not line.startswith("#")]
    assert len(poses) == len(rows) == SECONDS * 250 + 1
    stamps = [event.utime for event in read_events(first)]
    assert stamps == sorted(stamps)


def test_replay_reads_the_log(simulate, run_binary, tmp_path: Path) -> None:
    log = tmp_path / "drive.lcm"
    assert simulate("--log", log).returncode == 0
    done = run_binary("lio_replay", log, "--config", CONFIG, "--out", tmp_path / "out", seconds=120)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "out" / "eskf.tum").stat().st_size > 0


def test_faults_are_injected_summed_up_and_listed(simulate, tmp_path: Path) -> None:
    clean, damaged, listing = tmp_path / "clean.bin", tmp_path / "damaged.bin", tmp_path / "faults.csv"
    assert simulate("--capture", clean).returncode == 0
    done = simulate(
        "--capture", damaged, "--fault", "drop=0.02", "--fault", "flip=0.02", "--fault-seed", 3, "--fault-list", listing
    )
    assert done.returncode == 0, done.stderr
    with listing.open() as file:
        rows = list(csv.DictReader(file))
    drops = sum(row["fault"] == "drop" for row in rows)
    flips = sum(row["fault"] == "flip" for row in rows)
    assert 20 < drops < 120 and 20 < flips < 120
    assert f"{drops} drop, {flips} flip" in done.stderr
    assert clean.stat().st_size > damaged.stat().st_size
    # The first fault stands where the damaged stream stops being the clean one, or within that frame.
    a, b = clean.read_bytes(), damaged.read_bytes()
    parted = next(i for i in range(len(b)) if a[i] != b[i])
    assert 0 <= parted - int(rows[0]["offset"]) < 258


def test_wrong_arguments_are_refused_in_one_message(simulate, tmp_path: Path) -> None:
    done = simulate(
        *("--capture", tmp_path / "a.bin", "--log", tmp_path / "b.lcm", "--fault", "melt=0.1", "--fault", "drop=2"),
        *("--stall-ms", 0, "--id-modulus", 1, "--ignore-commands", 7, "--wait", -1, "--power-cycle-at", -3),
    )
    assert done.returncode == 2
    for part in ("--capture --log", "melt=0.1", "fault.drop", "fault.stall_ms", "device.id_modulus"):
        assert part in done.stderr, done.stderr
    for part in ("device.ignore_commands", "--wait", "device.power_cycle_at_s"):
        assert part in done.stderr, done.stderr
    assert not list(tmp_path.iterdir())


def test_missing_output_is_refused_naming_all_choices(simulate) -> None:
    done = simulate()
    assert done.returncode == 2
    assert all(option in done.stderr for option in ("--capture", "--log", "--pty", "--udp"))


def test_options_of_another_output_are_refused(simulate, tmp_path: Path) -> None:
    done = simulate("--log", tmp_path / "a.lcm", "--wait", 3, "--spin-up", 3, "--power-cycle-at", 2)
    assert done.returncode == 2
    assert all(option in done.stderr for option in ("--wait", "--spin-up", "--power-cycle-at"))
    done = simulate("--udp", "127.0.0.1:5000", "--ground-truth", tmp_path / "truth.tum")
    assert done.returncode == 2 and "--ground-truth" in done.stderr


@pytest.mark.parametrize("address", ["nowhere", "127.0.0.1", ":5000", "127.0.0.1:port", "no.such.host.invalid:5000"])
def test_bad_udp_addresses_are_refused(simulate, address: str) -> None:
    done = simulate("--udp", address)
    assert done.returncode == 2
    assert "HOST:PORT" in done.stderr


@pytest.fixture
def spinning(run_binary, tmp_path: Path):
    """Runs l1_sim over the short hall with a spinning LiDAR; returns the finished process."""
    drive = json.loads(SCENE.read_text())
    drive["geometry"] = str(SCENE.parent / drive["geometry"])
    drive["lidar"] = {"model": "spinning", "spinning": {"beams": BEAMS, "columns": COLUMNS, "min_range_m": 0.0}}
    scene = tmp_path / "spinning.json"
    scene.write_text(json.dumps(drive))

    def run(*arguments: object):
        return run_binary(
            "l1_sim", "--scene", scene, "--config", SPINNING_CONFIG, "--duration", SECONDS, *arguments, seconds=120
        )

    return run


def test_spinning_lidar_writes_scans_in_parts_with_the_truth(spinning, tmp_path: Path) -> None:
    first, second, truth = tmp_path / "first.lcm", tmp_path / "second.lcm", tmp_path / "truth.tum"
    assert spinning("--log", first, "--ground-truth", truth).returncode == 0
    assert spinning("--log", second).returncode == 0
    assert first.read_bytes() == second.read_bytes()
    stamps = [event.utime for event in read_events(first)]
    assert stamps == sorted(stamps)
    events = list(read_log(first))
    parts = [event.message for event in events if event.channel == "L1_SCAN"]
    assert all(len(event.data) < 64000 for event in read_events(first))
    assembler = PartAssembler()
    scans = [joined_arrays(whole) for part in parts if (whole := assembler.add(part)) is not None]
    assert len(scans) == SECONDS * 10 and len(parts) == 6 * len(scans)
    # 17 of the 16,384 rays meet nothing.
    assert all(BEAMS * COLUMNS - COLUMNS // 16 < len(scan["x"]) <= BEAMS * COLUMNS for scan in scans)
    samples = [event.message for event in events if event.channel == "L1_IMU"]
    poses = [event.message for event in events if event.channel == "GROUND_TRUTH"]
    rows = [line for line in truth.read_text().splitlines() if not line.startswith("#")]
    assert len(samples) == len(poses) == len(rows) == SECONDS * 200 + 1


def test_replay_follows_the_spinning_lidar(spinning, run_binary, tmp_path: Path) -> None:
    log, out = tmp_path / "drive.lcm", tmp_path / "out"
    assert spinning("--log", log).returncode == 0
    done = run_binary("lio_replay", log, "--config", SPINNING_CONFIG, "--out", out, seconds=120)
    assert done.returncode == 0, done.stdout + done.stderr
    assert len((out / "eskf.tum").read_text().splitlines()) > 20


def test_spinning_lidar_has_no_bytes_to_send_or_to_spoil(spinning, tmp_path: Path) -> None:
    done = spinning("--capture", tmp_path / "a.bin", "--fault", "drop=0.1", "--id-modulus", 100)
    assert done.returncode == 2
    for part in ("spinning", "--capture", "--fault", "--id-modulus", "--log FILE"):
        assert part in done.stderr, done.stderr
    for output in (("--udp", "127.0.0.1:5000"), ("--pty", tmp_path / "line")):
        done = spinning(*output)
        assert done.returncode == 2 and output[0] in done.stderr, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["spinning.json"]
