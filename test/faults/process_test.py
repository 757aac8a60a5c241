# SPDX-License-Identifier: Apache-2.0
"""Rows P7 and P8 at the real processes: stopped at any moment, frozen, out of memory; and a full disk."""

import contextlib
import math
import os
import random
import resource
import signal
import socket
import subprocess
import time
from pathlib import Path

import lcm
import pytest

from fault_drive import BUS, CONFIG, PORT, FaultRun, Seen
from ignis.pipeline import Pipeline, binary

PROCESSES = ("lio_frontend", "graph_backend", "map_builder", "l1_driver")
SEED = 77
STOPS = 6
STOP_WITHIN_S = 2.0
LOST_AT_S, BACK_AT_S = 2.0, 4.2  # the multicast route; a drive that is silent for three seconds begins anew
FAULT_WITHIN_S = RESUMED_WITHIN_S = 1.0
BUSY_S = 0.5  # that a busy machine may add
MUTE = "nothing can be sent to the bus"
LEAST_VOXEL_SHARE = 0.99  # two drives in real time are never quite the same


def arguments(process: str, folder: Path) -> list[object]:
    """What the process needs beside its configuration."""
    if process == "map_builder":
        return ["--port", PORT, "--out", folder / "map"]
    if process == "graph_backend":
        return ["--journal", folder / "journal"]
    if process == "l1_driver":
        # A device that exists and never says anything.
        return ["--port", os.ttyname(os.openpty()[1])]
    return []


@pytest.mark.parametrize("process", PROCESSES)
def test_fault_p7_sigterm_at_any_moment_is_a_clean_end(process: str, private_network: None, tmp_path: Path) -> None:
    generator = random.Random(SEED)
    more = arguments(process, tmp_path)
    waits = [generator.uniform(0.0, 0.5) for _ in range(STOPS)]
    print("seed", SEED, "waits", waits)
    for wait in waits:
        with Pipeline(tmp_path, BUS) as pipeline:
            started = pipeline.start(process, "--config", CONFIG, *more)
            # Until its signal handlers stand, the system's own end applies; from then on the end is ours.
            caught = Path(f"/proc/{started.pid}/status")
            deadline = time.monotonic() + 20.0
            while not int(
                next(line for line in caught.read_text().splitlines() if line.startswith("SigCgt")).split()[1], 16
            ) & (1 << (signal.SIGTERM - 1)):
                assert time.monotonic() < deadline
                time.sleep(0.005)
            time.sleep(wait)
            began = time.monotonic()
            started.terminate()
            assert started.wait(20.0) == 0, pipeline.last_words(process)
            assert time.monotonic() - began < STOP_WITHIN_S
    assert not list(tmp_path.rglob("*.tmp")), "nothing half-written stays behind"


