# SPDX-License-Identifier: Apache-2.0
"""The systems of a benchmark, ours and the peers, each as a process of its own on the same core."""

import hashlib
import json
import os
import subprocess
import venv
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ignis import trajectory_error
from ignis.benching.inputs import Drive
from ignis.errors import InputError
from ignis.poses import Trajectory, read_tum

OURS = ("ours: ESKF", "ours: smoothed")
PEERS = ("rko-lio", "kiss-icp", "kiss-slam", "genz-icp")
_RUNNER = Path(__file__).with_name("peer_runner.py")


@dataclass
class Outcome:
    """What one system made of one drive."""

    system: str
    drive: Drive
    figures: dict[str, Any]  # of trajectory_error.errors_of, and the cost


def peers_python(requirements: Path, cache: Path) -> Path:
    """The Python of the peers' environment, made once per list of versions."""
    digest = hashlib.sha256(requirements.read_bytes()).hexdigest()[:12]
    folder = cache / f"peers-{digest}"
    python = folder / "bin" / "python3"
    if (folder / "ready").exists():
        return python
    print("bench: installing the peers into an environment of their own (once)", flush=True)
    venv.create(folder, with_pip=True, clear=True)
    done = subprocess.run(
        [python, "-m", "pip", "install", "--quiet", "--requirement", requirements],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise InputError(f"the peers could not be installed: {done.stderr.strip().splitlines()[-1]}")
    (folder / "ready").touch()
    return python


def run_ours(lio_replay: Path, drive: Drive, config: Path, out: Path, core: int) -> list[Outcome]:
    """Replay of the whole pipeline; its cost is that of both trajectories together."""
    code, cost = _run_on([lio_replay, drive.log, "--config", config, "--out", out], core)
    if code != 0:
        return [Outcome(name, drive, {"failed": f"exit code {code}"}) for name in OURS]
    timing = json.loads((out / "report.json").read_text())["timing"]
    cost |= {"scan_median_ms": timing["scan_p50_ms"], "scan_p99_ms": timing["scan_p99_ms"]}
    files = (out / "eskf.tum", out / "smoothed.tum")
    return [Outcome(name, drive, _errors(read_tum(file), drive) | cost) for name, file in zip(OURS, files, strict=True)]


def run_peer(python: Path, name: str, drive: Drive, out: Path, core: int) -> Outcome:
    """A peer in its own environment, on one thread."""
    code, cost = _run_on([python, _RUNNER, name, drive.arrays, out], core)
    if code != 0:
        return Outcome(name, drive, {"failed": f"exit code {code}"})
    cost |= json.loads((out / "cost.json").read_text())
    trajectory = trajectory_error.in_our_axes(read_tum(out / "trajectory.tum"))
    return Outcome(name, drive, _errors(trajectory, drive) | cost)


def _errors(trajectory: Trajectory, drive: Drive) -> dict[str, Any]:
    return trajectory_error.errors_of(trajectory_error.paired(trajectory, read_tum(drive.truth)), per_scan=False)


def _run_on(command: list[Any], core: int) -> tuple[int, dict[str, float]]:
    """Exit code, and processor seconds and peak memory of the whole process."""
    process = subprocess.Popen(
        [str(word) for word in command],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        preexec_fn=lambda: os.sched_setaffinity(0, {core}),
    )
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, {"cpu_s": usage.ru_utime + usage.ru_stime, "peak_mb": usage.ru_maxrss / 1024.0}
