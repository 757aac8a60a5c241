# SPDX-License-Identifier: Apache-2.0
"""Row B7 between two computers: each has a driver, both on one bus (TTL 1). All name it and go by the first."""

import contextlib
import itertools
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from vehicle_two_computers_test import CONFIG, SCENE, URL, Computer, join, must

LISTEN_S = 8.0
FAULT = 3
TAKEN = f"""
import json, time, lcm
from ignis_lcm.ignis import health_t
bus = lcm.LCM("{URL}")
newest, taken, told = {{}}, {{}}, {{}}
def note(_, data):
    health = health_t.decode(data)
    name = f"{{health.process}} {{health.pid}}"
    newest[name] = [health.state, health.state_text]
    told.setdefault(health.process, []).append(health.state_text)
    for channel, count in zip(health.channels, health.received):
        taken.setdefault(f"{{name}} {{channel}}", []).append([health.uptime_s, count])
bus.subscribe("HEALTH", note)
end = time.monotonic() + {LISTEN_S}
while time.monotonic() < end:
    bus.handle_timeout(100)
print(json.dumps([newest, taken, told]))
"""
# Repeats what a log of another day holds: HEALTH of the processes named on the command line, and inertial samples.
PLAY = f"""
import sys, time, lcm
from ignis_lcm.ignis import health_t, imu_t
bus = lcm.LCM("{URL}")
for turn in range(900):
    for name in sys.argv[1:] if turn % 100 == 0 else ():
        health = health_t()
        health.process, health.pid, health.config_hash, health.uptime_s = name, 7, "of another day", turn / 100
        bus.publish("HEALTH", health.encode())
    bus.publish("L1_IMU", b"not a message")
    time.sleep(0.01)
"""


def start_driver(computer: Computer) -> subprocess.Popen:
    tty = computer.folder / "l1.pty"
    simulator = computer.start("l1_sim", "--scene", SCENE, "--config", CONFIG, "--pty", tty, "--wait", 30)
    while not tty.is_symlink():
        assert simulator.poll() is None
        time.sleep(0.05)
    return computer.start("l1_driver", "--config", CONFIG, "--lcm-url", URL, "--port", tty)


@dataclass
class Heard:
    """What HEALTH told for a while: of each process the newest state and text, its counts over time, and all texts."""

    newest: dict[str, tuple[int, str]]
    counts: dict[str, list[tuple[float, int]]]
    told: dict[str, list[str]]

    def of(self, name: str) -> tuple[int, str]:
        """State and text of the one process of this name."""
        (found,) = (value for key, value in self.newest.items() if key.split()[0] == name)
        return found

    def rates(self, name: str, channel: str) -> tuple[float, float]:
        """Messages that it took from a channel [1/s]: in the median second, in which no simulator on a busy computer
        makes up for the one before, and over all the time."""
        (series,) = (
            value for key, value in self.counts.items() if key.split()[0] == name and key.split()[2] == channel
        )
        (began_s, first), (ended_s, last) = series[0], series[-1]
        each = [(count - before) / (s - before_s) for (before_s, before), (s, count) in itertools.pairwise(series)]
        return statistics.median(each), (last - first) / (ended_s - began_s)


def hear(computer: Computer) -> Heard:
    heard = computer.run(sys.executable, "-c", TAKEN)
    assert heard.returncode == 0, heard.stderr[-500:]
    return Heard(*json.loads(heard.stdout))


def test_fault_b7_a_second_driver_on_another_computer_is_named_by_every_process_and_not_listened_to(
    tmp_path: Path,
) -> None:
    folders = [tmp_path / name for name in ("near", "far")]
    for folder in folders:
        folder.mkdir()
    near, far = (Computer(folder) for folder in folders)
    try:
        join(near, far)
        near.start("lio_frontend", "--config", CONFIG, "--lcm-url", URL)
        first = start_driver(near)
        time.sleep(2.0)
        alone = hear(near)
        second = start_driver(far)
        time.sleep(4.0)
        both = hear(near)
        second.terminate()
        second.wait(20)
        time.sleep(3.5)
        again = hear(near)
    finally:
        near.close()
        far.close()
    print(alone, both, again, sep="\n")
    drivers = sorted(name for name in both.newest if name.startswith("l1_driver"))
    assert len(drivers) == 2
    assert "l1_driver" not in alone.of("lio_frontend")[1]
    for name in drivers:
        state, text = both.newest[name]
        assert state == FAULT and "a second l1_driver is on the bus" in text
    state, text = both.of("lio_frontend")
    assert state == FAULT and "two instances of l1_driver are on the bus" in text
    assert f"l1_driver {second_pid(drivers, alone)} came later and is not listened to" in text
    assert "l1_driver" not in again.of("lio_frontend")[1]
    rates = [heard.rates("lio_frontend", "L1_IMU") for heard in (alone, both, again)]
    assert [usual for usual, _ in rates] == pytest.approx([250.0] * 3, rel=0.04), "of the first driver, and of it alone"
    assert [mean for _, mean in rates] == pytest.approx([250.0] * 3, rel=0.2), "nor for two seconds of the other"
    assert first.returncode is None or first.returncode == 0


def second_pid(drivers: list[str], alone: Heard) -> str:
    """Process id of the driver that was not there before."""
    (name,) = set(drivers) - set(alone.newest)
    return name.split()[1]


@contextlib.contextmanager
def front_end_on_a_bus(folder: Path) -> Iterator[Computer]:
    """A computer of its own on which a front end listens."""
    computer = Computer(folder)
    try:
        for words in (("link", "set", "lo", "up", "multicast", "on"), ("route", "add", "224.0.0.0/4", "dev", "lo")):
            must(computer.run("ip", *words))
        computer.start("lio_frontend", "--config", CONFIG, "--lcm-url", URL)
        yield computer
    finally:
        computer.close()


@pytest.mark.parametrize(
    ("names", "ignored"), [(["l1_driver"], True), (["l1_driver", "map_builder", "graph_backend"], False)]
)
def test_fault_b7_who_plays_a_log_of_many_processes_is_named_and_still_heard(
    tmp_path: Path, names: list[str], ignored: bool
) -> None:
    with front_end_on_a_bus(tmp_path) as computer:
        start_driver(computer)
        time.sleep(2.0)
        player = subprocess.Popen(computer.line(sys.executable, "-c", PLAY, *names))
        heard = hear(computer)
        player.terminate()
        player.wait(10)
    print(heard)
    text = heard.of("lio_frontend")[1]
    assert "two instances of l1_driver are on the bus" in text
    assert ("l1_driver 7 came later and is not listened to" in text) == ignored
    assert ("L1_IMU: " in text) != ignored, "what it sends is no message, which is told only of what is heard"


def test_fault_b7_two_that_have_the_same_process_id_are_named_and_the_later_one_not_listened_to(
    tmp_path: Path,
) -> None:
    with front_end_on_a_bus(tmp_path) as computer:
        time.sleep(2.0)
        players = []
        for _ in range(2):
            players.append(subprocess.Popen(computer.line(sys.executable, "-c", PLAY, "l1_driver")))
            time.sleep(2.0)
        heard = hear(computer)
        for player in players:
            player.terminate()
            player.wait(10)
    print(heard)
    texts = heard.told["lio_frontend"]
    assert any("two instances of l1_driver are on the bus (processes 7 at " in text for text in texts)
    assert any("l1_driver 7 came later and is not listened to" in text for text in texts)