def test_fault_p8_a_replay_without_memory_ends_with_a_message_and_no_half_file(
    drive_log: Path, run_binary, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    replay = [str(argument) for argument in (binary("lio_replay"), drive_log, "--config", CONFIG, "--out", out)]
    subprocess.run(replay, check=True, capture_output=True, timeout=60.0)
    before = {path: path.read_bytes() for path in out.rglob("*")}
    done = subprocess.run(["prlimit", f"--as={120 * 2**20}", *replay], capture_output=True, text=True, timeout=60.0)
    assert done.returncode == 1 and "bad_alloc" in done.stderr, done.stderr[-300:]
    # It ends before it has results: those of the run before stand as they were, and nothing beside them.
    assert before and {path: path.read_bytes() for path in out.rglob("*")} == before


def address_space(pid: int) -> int:
    """[bytes] in use."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")


def test_fault_p8_without_memory_in_mid_drive_a_process_ends_with_a_message(
    drive_log: Path, private_network: None, tmp_path: Path
) -> None:
    checkpoint = tmp_path / "checkpoint"
    run = FaultRun(tmp_path, frontend_options=("--checkpoint", checkpoint))
    with run:
        limited: dict[str, subprocess.Popen] = {}
        player = run.pipeline.start("lcm-logplayer", "--speed=2", "--regexp=L1_(IMU|SCAN)", drive_log)
        end = time.monotonic() + 3.0
        while time.monotonic() < end:
            run.bus.handle_timeout(50)
        for name in ("lio_frontend", "map_builder"):
            process = limited[name] = run.pipeline.processes[name]
            limit = address_space(process.pid)
            resource.prlimit(process.pid, resource.RLIMIT_AS, (limit, limit))
        player.wait(60.0)
        time.sleep(1.0)
        for name, process in limited.items():
            said = run.pipeline.last_words(name)
            print(name, process.poll(), said)
            # What it has set aside may last; then nothing has gone wrong.
            assert process.poll() is None or (process.poll() == 1 and "alloc" in said), (name, process.poll(), said)
        assert any(process.poll() is not None for process in limited.values()), "the limit must bite"
        # The front end writes files all the time: what stands there is whole, and a successor goes on with it.
        assert list(checkpoint.glob("keyframe_*"))
        run.killed.update(limited)
        run.kill_and_restart("lio_frontend")
        run.listen(2.0)
        newest = run.seen.health["lio_frontend"][-1]
        assert newest.pid == run.pipeline.processes["lio_frontend"].pid and "resumed" in newest.state_text
    assert not list(tmp_path.rglob("*.tmp"))


def test_fault_b3_a_receiver_frozen_for_two_seconds_loses_nothing(
    drive_log: Path, undisturbed: Seen, tmp_path: Path
) -> None:
    generator = random.Random(SEED)
    with FaultRun(tmp_path) as run:
        frozen_at = generator.uniform(1.5, 2.5)
        frontend = run.pipeline.processes["lio_frontend"]
        state = {"frozen": False, "done": False}

        def meanwhile(seconds: float) -> None:
            if seconds > frozen_at and not state["frozen"]:
                state["frozen"] = True
                frontend.send_signal(signal.SIGSTOP)
            # The log plays at twice its speed: one second of wall time holds what two of the sensor's do.
            if seconds > frozen_at + 1.0 and not state["done"]:
                state["done"] = True
                frontend.send_signal(signal.SIGCONT)

        run.play(drive_log, meanwhile)
        newest = run.seen.health["lio_frontend"][-1]
        lost = dict(zip(newest.channels, newest.lost, strict=True))
    assert state["done"] and lost["L1_IMU"] == lost["L1_SCAN"] == 0
    assert run.seen.keyframes == undisturbed.keyframes


class LostRoute:
    """Takes the multicast route away in mid-drive and gives it back; notes when who says what of it."""

    route = ("224.0.0.0/4", "dev", "lo")

    def __init__(self, run: FaultRun, names: tuple[str, ...], supervisor: socket.socket) -> None:
        self._run, self._names, self._supervisor = run, names, supervisor
        supervisor.setblocking(False)
        self.at: dict[str, float] = {}
        self.statuses = 0  # that name the loss
        self._states = 0

    def look(self, seconds: float) -> None:
        """Called often with the seconds since the drive began."""
        if seconds > LOST_AT_S and "lost" not in self.at:
            subprocess.run(["ip", "route", "del", *self.route], check=True)
            self.at["lost"] = time.monotonic()
        for name in self._names:
            if MUTE in self._run.pipeline.last_words(name):
                self.at.setdefault(name, time.monotonic())
        with contextlib.suppress(BlockingIOError):
            while message := self._supervisor.recv(4096).decode():
                self.statuses += message.startswith("STATUS=") and MUTE in message
                if self.statuses == len(self._names):
                    self.at.setdefault("supervisor", time.monotonic())
        if seconds > BACK_AT_S and "back" not in self.at:
            self._states = len(self._run.seen.states)
            self.give_back()
            self.at["back"] = time.monotonic()
        if "back" in self.at and len(self._run.seen.states) > self._states:
            self.at.setdefault("flow", time.monotonic())

    def give_back(self) -> None:
        """There is a route again, or still."""
        subprocess.run(["ip", "route", "replace", *self.route], check=True)


def test_fault_b7_a_route_lost_in_mid_drive_is_a_fault_within_a_second_and_its_return_resumes(
    drive_log: Path, tmp_path: Path
) -> None:
    # The one sends all the time, the other little but HEALTH.
    names = ("lio_frontend", "graph_backend")
    run = FaultRun(tmp_path, names)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as supervisor:
        supervisor.bind(str(tmp_path / "notify"))
        run.pipeline.environment["NOTIFY_SOCKET"] = str(tmp_path / "notify")
        with run:
            lost = LostRoute(run, names, supervisor)
            try:
                run.play(drive_log, lost.look, speed=1.0)
            finally:
                lost.give_back()
    print({what: round(when - lost.at["lost"], 2) for what, when in lost.at.items()})
    for who in (*names, "supervisor"):
        assert lost.at.get(who, math.inf) - lost.at["lost"] < FAULT_WITHIN_S + BUSY_S
    assert lost.at["flow"] - lost.at["back"] < RESUMED_WITHIN_S + BUSY_S
    for name in names:
        told = [message for message in run.seen.health[name] if message.failed_sends > 0]
        assert told[0].state == told[0].FAULT and MUTE in told[0].state_text, "the first that gets through"
        assert any("nothing could be sent to the bus for" in message.state_text for message in told)
        assert told[-1].state != told[-1].FAULT, "and then it is over"


def test_fault_l1_a_full_disk_ends_replay_and_map_with_the_path_and_no_half_file(
    drive_log: Path, run_binary, private_network: None, tmp_path: Path
) -> None:
    full = tmp_path / "full"
    full.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", full], check=True)
    try:
        done = run_binary("lio_replay", drive_log, "--config", CONFIG, "--out", full / "run", seconds=120.0)
        assert done.returncode == 1 and str(full) in done.stderr
        assert not list(full.rglob("*.tmp"))
    finally:
        subprocess.run(["umount", full], check=True)


def test_fault_p6_a_killed_logger_costs_the_log_at_most_a_tenth_of_a_second(
    private_network: None, drive_log: Path, tmp_path: Path
) -> None:
    log = tmp_path / "killed.lcmlog"
    bus = lcm.LCM(BUS)
    with Pipeline(tmp_path, BUS) as pipeline:
        logger = pipeline.start("lcm-logger", "--quiet", "--flush-interval=50", log)
        time.sleep(1.0)
        sent = []
        end = time.monotonic() + 2.0
        while time.monotonic() < end:
            sent.append(time.time())
            bus.publish("L1_IMU", len(sent).to_bytes(8, "big"))
            time.sleep(0.004)
        logger.kill()
        logger.wait()
    from ignis.logs import read_log

    events = [event for event in lcm.EventLog(str(log), "r") if event.channel == "L1_IMU"]
    assert events and read_log(log) is not None
    kept = int.from_bytes(events[-1].data, "big")
    assert sent[-1] - sent[kept - 1] < 0.1 + 0.1, "0.1 s is promised; the machine may be busy"


@pytest.mark.parametrize("absence_s", [0.0, 0.5, 1.5])
def test_fault_p4_a_killed_map_goes_on_with_every_keyframe_and_all_of_its_voxels(
    drive_log: Path, undisturbed: Seen, tmp_path: Path, absence_s: float
) -> None:
    killed_at = random.Random(SEED).uniform(3.0, 5.0)
    with FaultRun(tmp_path, map_options=("--journal", tmp_path / "journal")) as run:
        waiting = ["kill", "start"]

        def meanwhile(seconds: float) -> None:
            if waiting == ["kill", "start"] and seconds > killed_at:
                run.kill("map_builder")
                waiting.remove("kill")
            if waiting == ["start"] and seconds > killed_at + absence_s:
                run.restart("map_builder")
                waiting.remove("start")

        run.play(drive_log, meanwhile)
        deadline, wanted = time.monotonic() + 10.0, len(run.seen.poses)
        while (status := run.view_status())["keyframes"] < wanted and time.monotonic() < deadline:
            run.listen(0.2)
        said = run.pipeline.last_words("map_builder", 20)
    shares = [mine / all_ for mine, all_ in zip(status["voxels"], undisturbed.status["voxels"], strict=True)]
    print("seed", SEED, "killed after", killed_at, "s; share of the voxels per level", shares, said)
    assert not waiting and len(undisturbed.poses) - 1 <= wanted <= status["keyframes"]
    assert "goes on with" in said
    assert min(shares) > LEAST_VOXEL_SHARE
