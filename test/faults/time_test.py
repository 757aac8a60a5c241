# SPDX-License-Identifier: Apache-2.0
"""Rows T1 and T2: the wall clock stepped in mid-drive, a computer that is up for 300 days, all processes frozen."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Self

import ignis_lcm.ignis as types
import pytest
from live_agreement import require_equal_up_to_the_first_drop

from fault_drive import BUS, CONFIG, FaultRun, Seen
from ignis.errors import EXIT_DAMAGED
from ignis.logs import read_events, read_log
from ignis.pipeline import Pipeline, binary
from ignis.run_folder import losses_in
from pty_relay import PtyRelay

UPTIME_S = 300 * 86_400
WAITING_S = 4.0  # with the sensor's messages on the bus all the time
BEFORE_S, FREEZE_S, AFTER_S = 4.0, 10.0, 3.0  # with what the sensor sends meanwhile lost
GAP_US = 300_000  # between two samples where nothing is wrong but the machine busy
MOST_HEALTH_A_SECOND = 7  # one each second, five when its text changes, and each change of the state
MOST_WORK = 2.0  # times what it was before
BUSY_S = 0.5
PHASE_S = 2.5  # of a drive between two steps of the clock
STAMP_ERROR_US = 2000
SETTLED = 250  # samples until the stamps are judged
SAME_PLACE = 1e-3  # [m]
PROCESSES = ("map_builder", "graph_backend", "lio_frontend")


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


class Recorder:
    """`./ignis record` under the stepped clock, into a file that it names itself. A context manager."""

    def __init__(self, run: SteppedRun, folder: Path) -> None:
        folder.mkdir()
        self._folder = folder
        command = [sys.executable, "-m", "ignis.record", "--config", str(CONFIG), "--lcm-url", BUS]
        self._process = subprocess.Popen(
            command, cwd=folder, env=run.pipeline.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.send_signal(signal.SIGINT)
        assert self._process.wait(20.0) in (0, 3)  # 3: a busy machine lost something

    def log(self) -> Path:
        """There is one."""
        (log,) = self._folder.iterdir()
        return log


def stamp_errors(log: Path) -> list[int]:
    """Of L1_IMU against the truth [us], once the driver has learnt the sensor's clock."""
    truth = {event.message.sequence: event.message.utime for event in read_log(log, ("GROUND_TRUTH",))}
    samples = [event.message for event in read_log(log, ("L1_IMU",)) if event.message.sequence > SETTLED]
    return [sample.utime - truth[sample.sequence] for sample in samples if sample.sequence in truth]


def test_fault_t1_steps_beneath_the_driver_and_the_recorder_move_no_stamp_and_keep_the_order(
    stepped_clock: Path, private_network: None, tmp_path: Path
) -> None:
    with SteppedRun(tmp_path, stepped_clock) as run:
        preload = run.pipeline.environment.pop("LD_PRELOAD")  # the sensor has a clock of its own
        port = run.start_sensor(tmp_path)
        run.pipeline.environment["LD_PRELOAD"] = preload
        with Recorder(run, tmp_path / "recorded") as recorder:
            run.listen(1.5)
            driver = run.pipeline.start("l1_driver", "--config", CONFIG, "--port", port)
            run.pipeline.wait_for_text("l1_driver", "reading", 20.0)
            assert str(stepped_clock) in Path(f"/proc/{driver.pid}/maps").read_text()
            for seconds in (0, -3600, 3600):
                run.step(seconds)
                run.listen(PHASE_S)
            run.step(0)
            run.pipeline.stop("l1_sim", "l1_driver", "lio_frontend", "graph_backend")
    log = recorder.log()
    written = [event.utime for event in read_events(log)]
    steps = [b - a for a, b in pairwise(written)]
    assert min(steps) < -3.5e9 and max(steps) > 7e9, "the recorder's clock was stepped in both directions"
    for channel in ("L1_IMU", "L1_SCAN", "LIO_STATE", "LIO_SCAN_STATS"):
        stamps = [event.message.utime for event in read_log(log, (channel,))]
        assert len(stamps) > 10 * PHASE_S and all(a < b for a, b in pairwise(stamps)), channel
    errors = stamp_errors(log)
    print(f"{len(errors)} stamps, the worst {max(map(abs, errors))} us off")
    assert len(errors) > 200 * PHASE_S and max(map(abs, errors)) < STAMP_ERROR_US
    command = [sys.executable, "-m", "ignis.replay", log, "--out", tmp_path / "replayed", "--no-page"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=120, check=False)
    report = json.loads((tmp_path / "replayed" / "report.json").read_text())
    assert done.returncode == (EXIT_DAMAGED if losses_in(report) else 0), done.stderr
    require_equal_up_to_the_first_drop(report)


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
                time.sleep(WAITING_S - 0.5)
            if passed > 2.0 + WAITING_S and math.isinf(state["woken"]):
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


