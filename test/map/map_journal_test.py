# SPDX-License-Identifier: Apache-2.0
"""Rows P4 and M4: a map that is killed and succeeded by one that reads its journal."""

import json
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ignis.pipeline import binary
from map_drive import URL, Drive, forged_message
from stream_server import Server

STEPS = 130
KILLS = (3, 40, 41, 97)  # before a scan: among them the first one after a keyframe and the one behind it
PAUSE_S = 0.002  # between two scans


class JournalledMap:
    """A map_builder with a journal, and the drive that it is sent."""

    def __init__(self, folder: Path, start: Callable[..., Server], *settings: str) -> None:
        self.folder, self.drive = folder, Drive()
        self._settings = settings
        self._start_server = start
        self._started_at = self._missed = 0
        self.start()

    def start(self) -> None:
        options = ("--port", "0", "--journal", self.folder / "journal", "--out", self.folder / "out", *self._settings)
        self.server = self._start_server(*map(str, options), url=URL)
        self._started_at = self.drive.step - self._missed

    def drive_to(self, step: int) -> None:
        while self.drive.step < step:
            self.drive.advance()
            self.drive.answer(PAUSE_S)
        self.wait_for(lambda status: status.get("clouds_inserted") == self.drive.step - self._started_at)

    def status(self) -> dict[str, Any]:
        return json.loads(self.server.request("/api/status")[2])

    def wait_for(self, condition: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        deadline = time.monotonic() + 10.0
        while not condition(status := self.status()):
            assert time.monotonic() < deadline, status
            self.drive.answer(0.05)
        return status

    def wait_for_trouble(self) -> str:
        return self.wait_for(lambda status: status.get("health", "OK") != "OK")["health"]

    def kill(self) -> None:
        self.server.process.kill()
        self.server.process.communicate()

    def miss(self, scans: int, *, forgotten: bool = False) -> None:
        """The drive goes on while no map is there; what is forgotten is never sent again."""
        self._missed = 0 if forgotten else scans
        for _ in range(scans):
            self.drive.advance()
        if forgotten:
            self.drive.sent = {}

    def end(self) -> tuple[bytes, str]:
        """The map in the end, and what the last process said."""
        self.server.process.terminate()
        _, said = self.server.process.communicate(timeout=10)
        assert self.server.process.returncode == 0, said
        return (self.folder / "out" / "map.pcd").read_bytes(), said

    def files(self) -> list[Path]:
        return sorted((self.folder / "journal").glob("map_keyframe_*"))


def length_of_head(file: bytes) -> int:
    return 8 + int.from_bytes(file[:4], "little")


@pytest.fixture
def make_map(private_network, start_server, tmp_path: Path) -> Callable[..., JournalledMap]:
    def make(name: str = "map", *settings: str) -> JournalledMap:
        return JournalledMap(tmp_path / name, start_server, *settings)

    return make


def test_fault_p4_a_map_killed_between_scans_ends_equal_to_the_undisturbed_one_voxel_for_voxel(make_map) -> None:
    maps = {}
    for name, kills in (("undisturbed", ()), ("killed", KILLS)):
        run = make_map(name)
        for step in kills:
            run.drive_to(step)
            run.kill()
            run.start()
        run.drive_to(STEPS)
        run.drive.publish_correction(1)
        run.wait_for(lambda status: status.get("revision") == 1)
        maps[name], said = run.end()
        assert ("goes on with" in said) == bool(kills)
    assert len(maps["killed"]) > 100_000
    assert maps["killed"] == maps["undisturbed"]


def test_fault_p4_what_a_map_missed_while_it_was_dead_is_asked_for_and_ends_equal_voxel_for_voxel(make_map) -> None:
    maps = {}
    for name, absences in (("undisturbed", {}), ("killed", {3: 1, 40: 2, 41: 25, 97: 130})):
        run = make_map(name)
        for step, scans in absences.items():
            run.drive_to(step + sum(count for at, count in absences.items() if at < step))
            run.kill()
            run.miss(scans)
            run.start()
        run.drive_to(300)
        run.drive.publish_correction(1)
        run.wait_for(lambda status: status.get("revision") == 1)
        assert "missing" not in run.status()["health"]
        maps[name], _ = run.end()
        assert len(set(run.drive.asked_for)) == sum(absences.values()) + len(absences), (
            "the newest one is asked for too"
        )
    assert len(maps["killed"]) > 100_000
    assert maps["killed"] == maps["undisturbed"]


def test_fault_p4_what_nobody_sends_again_is_given_up_and_told(make_map) -> None:
    run = make_map()
    run.drive_to(60)
    run.kill()
    run.miss(30, forgotten=True)
    run.start()
    began = time.monotonic()
    run.drive_to(100)
    waited = time.monotonic() - began
    status = run.wait_for(lambda status: "30 scans of the map's restart are missing" in status.get("health", ""))
    assert status["keyframes"] == 4, "three, and what comes before the first"
    assert 1.5 < waited < 4.0
    run.end()


def test_fault_m4_a_damaged_journal_gives_what_is_whole_and_says_so(make_map) -> None:
    run = make_map()
    run.drive_to(90)
    whole = run.status()
    run.kill()
    _, first, second, *_ = run.files()
    damaged = bytearray(first.read_bytes())
    damaged[len(damaged) // 2] ^= 0x10
    first.write_bytes(damaged)
    second.write_bytes(second.read_bytes()[:-7])
    (run.folder / "journal" / "map_keyframe_77").write_bytes(b"nothing of ours" * 100)
    run.start()
    run.drive_to(91)
    status = run.status()
    assert "the map's journal is not whole: 3 files, among them map_keyframe_" in run.wait_for_trouble()
    assert status["keyframes"] == whole["keyframes"]
    assert 0.5 * sum(whole["voxels"]) < sum(status["voxels"]) <= sum(whole["voxels"]) + 500
    assert not (run.folder / "journal" / "map_keyframe_77").exists()
    _, said = run.end()
    assert "not whole: 3 files, among them map_keyframe_" in said


@pytest.mark.parametrize("place", ["head", "first record"])
def test_fault_m4_a_keyframe_that_the_journal_lost_as_a_whole_is_told_in_health(make_map, place: str) -> None:
    run = make_map()
    run.drive_to(90)
    keyframes = run.status()["keyframes"]
    run.kill()
    file = run.files()[2]
    damaged = bytearray(file.read_bytes())
    damaged[10 if place == "head" else length_of_head(damaged) + 20] ^= 0x10
    file.write_bytes(damaged)
    run.start()
    run.drive_to(91)
    assert f"the map's journal is not whole: {file.name}: " in run.wait_for_trouble()
    assert run.status()["keyframes"] == keyframes - 1
    assert f"not whole: {file.name}: " in run.end()[1]


def test_a_forged_message_before_the_first_scan_costs_no_journal(make_map) -> None:
    run = make_map()
    run.drive_to(60)
    run.kill()
    run.start()
    run.drive.bus.publish(*forged_message("SMOOTHED_KEYFRAMES"))
    run.wait_for(lambda status: status.get("health") == "OK")
    run.drive_to(61)
    assert "goes on with" in run.end()[1]


def test_a_journal_of_another_drive_is_not_gone_on_with(make_map) -> None:
    run = make_map()
    run.drive_to(60)
    run.kill()
    run.drive.step += 20 * 61  # more than a minute later
    run.drive.keyframes.clear()
    run.start()
    run.drive_to(run.drive.step + 1)
    assert run.status()["voxels"][0] < 1600, "those of one scan"
    assert {file.name for file in run.files()} <= {"map_keyframe_-1", "map_keyframe_0"}
    assert "another drive" in run.end()[1]


def test_a_keyframe_that_contradicts_the_journal_begins_the_map_anew(make_map) -> None:
    run = make_map()
    run.drive_to(60)
    run.kill()
    run.drive.keyframes.clear()  # a front end that began at once, and in the same session as every front end
    run.start()
    run.drive_to(90)
    assert run.drive.keyframes and run.status()["keyframes"] <= len(run.drive.keyframes) + 1
    assert {file.name for file in run.files()} <= {"map_keyframe_-1", "map_keyframe_0", "map_keyframe_1"}


def test_a_journal_that_cannot_be_written_is_told_and_the_map_goes_on(make_map) -> None:
    run = make_map()
    run.drive_to(30)
    shutil.rmtree(run.folder / "journal")
    run.drive_to(90)
    status = run.wait_for(lambda status: "the map's journal cannot be opened" in status.get("health", ""))
    assert status["keyframes"] >= 4
    run.end()


def test_a_second_map_refuses_the_same_journal(make_map) -> None:
    run = make_map()
    command = [binary("map_builder"), "--lcm-url", "memq://", "--port", "0", "--journal", run.folder / "journal"]
    second = subprocess.run(command, capture_output=True, text=True, timeout=10)
    assert second.returncode == 1 and "another map_builder uses the journal" in second.stderr


def test_a_keyframe_that_comes_again_after_its_cloud_was_dropped_is_not_written_empty(make_map) -> None:
    run = make_map("map", "--set", "map.max_keyframe_points=10000")
    run.drive_to(STEPS)
    names = {path.name for path in run.files()}
    assert "map_keyframe_0" not in names, "the farthest cloud has been dropped"
    run.drive.bus.publish(*run.drive.sent[0][0])
    run.drive_to(STEPS + 5)
    assert names == {path.name for path in run.files()}
