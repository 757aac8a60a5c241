# SPDX-License-Identifier: Apache-2.0
"""Rows C4, B7 and P7: processes that do not belong together, a second instance, and one that ends again and again."""

import os
import random
import re
import select
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from vehicle_peers import health

from fault_drive import BUS, CHECKOUT, CONFIG
from ignis.bus import Listener
from ignis.pipeline import Pipeline, binary
from ignis.supervision import PAUSE, S6Supervisor

# Neither reads from a sensor nor opens a port.
PAIR = ("lio_frontend", "graph_backend")
FAULT_WITHIN_S = 2.0
BUSY_S = 1.5  # that a busy machine may add
SCRIPT = Path("cmake") / "BuildId.cmake"
STARTS = 5
LOOP_S = 10.0
STOPS = 400
ASLEEP_S = 1.0
PAUSE_S = 1.5  # less than the pause takes
TAI_AHEAD = 2**62 + 10  # [s] of TAI64, before 1970
SEED = 20261125
END_AT_ONCE = "echo no sensor today; exit 3"


class Bus:
    """What the processes say of themselves."""

    def __init__(self, pipeline: Pipeline) -> None:
        self.pipeline = pipeline
        self.listener = Listener(BUS, "HEALTH")

    def start(self, process: str, config: Path = CONFIG) -> None:
        """Starts a process and waits for its first word."""
        self.pipeline.start(process, "--config", config)
        self.wait(lambda: self.health(process) is not None)

    def health(self, process: str) -> Any:
        """The newest HEALTH of a process."""
        found = [entry for (name, _), entry in self.listener.health.items() if name == process]
        return max(found, key=lambda entry: entry[0])[1] if found else None

    def wait(self, holds: Callable[[], bool], seconds: float = 20.0) -> float:
        """Seconds until it held."""
        began = time.monotonic()
        while not holds():
            assert time.monotonic() - began < seconds, {
                key: entry[1].state_text for key, entry in self.listener.health.items()
            }
            self.listener.listen(0.05)
        return time.monotonic() - began

    def is_fault(self, process: str, words: str) -> bool:
        """Whether a process calls itself FAULT and says these words."""
        newest = self.health(process)
        return newest is not None and newest.state == newest.FAULT and words in newest.state_text


def test_fault_c4_processes_that_disagree_are_a_fault_within_two_seconds_and_keep_what_they_loaded(
    private_network: None, tmp_path: Path
) -> None:
    file = tmp_path / "config.json"
    shutil.copy(CONFIG, file)
    with Pipeline(tmp_path, BUS) as pipeline:
        bus = Bus(pipeline)
        bus.start("lio_frontend", file)
        before = bus.health("lio_frontend")
        # The file is edited while one process runs and before the other starts.
        text = file.read_text()
        file.write_text(text.replace('"keyframe_dist_m": ', '"keyframe_dist_m": 1'))
        assert file.read_text() != text
        bus.start("graph_backend", file)
        took = bus.wait(lambda: all(bus.is_fault(name, "configuration differs") for name in PAIR))
        after = bus.health("lio_frontend")
    assert took < FAULT_WITHIN_S + BUSY_S
    assert after.config_hash == before.config_hash != bus.health("graph_backend").config_hash


def test_fault_c4_two_builds_of_one_release_are_a_fault_within_two_seconds(
    private_network: None, tmp_path: Path
) -> None:
    with Pipeline(tmp_path, BUS) as pipeline:
        bus = Bus(pipeline)
        bus.start("lio_frontend")
        ours = bus.health("lio_frontend")
        bus.listener.listen(1.5)
        assert not bus.is_fault("lio_frontend", "version")
        release, _, sources = ours.version.partition("+")
        assert sources, "a release alone does not tell two builds of it apart"
        other = health("graph_backend", config_hash=ours.config_hash, version=f"{release}+000000000000")
        began = time.monotonic()
        while not bus.is_fault("lio_frontend", f"version {ours.version} differs from {other.version} of graph_backend"):
            assert time.monotonic() - began < FAULT_WITHIN_S + BUSY_S
            bus.listener.bus.publish("HEALTH", other.encode())
            bus.listener.listen(0.2)


def run_script(source: Path, header: Path) -> str:
    """What a build of these sources is called."""
    command = ["cmake", f"-DSOURCE={source}", f"-DHEADER={header}", "-DVERSION=1.2.3", "-P", CHECKOUT / SCRIPT]
    subprocess.run(command, check=True)
    return header.read_text().split('"')[1]


