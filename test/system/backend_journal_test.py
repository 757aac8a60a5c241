# SPDX-License-Identifier: Apache-2.0
"""The back end's journal on disk, and commands to its graph, with the real process."""

import json
import os
import struct
import subprocess
import time
import zlib
from pathlib import Path

import pytest
from ignis_lcm.ignis import graph_command_t, smoothed_keyframes_t

from ignis import graph
from ignis.bus import Listener, open_bus
from ignis.pipeline import Pipeline
from keyframe_source import BUS, BackendRun, record_keyframes

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
JOURNAL = "graph_backend.journal"
INTERVAL = 0.15  # [s] between keyframes
START_S = 60.0  # far more than a start takes


@pytest.fixture(scope="module")
def keyframes(private_network, tmp_path_factory: pytest.TempPathFactory) -> list[list[bytes]]:
    """The beginning of a drive."""
    return record_keyframes(tmp_path_factory.mktemp("recording"), SCENE, CONFIG, 25.0)


def first_words(folder: Path, config: Path, *awaited: str) -> str:
    """What a back end says until all of this is said; under a sanitizer that takes a while."""
    with Pipeline(folder, BUS) as pipeline:
        pipeline.start("graph_backend", "--config", config, "--journal", folder / "journal")
        for text in awaited:
            pipeline.wait_for_text("graph_backend", text, START_S)
        return pipeline.last_words("graph_backend")


def test_journal_of_another_configuration_is_kept_but_not_used(keyframes: list[list[bytes]], tmp_path: Path) -> None:
    BackendRun(tmp_path, CONFIG, keyframes, 0.0, 1).drive(INTERVAL)
    first_words(tmp_path, CONFIG, f"resumed {len(keyframes)} keyframes")
    other = json.loads(CONFIG.read_text())
    other.setdefault("backend", {})["prior_tilt_deg"] = 2.5
    (tmp_path / "other.json").write_text(json.dumps(other))
    said = first_words(tmp_path, tmp_path / "other.json", "another configuration", f"{JOURNAL}.old1")
    assert "resumed" not in said
    assert (tmp_path / "journal" / f"{JOURNAL}.old1").stat().st_size > 100_000


def test_a_restarted_back_end_tells_how_sure_the_newest_pose_is(keyframes: list[list[bytes]], tmp_path: Path) -> None:
    BackendRun(tmp_path, CONFIG, keyframes, 0.0, 1).drive(INTERVAL)
    sets: list[smoothed_keyframes_t] = []
    with Pipeline(tmp_path, BUS) as pipeline:
        bus = open_bus(BUS)
        bus.subscribe("SMOOTHED_KEYFRAMES", lambda _, data: sets.append(smoothed_keyframes_t.decode(data)))
        pipeline.start("graph_backend", "--config", CONFIG, "--journal", tmp_path / "journal")
        end = time.monotonic() + START_S
        while not sets:
            assert time.monotonic() < end
            bus.handle_timeout(100)
    assert sets[0].full and sets[0].utime > 0
    variances = sets[0].map_odom_covariance[:: 6 + 1]
    assert all(0.0 < variance < 0.01 for variance in variances), variances


def test_journal_of_another_version_is_named_and_kept(private_network, tmp_path: Path) -> None:
    payload = b"IGNISJNL" + struct.pack("<II", 2, 3) + b"abc" + struct.pack("<i", 0)
    (tmp_path / "journal").mkdir()
    file = tmp_path / "journal" / JOURNAL
    file.write_bytes(struct.pack("<II", len(payload), zlib.crc32(payload)) + payload)
    first_words(tmp_path, CONFIG, "it has version 2, this build writes 9", f"{JOURNAL}.old1")
    assert (tmp_path / "journal" / f"{JOURNAL}.old1").exists() and not file.exists()


def test_torn_tail_is_cut_off_and_told(keyframes: list[list[bytes]], tmp_path: Path) -> None:
    BackendRun(tmp_path, CONFIG, keyframes, 0.0, 1).drive(INTERVAL)
    file = tmp_path / "journal" / JOURNAL
    whole = file.stat().st_size
    with file.open("ab") as out:
        out.write(b"\x00\x10\x00\x00half a record")
    first_words(tmp_path, CONFIG, f"resumed {len(keyframes)} keyframes", "last 17 bytes are left out")
    assert file.stat().st_size == whole


def test_full_disk_is_told_and_the_graph_goes_on(keyframes: list[list[bytes]], tmp_path: Path) -> None:
    (tmp_path / "journal").mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", tmp_path / "journal"], check=True)
    try:
        outcome = BackendRun(tmp_path, CONFIG, keyframes, 0.0, 1).drive(INTERVAL)
    finally:
        subprocess.run(["umount", tmp_path / "journal"], check=True)
    assert len(outcome.poses) == len(keyframes)
    assert any("journal cannot be written: No space left" in text for text in outcome.health)


def wait_until_locked(lock: Path, seconds: float = 20.0) -> None:
    """Returns when some process holds the lock; on a busy machine one takes a while to start."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        # Looked up in the kernel's list: trying to lock would get in the other's way.
        if lock.exists() and f":{lock.stat().st_ino} " in Path("/proc/locks").read_text():
            return
        time.sleep(0.1)
    raise AssertionError(f"nobody locked {lock} within {seconds} s")


def test_second_back_end_refuses_the_same_journal(private_network, tmp_path: Path) -> None:
    with Pipeline(tmp_path, BUS) as pipeline:
        pipeline.start("graph_backend", "--config", CONFIG, "--journal", tmp_path / "journal")
        wait_until_locked(tmp_path / "journal" / "graph_backend.lock")
        (tmp_path / "second").mkdir()
        # On another bus: on the same one the process is refused before it looks at the journal.
        with Pipeline(tmp_path / "second", BUS.replace(":7667", ":7668")) as second:
            process = second.start("graph_backend", "--config", CONFIG, "--journal", tmp_path / "journal")
            assert process.wait(30) == 1
            assert "another graph_backend uses the journal" in second.last_words("graph_backend")


def wait_until_heard(name: str) -> None:
    """Returns when a process is on the bus."""
    listener, end = Listener(BUS, "HEALTH"), time.monotonic() + START_S
    while not any(process == name for process, _ in listener.health):
        assert time.monotonic() < end, f"{name} did not start within {START_S:.0f} s"
        listener.listen(0.1)


def test_commands_are_answered(private_network, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert graph.main(["--lcm-url", BUS, "withdraw", "7", "3"]) == 1
    assert "no answer" in capsys.readouterr().err
    with Pipeline(tmp_path, BUS) as pipeline:
        pipeline.start("graph_backend", "--config", CONFIG)
        wait_until_heard("graph_backend")
        for command in ("withdraw", "veto"):
            assert graph.main(["--lcm-url", BUS, command, "7", "3"]) == 0
            assert "loop 7-3" in capsys.readouterr().out
        assert graph.main(["--lcm-url", BUS, "full"]) == 0
        assert "0 keyframes" in capsys.readouterr().out


@pytest.mark.parametrize("arguments", [["withdraw", "7"], ["veto", "-3", "1"], ["burn"], []])
def test_wrong_commands_are_refused(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        graph.main(arguments)
    assert ended.value.code == 2


def test_command_numbers_are_those_of_the_message() -> None:
    assert graph.message_of(graph.parse_arguments(["veto", "9", "2"])).command == graph_command_t.VETO_LOOP
    assert graph.message_of(graph.parse_arguments(["full"])).from_id == -1
