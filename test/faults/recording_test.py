# SPDX-License-Identifier: Apache-2.0
"""Row L1 for the recorder: its disk fills in mid-drive, by its own log or at once by somebody else."""

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import lcm
import pytest

from fault_drive import BUS, CONFIG
from ignis.logs import read_events

DISK_MB = 12
KEEP_MB = 4
MESSAGE = bytes(20_000)
STRANGER_MB = 20  # more than there is


@pytest.fixture
def small_disk(private_network: None, tmp_path: Path) -> Iterator[Path]:
    disk = tmp_path / "disk"
    disk.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK_MB}m", "tmpfs", disk], check=True)
    yield disk
    subprocess.run(["umount", disk], check=True)


def fill(disk: Path) -> None:
    """Takes what is left of the disk."""
    with open(disk / "stranger", "wb", buffering=0) as file:
        try:
            for _ in range(STRANGER_MB):
                file.write(bytes(1_000_000))
        except OSError:
            return


@pytest.mark.parametrize("filled_by", ["its own log", "somebody else"])
def test_fault_l1_a_recorder_whose_disk_fills_says_so_and_its_log_stays_readable(
    filled_by: str, small_disk: Path
) -> None:
    log = small_disk / "drive.lcmlog"
    command = [sys.executable, "-m", "ignis.record", "-o", log, "--config", CONFIG, "--lcm-url", BUS]
    recorder = subprocess.Popen(
        [*command, "--keep-free-mb", str(KEEP_MB)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    bus = lcm.LCM(BUS)
    began, sent, full = time.monotonic(), 0, False
    while recorder.poll() is None and time.monotonic() - began < 60.0:
        if filled_by == "its own log" or sent < 50:
            bus.publish("DRIVE", sent.to_bytes(4, "big") + MESSAGE)
            sent += log.exists()
        elif not full:
            time.sleep(1.0)
            fill(small_disk)
            full = True
        time.sleep(0.02)
    recorder.terminate()
    said, trouble = recorder.communicate(timeout=20)
    print(said[-600:], trouble[-600:])
    assert f"the disk has less than {KEEP_MB} MB left" in said
    numbers = [int.from_bytes(event.data[:4], "big") for event in read_events(log) if event.channel == "DRIVE"]
    assert len(numbers) > 20 and numbers == sorted(numbers)
    assert not list(small_disk.glob("*.tmp"))