class Freeze:
    """What driver, front end, back end and map say while a sensor runs on and they do not for a while."""

    def __init__(self, run: FaultRun, port: Path) -> None:
        self._run = run
        run.pipeline.start("l1_driver", "--config", CONFIG, "--port", port)
        self.epochs: list[int] = []  # one after the other
        self.stamps: list[int] = []  # of L1_IMU
        run.bus.subscribe("L1_STATUS", self._on_status)
        run.bus.subscribe("L1_IMU", self._on_imu).set_queue_capacity(20_000)

    def _on_status(self, _: str, data: bytes) -> None:
        epoch = types.driver_status_t.decode(data).clock_epoch
        if epoch not in self.epochs[-1:]:
            self.epochs.append(epoch)

    def _on_imu(self, _: str, data: bytes) -> None:
        self.stamps.append(types.imu_t.decode(data).utime)

    def freeze(self, seconds: float) -> None:
        """Stops all of them, and only them: to a computer that wakes up the sensor has gone on."""
        group = [self._run.pipeline.processes[name] for name in (*PROCESSES, "l1_driver")]
        for process in group:
            process.send_signal(signal.SIGSTOP)
        self._run.listen(seconds)
        for process in group:
            process.send_signal(signal.SIGCONT)

    def work(self) -> dict[str, float]:
        """Seconds of a processor so far."""
        return {name: self._run.work(name) for name in (*PROCESSES, "l1_driver")}

    def told(self) -> dict[str, int]:
        """How many HEALTH messages so far."""
        return {name: len(self._run.seen.health[name]) for name in (*PROCESSES, "l1_driver")}


def test_fault_t2_all_frozen_with_the_driver_is_one_gap_with_one_epoch_change_and_no_storm(
    private_network: None, tmp_path: Path
) -> None:
    line = tmp_path / "line.pty"
    with FaultRun(tmp_path) as run, PtyRelay(run.start_sensor(tmp_path), line, drops=True):
        freeze = Freeze(run, line)
        run.listen(BEFORE_S)
        before = freeze.work(), freeze.told(), len(freeze.stamps)
        freeze.freeze(FREEZE_S)
        woken = freeze.work(), freeze.told(), len(freeze.stamps)
        run.listen(AFTER_S)
        after = freeze.work(), freeze.told()
        states, told = run.seen.states, run.seen.health["lio_frontend"]
        newest = told[-1]
        run.pipeline.stop("l1_driver", "l1_sim")
        run.listen(2.5)  # a full set of poses comes every two seconds
    gaps = [b - a for a, b in pairwise(freeze.stamps)]
    print("epochs", freeze.epochs, "gap", max(gaps), "work", before[0], woken[0], after[0], "told", woken[1], after[1])
    print([(health.state, health.state_text) for health in told[woken[1]["lio_frontend"] :]])
    # One gap, as long as the freeze, and stamps that are right again at once: the time line is one.
    assert min(gaps) > 0 and abs(max(gaps) - 1e6 * FREEZE_S) < 1e6 and sorted(gaps)[-2] < GAP_US
    assert len(freeze.epochs) <= 2, "one epoch change at most"
    assert all(a < b for a, b in pairwise(states)), "stamps of LIO_STATE ascend"
    # Longer than a pose can be carried: a session begins anew, and says so until it has begun.
    assert newest.state != newest.OK and "neither IMU data nor scans came for" in newest.state_text, newest.state_text
    assert newest.resets > told[0].resets
    assert set(run.seen.poses) == set(run.seen.keyframes), "the graph has every keyframe"
    # No storm: what did not happen meanwhile is not made up for.
    for name in (*PROCESSES, "l1_driver"):
        assert after[1][name] - woken[1][name] <= MOST_HEALTH_A_SECOND * AFTER_S, name
        worked = after[0][name] - woken[0][name]
        assert worked < MOST_WORK * before[0][name] / BEFORE_S * AFTER_S + BUSY_S, (name, worked)
