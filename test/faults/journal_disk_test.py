# SPDX-License-Identifier: Apache-2.0
"""Row L1 for the journals of back end and map: their disk breaks in mid-drive, or takes nothing from the start."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from ignis_lcm.ignis import health_t

from fault_drive import BUS, CONFIG, FaultRun, Seen
from ignis.pipeline import Pipeline

BREAKS_AT_S, WORKS_AT_S, KILLED_AT_S = 1.5, 4.6, 5.0  # of a drive that is played in seven seconds
FAULT_WITHIN_S = 1.0
BUSY_S = 0.5  # that a busy machine may add
SAME_PLACE_M = 0.001
LEAST_VOXEL_SHARE = 0.99  # two drives in real time are never quite the same
PROCESSES = ("graph_backend", "map_builder")


def test_fault_l1_a_disk_that_breaks_under_the_journals_is_a_fault_and_costs_neither_graph_nor_map_a_keyframe(
    drive_log: Path,
    undisturbed: Seen,
    failing_disk: tuple[Path, Path],
    tmp_path: Path,
) -> None:
    folder, switch = failing_disk
    journals = {name: folder / name for name in PROCESSES}
    known = came = 0
    came_at = 0.0
    told: dict[str, float] = {}
    steps = ["break", "work", "kill"]
    options = [("--journal", journals[name]) for name in PROCESSES]
    with FaultRun(tmp_path, backend_options=options[0], map_options=options[1]) as run:

        def meanwhile(seconds: float) -> None:
            nonlocal known, came, came_at
            if steps[:1] == ["break"] and seconds > BREAKS_AT_S:
                came = len(run.seen.keyframes)
                switch.touch()
                steps.pop(0)
            if switch.exists() and came_at == 0.0 and len(run.seen.keyframes) > came:
                came_at = seconds  # the first record that cannot be written
            for name in PROCESSES:
                newest = run.seen.health[name][-1]
                if newest.state == health_t.FAULT and str(journals[name]) in newest.state_text:
                    told.setdefault(name, seconds)
            if steps[:1] == ["work"] and seconds > WORKS_AT_S:
                switch.unlink()
                steps.pop(0)
            is_over = all(str(journals[name]) not in run.seen.health[name][-1].state_text for name in PROCESSES)
            if steps == ["kill"] and seconds > KILLED_AT_S and is_over:
                known = len(run.seen.poses)
                for name in PROCESSES:
                    run.kill_and_restart(name)
                steps.pop(0)

        run.play(drive_log, meanwhile)
        shares = [
            mine / all_ for mine, all_ in zip(run.view_status()["voxels"], undisturbed.status["voxels"], strict=True)
        ]
        said = {name: run.pipeline.last_words(name, 20) for name in PROCESSES}
    print(f"record at {came_at:.2f} s, FAULT at {told}, {known} keyframes known, voxels {shares}", said)
    assert not steps and came_at > 0.0, f"left: {steps}"
    assert set(told) == set(PROCESSES) and max(told.values()) < came_at + FAULT_WITHIN_S + BUSY_S
    assert run.seen.keyframes == undisturbed.keyframes
    resumed = re.search(r"resumed (\d+) keyframes", said["graph_backend"])
    assert resumed and int(resumed[1]) >= known, "the journal lacks what the broken disk did not take"
    assert "left out" not in said["graph_backend"] and "not whole" not in said["map_builder"]
    assert "goes on with" in said["map_builder"]
    assert run.seen.poses.keys() == undisturbed.poses.keys()
    distances = [np.subtract(run.seen.poses[i][:3], undisturbed.poses[i][:3]) for i in undisturbed.poses]
    assert np.linalg.norm(distances, axis=1).max() < SAME_PLACE_M
    assert min(shares) > LEAST_VOXEL_SHARE


@pytest.mark.parametrize("name", PROCESSES)
def test_fault_l1_a_journal_folder_that_nothing_can_be_written_to_is_refused_with_its_path(
    name: str, private_network: None, tmp_path: Path
) -> None:
    folder = tmp_path / "read_only"
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "ro,size=4m", "tmpfs", folder], check=True)
    try:
        with Pipeline(tmp_path, BUS) as pipeline:
            process = pipeline.start(name, "--config", CONFIG, "--journal", folder)
            assert process.wait(30) == 2
            said = pipeline.last_words(name)
    finally:
        subprocess.run(["umount", folder], check=True)
    assert f"{folder}/{name}.lock: Read-only file system" in said and "needs a folder that it may write to" in said
