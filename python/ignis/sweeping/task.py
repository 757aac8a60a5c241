# SPDX-License-Identifier: Apache-2.0
"""One replay of a sweep and its row of the table. Runs in a thread here, or on another machine."""

import contextlib
import json
import os
import subprocess
import threading
from pathlib import Path
from typing import Any

from ignis import trajectory_error
from ignis.errors import EXIT_DAMAGED, InputError
from ignis.evaluation.consistency import nees_of
from ignis.files import write_text
from ignis.poses import Trajectory, read_tum
from ignis.run_folder import read_json
from ignis.sweeping.grid import Task

Row = dict[str, Any]

ROW_NAME = "row.json"
TRUTH_SUFFIX = ".tum"
_MAPS = ("map.pcd", "map.ply")
_FIGURES = (
    "ate_rmse_m", "ate_yaw_rmse_m", "rpe_1m_rmse_m", "rpe_10m_rmse_m", "end_error_m", "tilt_rmse_deg", "yaw_rmse_deg",
)  # fmt: skip
# Columns with their kinds, so that an empty table has them as well. Nothing here depends on the machine or its load.
FIGURE_COLUMNS: dict[str, type] = {
    "status": str, "failure": str, "duration_s": float, "scans": int, "scans_applied": int, "keyframes": int,
    "loops_kept": int, "loops_withdrawn": int, **{f"eskf_{k}": float for k in _FIGURES},
    **{f"smoothed_{k}": float for k in _FIGURES}, "nees_position": float, "nees_attitude": float,
    "trajectory_hash": str, "map_hash": str,
}  # fmt: skip
TIMING_COLUMNS: dict[str, type] = {"real_time_factor": float, "scan_p50_ms": float, "scan_p99_ms": float}

_running: set[subprocess.Popen[bytes]] = set()
_lock = threading.Lock()


def finished_row(task: Task) -> Row | None:
    """The row that an earlier sweep left, unless its replay failed."""
    path = Path(task.folder) / ROW_NAME
    if not path.is_file():
        return None
    try:
        row = read_json(path)
    except InputError:
        return None
    return row if row.get("status") == "ok" else None


def run_task(task: Task) -> Row:
    """Replays, evaluates, and leaves the row in the folder. Never raises for what a replay can do wrong."""
    folder = Path(task.folder)
    folder.mkdir(parents=True, exist_ok=True)
    try:
        row = _figures(task, folder)
    except (InputError, OSError, KeyError, ValueError) as error:
        row = {"status": "failed", "failure": " ".join(str(error).split())[:300]}
    write_text(folder / ROW_NAME, json.dumps(row, indent=1) + "\n")
    return row


def stop_all() -> None:
    """Ends the replays that this process has started; their threads then return failed rows."""
    with _lock:
        for process in _running:
            process.terminate()


def _figures(task: Task, folder: Path) -> Row:
    complaint = _replay(task, folder)
    if complaint:
        return {"status": "failed", "failure": complaint}
    report = read_json(folder / "report.json")
    row: Row = {"status": "ok", "failure": ""}
    row |= {key: report[key] for key in FIGURE_COLUMNS if key in report}
    row |= {key: report["timing"][key] for key in TIMING_COLUMNS}
    truth = _truth(task, folder)
    if truth is not None:
        for name in ("eskf", "smoothed"):
            pair = trajectory_error.paired(read_tum(folder / f"{name}.tum"), truth)
            errors = trajectory_error.errors_of(pair, per_scan=False)
            row |= {f"{name}_{key}": errors[key] for key in _FIGURES}
        row["nees_position"], row["nees_attitude"] = nees_of(folder, truth)
    for name in _MAPS:  # Megabytes a run, and a replay makes them again.
        with contextlib.suppress(FileNotFoundError):
            (folder / name).unlink()
    return row


def _truth(task: Task, folder: Path) -> Trajectory | None:
    for path in (folder / "ground_truth.tum", Path(task.log).with_suffix(TRUTH_SUFFIX)):
        if path.is_file():
            return read_tum(path)
    return None


def _replay(task: Task, folder: Path) -> str:
    """Why the replay failed; empty when it did not. Damaged or lost input still gives results."""
    program = Path(os.environ.get("IGNIS_BUILD", ".")) / "bin" / "lio_replay"
    command = [str(program), task.log, "--config", task.config, "--out", str(folder), *task.options]
    for key, value in task.changes:
        command += ["--set", f"{key}={value}"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    with _lock:
        _running.add(process)
    try:
        said = process.communicate()[1].decode(errors="replace").strip()
    finally:
        with _lock:
            _running.discard(process)
    if process.returncode in (0, EXIT_DAMAGED):
        return ""
    return f"lio_replay ended with code {process.returncode}: {complaint_in(said)}"


def complaint_in(said: str) -> str:
    """The line in which lio_replay says what is wrong, from among its progress; else its last words."""
    lines = said.splitlines() or ["no message"]
    complaints = [line for line in lines if line.startswith("lio_replay: ")]
    return complaints[0].removeprefix("lio_replay: ") if complaints else lines[-1]
