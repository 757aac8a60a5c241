# SPDX-License-Identifier: Apache-2.0
"""The systems of a benchmark, ours and the peers, each as a process of its own on the same core."""

import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ignis import trajectory_error
from ignis.benching.inputs import Drive
from ignis.environments import environment_python
from ignis.errors import EXIT_DAMAGED, InputError
from ignis.poses import Trajectory, read_tum
from ignis.run_folder import losses_in, read_json

OURS = ("ours: ESKF", "ours: smoothed")
PEERS = ("rko-lio", "kiss-icp", "kiss-slam", "genz-icp", "small-gicp")
CPU_LIMIT_S = 3600
_RUNNER = Path(__file__).with_name("peer_runner.py")


@dataclass
class Outcome:
    """What one system made of one drive."""

    system: str
    drive: Drive
    figures: dict[str, Any]  # of trajectory_error.errors_of, and the cost


def peers_python(requirements: Path, cache: Path) -> Path:
    """The Python of the peers' environment, made once per list of versions."""
    return environment_python("peers", requirements, cache)


def run_ours(lio_replay: Path, drive: Drive, config: Path, out: Path, core: int) -> list[Outcome]:
    """Replay of the whole pipeline. The ESKF's seconds are the front end's share of the process, as the peers' are
    those of their odometry; the smoothed trajectory's are the whole process's, and so is the memory of both."""
    command = [lio_replay, drive.log, "--config", config, "--out", out]
    reason, cost = _run_on(command, core, (0, EXIT_DAMAGED))
    if reason:
        return [Outcome(name, drive, {"failed": reason}) for name in OURS]
    report = read_json(out / "report.json")
    if losses := losses_in(report):
        print(f"WARNING: {drive.log}: {losses}", file=sys.stderr, flush=True)
    timing = report["timing"]
    cost |= {"scan_p50_ms": timing["scan_p50_ms"], "scan_p99_ms": timing["scan_p99_ms"]}
    # Stages are timed by the wall: only their share survives other work on the same core.
    share = timing["frontend"]["total_ms"] * 1e-3 / timing["wall_s"]
    front_end = cost | {"cpu_s": cost["cpu_s"] * share}
    return [
        _judged(OURS[0], drive, read_tum(out / "eskf.tum"), front_end),
        _judged(OURS[1], drive, read_tum(out / "smoothed.tum"), cost),
    ]


def run_peer(python: Path, name: str, drive: Drive, out: Path, core: int) -> Outcome:
    """A peer in its own environment, on one thread."""
    reason, cost = _run_on([python, _RUNNER, name, drive.sensor, drive.arrays, out, "--rest", drive.rest_s], core)
    if reason:
        return Outcome(name, drive, {"failed": reason})
    cost |= json.loads((out / "cost.json").read_text())
    try:
        trajectory = trajectory_error.in_our_axes(read_tum(out / "trajectory.tum"))
    except InputError as error:
        return Outcome(name, drive, {"failed": str(error)})
    return _judged(name, drive, trajectory, cost)


def _judged(name: str, drive: Drive, trajectory: Trajectory, cost: dict[str, float]) -> Outcome:
    if drive.truth is None:
        ends = trajectory.poses.position[[0, -1]]
        return Outcome(name, drive, {"end_to_start_m": float(np.linalg.norm(ends[1] - ends[0]))} | cost)
    try:
        pair = trajectory_error.paired(trajectory, read_tum(drive.truth))
        return Outcome(name, drive, trajectory_error.errors_of(pair, per_scan=False) | cost)
    except InputError as error:
        return Outcome(name, drive, {"failed": str(error)})


def _run_on(command: list[Any], core: int, allowed: tuple[int, ...] = (0,)) -> tuple[str, dict[str, float]]:
    """Why the process failed (empty when it did not), and processor seconds and peak memory of the whole process."""

    def confine() -> None:
        os.sched_setaffinity(0, {core})
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_LIMIT_S, CPU_LIMIT_S + 5))

    with tempfile.TemporaryFile() as complaints:
        process = subprocess.Popen(
            [str(word) for word in command],
            stdout=subprocess.DEVNULL,
            stderr=complaints,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            preexec_fn=confine,
        )
        _, status, usage = os.wait4(process.pid, 0)
        complaints.seek(0)
        said = complaints.read().decode(errors="replace").strip()
    process.returncode = os.waitstatus_to_exitcode(status)
    cost = {"cpu_s": usage.ru_utime + usage.ru_stime, "peak_mb": usage.ru_maxrss / 1024.0}
    return "" if process.returncode in allowed else failure_reason(process.returncode, said), cost


def failure_reason(code: int, said: str) -> str:
    """In a few words, from the exit code and what went to the error stream."""
    if code == 0:
        return ""
    if code == -signal.SIGXCPU:
        return f"more than {CPU_LIMIT_S} s of CPU"
    if code < 0:
        return f"died of {signal.Signals(-code).name}"
    last = said.splitlines()[-1].strip() if said else ""
    return f"exit code {code}{': ' + last[:120] if last else ''}".replace("|", "/")
