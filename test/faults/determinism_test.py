# SPDX-License-Identifier: Apache-2.0
"""Row L4: the same log gives the same bytes on one core and on two, again and again."""

import hashlib
import os
import subprocess
from pathlib import Path

from fault_drive import CONFIG
from ignis.pipeline import binary

# What depends on the log alone. The report holds times, and the pages are made from it.
RESULTS = ("eskf.tum", "smoothed.tum", "keyframes.g2o", "loops.csv", "map.pcd")


def replayed(log: Path, out: Path, cores: set[int]) -> dict[str, str]:
    """Fingerprints of what a replay on these cores writes."""
    command = [binary("lio_replay"), log, "--config", CONFIG, "--out", out]
    subprocess.run(
        list(map(str, command)), check=True, capture_output=True, timeout=120.0,
        preexec_fn=lambda: os.sched_setaffinity(0, cores),
    )  # fmt: skip
    return {name: hashlib.sha256((out / name).read_bytes()).hexdigest() for name in RESULTS}


def test_fault_l4_replays_on_one_core_and_on_all_are_equal_byte_for_byte(drive_log: Path, tmp_path: Path) -> None:
    cores = os.sched_getaffinity(0)
    runs = [
        replayed(drive_log, tmp_path / f"run{number}", used)
        for number, used in enumerate(({min(cores)}, {max(cores)}, cores, cores))
    ]
    assert all(run == runs[0] for run in runs[1:])
