# SPDX-License-Identifier: Apache-2.0
"""Rows L1 and P6 for the recorder: its disk fills or breaks, its folder or file is removed, or its logger is killed.

It goes on in a new file.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from ignis_lcm.ignis import health_t

from fault_drive import BUS, CONFIG
from ignis.bus import Listener
from ignis.log_config import recorded_config
from ignis.logs import read_events
from ignis.recording import default_name

DISK_MB = 7
KEEP_MB = 4
SEED = 78
BUSY_S = 1.5  # that a busy machine may add
MESSAGE = bytes(20_000)
STRANGER_MB = 20  # more than there is
FAULT_WITHIN_S = RESUMED_WITHIN_S = 1.0
KILLS = 4
SECOND_PAUSE_S = 4.5  # of 5 s
LOSS_S = 0.1  # that a killed logger may cost


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


class Recorder:
    """`./ignis record` on our bus, and what it is told to record. A context manager: leaving it ends all."""

    def __init__(self, log: Path, *arguments: object) -> None:
        command = [sys.executable, "-m", "ignis.record", "-o", log, "--config", CONFIG, "--lcm-url", BUS, *arguments]
        self.log = log
        self.process = subprocess.Popen(
            list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.states: list[int] = []  # that its HEALTH went through
        self.heard = 0  # HEALTH messages of it
        self.listener = Listener(BUS, "HEALTH", self._note_state)
        self.sent = 0
        self.started = False

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            self.process.communicate(timeout=20)

    def _note_state(self, _: str, message: Any) -> None:
        if message.process != "ignis_record":
            return
        self.heard += 1
        if message.state not in self.states[-1:]:
            self.states.append(message.state)

    def send_until(self, holds: Callable[[], bool], seconds: float = 30.0) -> float:
        """Publishes numbered messages until it holds; how long that took [s]."""
        began = time.monotonic()
        while not holds():
            assert self.process.poll() is None and time.monotonic() - began < seconds
            self.listener.bus.publish("DRIVE", self.sent.to_bytes(4, "big") + MESSAGE)
            self.started = self.started or self.log.exists()
            self.sent += self.started
            self.listener.listen(0.01)
        return time.monotonic() - began

    def says(self, state: int) -> bool:
        """Whether its newest HEALTH is of this state."""
        entry = self.listener.health.get(("ignis_record", self.process.pid))
        return entry is not None and entry[1].state == state

    def kill_logger(self) -> None:
        """Ends the logger that writes now, at once."""
        (logger,) = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        os.kill(int(logger), signal.SIGKILL)

    def end(self) -> tuple[int, str]:
        """Ctrl-C; exit code and all that was said."""
        self.process.send_signal(signal.SIGINT)
        said, trouble = self.process.communicate(timeout=20)
        print(said[-600:], trouble[-600:])
        return self.process.returncode, said + trouble


def numbers(log: Path) -> list[int]:
    """What of our messages stands in a log."""
    found = [int.from_bytes(event.data[:4], "big") for event in read_events(log) if event.channel == "DRIVE"]
    assert found == sorted(found)
    return found


@pytest.mark.parametrize("filled_by", ["its own log", "somebody else"])
def test_fault_l1_a_recorder_whose_disk_fills_says_so_and_goes_on_in_a_new_file_when_there_is_room(
    filled_by: str, small_disk: Path, tmp_path: Path
) -> None:
    log, second = small_disk / "drive.lcmlog", small_disk / "drive-2.lcmlog"
    with Recorder(log, "--keep-free-mb", KEEP_MB) as recorder:
        if filled_by == "somebody else":
            recorder.send_until(lambda: log.exists() and log.stat().st_size > 400_000)
            fill(small_disk)
        recorder.send_until(lambda: recorder.says(health_t.FAULT))
        first = tmp_path / "kept.lcmlog"
        shutil.copy(log, first)
        (small_disk / "stranger" if filled_by == "somebody else" else log).unlink()
        recorder.send_until(lambda: second.exists() and second.stat().st_size > 400_000)
        assert recorder.says(health_t.OK)
        code, said = recorder.end()
    assert code == 3 and f"the disk has less than {KEEP_MB} MB left: paused" in said and str(second) in said
    early, late = numbers(first), numbers(second)
    assert len(early) > 10 and len(late) > 10 and early[-1] < late[0], "what was written is whole, and it went on"
    assert not list(small_disk.glob("*.tmp"))


def test_fault_l1_a_recorder_whose_folder_is_removed_says_so_and_goes_on_when_it_is_back(
    private_network: None, tmp_path: Path
) -> None:
    folder = tmp_path / "card"
    folder.mkdir()
    log, second = folder / "drive.lcmlog", folder / "drive-2.lcmlog"
    with Recorder(log) as recorder:
        recorder.send_until(lambda: log.exists() and recorder.sent > 50)
        shutil.rmtree(folder)
        took = recorder.send_until(lambda: recorder.says(health_t.FAULT))
        folder.mkdir()
        resumed = recorder.send_until(second.exists)
        recorder.send_until(lambda: recorder.says(health_t.OK) and second.stat().st_size > 1_500_000)
        code, said = recorder.end()
    print(f"FAULT after {took:.2f} s, went on after {resumed:.2f} s")
    assert took < FAULT_WITHIN_S + BUSY_S and resumed < RESUMED_WITHIN_S + BUSY_S
    assert code == 3 and f"the folder {folder} is gone: paused" in said
    assert recorded_config(second) is not None and len(numbers(second)) > 10


def test_fault_l1_a_recorder_whose_file_is_removed_goes_on_in_a_new_one(private_network: None, tmp_path: Path) -> None:
    log, second = tmp_path / "drive.lcmlog", tmp_path / "drive-2.lcmlog"
    with Recorder(log) as recorder:
        recorder.send_until(lambda: log.exists() and recorder.sent > 50)
        log.unlink()
        took = recorder.send_until(second.exists)
        recorder.send_until(lambda: second.stat().st_size > 1_500_000)
        code, said = recorder.end()
    assert took < RESUMED_WITHIN_S + BUSY_S
    assert code == 3 and f"{log} was removed" in said
    assert recorded_config(second) is not None and len(numbers(second)) > 10


def test_fault_l1_a_recorder_whose_disk_breaks_says_so_and_goes_on_in_a_new_file_once_it_works(
    private_network: None, failing_disk: tuple[Path, Path]
) -> None:
    folder, switch = failing_disk
    log, second, third = (folder / f"drive{part}.lcmlog" for part in ("", "-2", "-3"))
    with Recorder(log) as recorder:
        recorder.send_until(lambda: log.exists() and recorder.sent > 250)  # longer than a logger that ends at once
        switch.touch()
        took = recorder.send_until(lambda: recorder.says(health_t.FAULT))
        said_at = recorder.sent
        recorder.send_until(lambda: recorder.sent > said_at + 150)
        assert not second.exists(), "one file, not one after the other that stays empty"
        switch.unlink()
        resumed = recorder.send_until(second.exists)
        began = time.monotonic()
        recorder.send_until(lambda: recorder.says(health_t.OK) and second.stat().st_size > 1_500_000)
        switch.touch()
        recorder.send_until(lambda: recorder.says(health_t.FAULT))
        switch.unlink()
        recorder.send_until(third.exists)
        paused = time.monotonic() - began
        recorder.send_until(lambda: recorder.says(health_t.OK))
        code, said = recorder.end()
    print(f"FAULT after {took:.2f} s, went on after {resumed:.2f} s, and when it broke again {paused:.1f} s later")
    assert took < FAULT_WITHIN_S + BUSY_S and resumed < RESUMED_WITHIN_S + BUSY_S
    assert paused > SECOND_PAUSE_S, "a disk that breaks again and again is tried ever later"
    assert code == 3 and f"the disk of {folder} takes no data: Input/output error: paused" in said
    early, late = numbers(log), numbers(second)
    assert len(early) > 200 and len(late) > 10 and early[-1] < said_at < late[0]
    assert recorded_config(second) is not None
    assert {path.name for path in folder.iterdir()} == {log.name, second.name, third.name}


STUBBORN_LOGGER = """#!/bin/bash
# Finds its disk broken, is in no hurry to end, and says more than a pipe holds.
trap '' INT
log="${@: -1}"
touch "$log"
sleep 1
echo 'lcm_eventlog_write_event: Input/output error' >&2
sleep 4
head -c 1000000 /dev/zero | tr '\\0' x >&2
touch "$log.ended"
"""


def test_fault_l1_a_recorder_whose_logger_ends_slowly_and_loudly_speaks_all_the_while(
    private_network: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "bin").mkdir()
    for program in (Path(os.environ["IGNIS_BUILD"]) / "bin").iterdir():
        (tmp_path / "bin" / program.name).symlink_to(program)
    logger = tmp_path / "bin" / "lcm-logger"
    logger.write_text(STUBBORN_LOGGER)
    logger.chmod(0o755)
    monkeypatch.setenv("IGNIS_BUILD", str(tmp_path))
    log = tmp_path / "drive.lcmlog"
    ended = log.with_name(f"{log.name}.ended")
    with Recorder(log) as recorder:
        recorder.send_until(lambda: recorder.says(health_t.FAULT))
        before = recorder.heard
        took = recorder.send_until(ended.exists, seconds=8.0)
        heard = recorder.heard - before
    print(f"{heard} HEALTH messages in {took:.1f} s")
    assert heard >= 0.7 * took - 1.0


def test_fault_l1_a_folder_that_nothing_can_be_written_to_is_refused_with_path_and_free_space(
    private_network: None, tmp_path: Path
) -> None:
    folder = tmp_path / "read_only"
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "ro,size=4m", "tmpfs", folder], check=True)
    try:
        with Recorder(folder / "drive.lcmlog") as recorder:
            said, trouble = recorder.process.communicate(timeout=20)
        assert recorder.process.returncode == 2 and "Traceback" not in trouble
        assert f"cannot write into {folder}: Read-only file system (4 MB are free there)" in said + trouble
        assert not list(folder.iterdir())
    finally:
        subprocess.run(["umount", folder], check=True)


def test_fault_p6_a_killed_logger_costs_the_recording_at_most_a_tenth_of_a_second(
    private_network: None, tmp_path: Path
) -> None:
    logs = [tmp_path / f"drive{part}.lcmlog" for part in ("", *(f"-{number}" for number in range(2, KILLS + 2)))]
    generator = random.Random(SEED)
    losses = []
    with Recorder(logs[0]) as recorder:
        for log in logs[:-1]:
            recorder.send_until(log.exists)
            # Small messages: large ones are written at once, since they fill the logger's buffer.
            sent, end = [], time.monotonic() + generator.uniform(2.2, 2.6)
            while time.monotonic() < end:
                recorder.listener.bus.publish("SMALL", len(sent).to_bytes(4, "big"))
                sent.append(time.monotonic())
                time.sleep(0.004)
            recorder.kill_logger()
            kept = [int.from_bytes(event.data, "big") for event in read_events(log) if event.channel == "SMALL"]
            losses.append(sent[-1] - sent[kept[-1]])
        recorder.end()
    print("seed", SEED, "lost [s]", [round(loss, 3) for loss in losses])
    assert max(losses) < LOSS_S


def test_fault_p6_a_killed_logger_is_succeeded_within_a_second_in_a_new_file(
    private_network: None, tmp_path: Path
) -> None:
    log, second = tmp_path / "drive.lcmlog", tmp_path / "drive-2.lcmlog"
    with Recorder(log) as recorder:
        recorder.send_until(lambda: log.exists() and recorder.sent > 250)  # a logger that dies at once is a refusal
        recorder.kill_logger()
        took = recorder.send_until(second.exists)
        recorder.send_until(lambda: second.stat().st_size > 1_500_000)
        code, said = recorder.end()
    assert took < 1.0 + BUSY_S
    assert code == 3 and "interrupted: lcm-logger ended with code -9" in said
    assert recorded_config(log) is not None and recorded_config(second) is not None
    assert len(numbers(log)) > 100 and len(numbers(second)) > 10


def test_fault_p6_a_successor_that_is_killed_as_soon_as_it_began_is_succeeded_as_well(
    private_network: None, tmp_path: Path
) -> None:
    log, second, third = (tmp_path / f"drive{part}.lcmlog" for part in ("", "-2", "-3"))
    with Recorder(log) as recorder:
        recorder.send_until(lambda: log.exists() and recorder.sent > 250)
        recorder.kill_logger()
        recorder.send_until(second.exists)
        recorder.kill_logger()
        recorder.send_until(lambda: recorder.says(health_t.FAULT))
        took = recorder.send_until(third.exists)
        recorder.send_until(lambda: third.stat().st_size > 1_500_000)
        recorder.send_until(lambda: recorder.says(health_t.OK))
        code, said = recorder.end()
    assert took < 3.0 + BUSY_S
    assert code == 3 and said.count("lcm-logger ended with code -9") >= 2
    assert recorded_config(third) is not None and len(numbers(third)) > 10


def test_fault_p6_loggers_that_end_at_once_are_one_fault_until_one_goes_on(
    private_network: None, tmp_path: Path
) -> None:
    logs = [tmp_path / f"drive{part}.lcmlog" for part in ("", "-2", "-3", "-4", "-5")]
    with Recorder(logs[0]) as recorder:
        recorder.send_until(lambda: logs[0].exists() and recorder.sent > 250)
        for log in logs[:-1]:
            recorder.send_until(log.exists)
            recorder.kill_logger()
        recorder.send_until(lambda: recorder.says(health_t.OK))
        assert recorder.states == [health_t.FAULT, health_t.OK]
        told = recorder.heard
        recorder.send_until(lambda: recorder.heard >= told + 3, seconds=3.0 + BUSY_S)
        code, _ = recorder.end()
    assert code == 3 and len(numbers(logs[-1])) > 10


def test_fault_t1_a_recording_that_names_itself_never_meets_another_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    instant = datetime(2026, 1, 2, 3, 4, 5)
    for _ in range(3):
        default_name(instant).touch()  # as often as the clock is set back to it
    Path("ignis-20260102-030406.lcmlog.00").touch()  # one that is split
    assert default_name(instant.replace(second=6)) == Path("ignis-20260102-030406-2.lcmlog")
    assert len(list(tmp_path.iterdir())) == 4