def test_fault_c4_a_build_is_called_by_its_sources_with_or_without_git(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    for tree in (first, second):
        for folder in ("apps", "cmake", "lcmtypes", "src"):
            shutil.copytree(CHECKOUT / folder, tree / folder, ignore=shutil.ignore_patterns("node_modules"))
        shutil.copy(CHECKOUT / "CMakeLists.txt", tree)
    header = tmp_path / "build_id.h"
    name = run_script(first, header)
    assert re.fullmatch(r"1\.2\.3\+[0-9a-f]{12}", name)
    written = header.stat().st_mtime_ns
    assert run_script(second, header) == name, "wherever they stand"
    assert header.stat().st_mtime_ns == written, "nothing is compiled anew"
    # No program is made of what tests and editors leave behind.
    (second / "src" / "notes.txt~").write_text("mine")
    assert run_script(second, header) == name
    source = second / "src" / "common" / "pose.cpp"
    source.write_bytes(source.read_bytes() + b"\n")
    assert run_script(second, header) != name
    source.unlink()
    assert run_script(second, header) not in (name, run_script(first, header))


def test_fault_b7_a_second_instance_of_any_process_refuses_to_start_and_the_first_goes_on(
    private_network: None, tmp_path: Path
) -> None:
    with Pipeline(tmp_path, BUS) as pipeline, Pipeline(tmp_path / "second", BUS) as seconds:
        bus = Bus(pipeline)
        for name in PAIR:
            pipeline.start(name, "--config", CONFIG)
        bus.wait(lambda: all(bus.health(name) for name in PAIR))
        for name in PAIR:
            assert seconds.start(name, "--config", CONFIG).wait(20.0) == 1
            assert f"another {name} is on the bus" in seconds.last_words(name)
        bus.listener.listen(1.5)
        pipeline.check()
        assert all("second" not in bus.health(name).state_text for name in PAIR)


def test_fault_p7_a_process_that_is_killed_and_started_again_and_again_is_a_fault_to_the_others(
    private_network: None, tmp_path: Path
) -> None:
    with Pipeline(tmp_path, BUS) as pipeline:
        bus = Bus(pipeline)
        bus.start("graph_backend")
        for _ in range(STARTS):
            process = pipeline.start("lio_frontend", "--config", CONFIG)
            bus.wait(lambda pid=process.pid: ("lio_frontend", pid) in bus.listener.health)
            process.kill()
            process.wait()
        bus.wait(lambda: bus.is_fault("graph_backend", f"lio_frontend was started {STARTS} times within 60 s"))


def test_fault_p7_a_process_that_ends_at_once_is_started_ever_later_and_the_others_go_on(
    private_network: None, tmp_path: Path
) -> None:
    commands = {
        "lio_frontend": [str(binary("lio_frontend")), "--config", str(CONFIG)],
        "l1_driver": ["/bin/sh", "-c", END_AT_ONCE],
    }
    supervisor = S6Supervisor(tmp_path / "state", commands, {"LCM_DEFAULT_URL": BUS})
    log = tmp_path / "state" / "log" / "l1_driver" / "current"
    began = time.monotonic()
    late = supervisor.start(LOOP_S)
    try:
        assert len(late) == 1 and late[0].startswith("l1_driver (ended "), late
        assert "exitcode 3: no sensor today" in late[0]
        listener = Listener(BUS, "HEALTH")
        heard_by = time.monotonic() + 1.5 + BUSY_S
        while not any(name == "lio_frontend" for name, _ in listener.health):
            assert time.monotonic() < heard_by, "the others go on"
            listener.listen(0.1)
        while "next start in 10 s" not in log.read_text():
            assert time.monotonic() - began < 3 * LOOP_S, log.read_text()
            time.sleep(0.05)
    finally:
        stopping = time.monotonic()
        supervisor.stop()
    assert time.monotonic() - stopping < 8.0, "a process that waits for its start is ended at once"
    said = log.read_text()
    print(f"{time.monotonic() - began:.0f} s\n{said}")
    assert said.count("no sensor today") == STARTS + 1, "without growing waits there would be one a second"
    assert "ended 4 times within a minute, at last with exitcode 3; next start in 2 s" in said
    assert "next start in 5 s" in said


def parent_of(pid: int) -> int:
    """The process that started this one."""
    stat = Path(f"/proc/{pid}/stat").read_text()
    return int(stat.rpartition(")")[2].split()[1])


def test_fault_p7_a_stop_is_not_undone_by_the_look_whether_it_is_done(tmp_path: Path) -> None:
    supervisor = S6Supervisor(tmp_path / "state", {"l1_driver": ["/bin/sh", "-c", "echo >&3; exec sleep 60"]}, {})
    assert supervisor.start(LOOP_S) == []
    shown = subprocess.check_output(["s6-svstat", "-o", "pid", str(supervisor.scan / "l1_driver")], text=True)
    scanner = parent_of(parent_of(int(shown)))
    # What is written to one that does not get round to reading is read in one go.
    os.kill(scanner, signal.SIGSTOP)
    waking = threading.Timer(ASLEEP_S, os.kill, (scanner, signal.SIGCONT))
    waking.start()
    stopping = time.monotonic()
    supervisor.stop()
    waking.join()
    assert time.monotonic() - stopping < 8.0
    assert not supervisor.running()


def test_fault_p7_a_stop_ends_the_pause_before_a_start_whenever_it_comes(tmp_path: Path) -> None:
    deaths = f"@{int(time.time()) + TAI_AHEAD:016x}00000000 exitcode 3\n" * 4
    (tmp_path / "deaths").write_text(deaths)
    svdt = tmp_path / "s6-svdt"
    svdt.write_text(f"#!/bin/sh\ncat {tmp_path}/deaths\n")
    svdt.chmod(0o755)
    environment = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    print("seed", SEED)
    generator = random.Random(SEED)
    for _ in range(STOPS):
        with subprocess.Popen(
            ["/bin/sh", "-c", PAUSE], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment
        ) as waiting:
            assert waiting.stdout is not None
            assert b"next start in 2 s" in waiting.stdout.readline()
            time.sleep(generator.uniform(0.0, 0.002))
            waiting.terminate()
            waiting.wait()
            # Its logger waits for the end of the pipe, and s6 waits for the logger.
            assert select.select([waiting.stdout], [], [], PAUSE_S)[0], "a sleep lives on"
