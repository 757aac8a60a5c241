# SPDX-License-Identifier: Apache-2.0
"""Rows T1 and T2: the wall clock stepped in mid-drive, a computer that is up for 300 days, all processes frozen."""

import math
import os
import signal
import subprocess
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from fault_drive import BUS, FaultRun, Seen
from ignis.pipeline import Pipeline, binary

HERE = Path(__file__).resolve().parent
UPTIME_S = 300 * 86_400
FREEZE_S = 4.0
SAME_PLACE = 1e-3  # [m]
PROCESSES = ("map_builder", "graph_backend", "lio_frontend")


@pytest.fixture(scope="module")
def stepped_clock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library that moves the wall clock of whoever loads it."""
    library = tmp_path_factory.mktemp("clock") / "stepped_clock.so"
    source = HERE / "stepped_clock.c"
    subprocess.run(["cc", "-Wall", "-Werror", "-shared", "-fPIC", "-O1", source, "-o", library], check=True)
    return library


class SteppedRun(FaultRun):
    """The processes with a wall clock that the test steps."""

    def __init__(self, folder: Path, library: Path) -> None:
        super().__init__(folder)
        self._step = folder / "step"
        self.step(0)
        self.pipeline.environment |= {"LD_PRELOAD": str(library), "STEPPED_CLOCK": str(self._step)}

    def step(self, seconds: int) -> None:
        """From now on the wall clock is off by this much."""
        new = self._step.with_suffix(".new")
        new.write_text(str(seconds))
        os.replace(new, self._step)

    def play(self, log: Path, meanwhile: Callable[[float], None] = lambda _: None, speed: float = 2.0) -> None:
        del self.pipeline.environment["LD_PRELOAD"]  # the player is no part of the vehicle
        super().play(log, meanwhile, speed)


class LongUpPipeline(Pipeline):
    """Our processes in a time namespace whose clocks say that the computer has been up for 300 days."""

    def start(self, name: str, *arguments: object, listen_fd: int | None = None) -> subprocess.Popen:
        if not binary(name).exists():
            return super().start(name, *arguments, listen_fd=listen_fd)
        clocks = ("-T", "--monotonic", UPTIME_S, "--boottime", UPTIME_S)
        process = super().start("unshare", *clocks, binary(name), *arguments, listen_fd=listen_fd)
        (self.logs / "unshare.log").rename(self.logs / f"{name}.log")
        self.processes[name] = self.processes.pop("unshare")
        return process


def largest_distance(seen: Seen, other: Seen) -> float:
    """Of a keyframe in both graphs [m]; infinite when they do not hold the same ones."""
    if seen.poses.keys() != other.poses.keys():
        return math.inf
    return max(math.dist(seen.poses[i][:3], other.poses[i][:3]) for i in seen.poses)


def assert_like(seen: Seen, other: Seen) -> None:
    assert seen.keyframes == other.keyframes, "keyframes are equal byte for byte"
    assert largest_distance(seen, other) < SAME_PLACE
    assert all(a < b for a, b in pairwise(seen.states)), "stamps of LIO_STATE ascend"


def test_the_preloaded_clock_is_believed(stepped_clock: Path, tmp_path: Path) -> None:
    step = tmp_path / "step"
    step.write_text("-3600")
    environment = {**os.environ, "LD_PRELOAD": str(stepped_clock), "STEPPED_CLOCK": str(step)}
    said = subprocess.run(["date", "+%s"], env=environment, capture_output=True, text=True, check=True).stdout
    assert abs(int(said) + 3600 - time.time()) < 5


@pytest.mark.parametrize("seconds", [3600, -3600, -50 * 365 * 86_400])
def test_fault_t1_a_step_of_the_wall_clock_in_mid_drive_changes_nothing(
    seconds: int, stepped_clock: Path, drive_log: Path, undisturbed: Seen, tmp_path: Path
) -> None:
    with SteppedRun(tmp_path, stepped_clock) as run:
        for process in run.pipeline.processes.values():
            assert str(stepped_clock) in Path(f"/proc/{process.pid}/maps").read_text()
        run.play(drive_log, lambda passed: run.step(seconds if passed > 2.5 else 0))
        status = run.view_status()
    assert_like(run.seen, undisturbed)
    assert status["keyframes"] == undisturbed.status["keyframes"]
    for process in PROCESSES:
        latest = run.seen.health[process][-1]
        assert 0.0 <= latest.latency_ms < 2000.0, (process, latest.latency_ms)


def test_fault_t2_a_computer_that_is_up_for_300_days_gives_the_same_keyframes(
    drive_log: Path, undisturbed: Seen, tmp_path: Path
) -> None:
    run = FaultRun(tmp_path)
    run.pipeline = LongUpPipeline(tmp_path, BUS)
    with run:
        pid = run.pipeline.processes["lio_frontend"].pid
        assert os.readlink(f"/proc/{pid}/ns/time") != os.readlink("/proc/self/ns/time")
        run.play(drive_log)
    assert_like(run.seen, undisturbed)


def test_fault_t2_all_frozen_for_seconds_is_a_gap_of_the_sensor(drive_log: Path, tmp_path: Path) -> None:
    with FaultRun(tmp_path) as run:
        group = [run.pipeline.processes[name] for name in PROCESSES]
        state = {"frozen": False, "woken": math.inf}

        def meanwhile(passed: float) -> None:
            if passed > 2.0 and not state["frozen"]:
                state["frozen"] = True
                for process in group:
                    process.send_signal(signal.SIGSTOP)
                time.sleep(FREEZE_S - 0.5)
            if passed > 2.0 + FREEZE_S and math.isinf(state["woken"]):
                state["woken"] = passed
                for process in group:
                    process.send_signal(signal.SIGCONT)

        run.play(drive_log, meanwhile, speed=1.0)
        newest = run.seen.newest_with_data()
    assert state["frozen"] and math.isfinite(state["woken"])
    states = run.seen.states
    assert all(a < b for a, b in pairwise(states)), "stamps of LIO_STATE ascend"
    assert states[-1] - states[0] > 12_000_000, "the pose goes on after the freeze"
    assert newest.state == newest.OK, newest.state_text
    assert set(run.seen.poses) == set(run.seen.keyframes), "the graph has every keyframe"
