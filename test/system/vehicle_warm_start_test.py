# SPDX-License-Identifier: Apache-2.0
"""lio_frontend killed with -9 in a drive through the real processes: its successor goes on where it was."""

import json
import os
import random
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ignis.bus import Listener
from ignis.pipeline import Pipeline, effective_config

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
HALL = CHECKOUT / "config" / "scenes" / "battery_hall.json"
PORT = 18091
GOOD_WITHIN_S = 1.0
TRUSTED_WITHIN_S = 5.0
MAX_STEP_M = 0.10
RESTART_DELAY_S = 0.1  # that the supervisor takes
OK, DEGRADED = 0, 1

# Down the long aisle and back, in two ways.
DRIVES = {
    "walking pace, 1.5 m/s": {
        "speed_m_s": 1.5,
        "acceleration_m_s2": 0.8,
        "kills": 4,
        "first": 8.0,
        "every": (5.0, 8.0),
    },
    "fast, 5 m/s": {"speed_m_s": 5.0, "acceleration_m_s2": 2.0, "kills": 3, "first": 6.5, "every": (2.2, 2.8)},
}


def scene(folder: Path, speed: float, acceleration: float) -> Path:
    """The battery hall's long aisle."""
    file = folder / "aisle.json"
    places = [[-9.5, 0.6, 0.0], [-9.5, 0.6, -36.1], [-3.2, 0.6, -36.1], [-3.2, 0.6, -1.4]]
    waypoints: list[dict[str, Any]] = [{"position_m": place} for place in places]
    waypoints[0]["rest_s"] = 4
    trajectory = {"speed_m_s": speed, "acceleration_m_s2": acceleration, "corner_m": 2.2, "waypoints": waypoints}
    file.write_text(json.dumps({"geometry": str(HALL), "trajectory": trajectory}))
    return file


class Kill:
    """One kill and what came of it."""

    def __init__(self, at: float, pid: int) -> None:
        self.at, self.old_pid = at, pid
        self.first_good_s = float("nan")
        self.trusted_s = float("nan")
        self.step_m = float("nan")
        self.states: list[tuple[int, str]] = []


class Watch:
    """Notes what the warm start promises something about."""

    def __init__(self, url: str) -> None:
        self.listener = Listener(url, on_message=self.note)
        self.truth: dict[int, Any] = {}
        self.scans: list[tuple[float, Any]] = []
        self.keyframes: dict[tuple[int, int], set[int]] = {}
        self.map_keyframes: list[int] = []
        self.kills: list[Kill] = []

    def note(self, channel: str, message: Any) -> None:
        """One message."""
        now = time.monotonic()
        if channel == "GROUND_TRUTH":
            self.truth[message.utime] = message
        elif channel == "LIO_SCAN_STATS":
            self.scans.append((now, message))
        elif channel == "LIO_KEYFRAME":
            self.keyframes.setdefault((message.session, message.id), set()).add(message.utime)
        elif channel == "MAP_STATUS":
            self.map_keyframes.append(message.keyframes)
        elif channel == "HEALTH" and message.process == "lio_frontend" and self.kills:
            kill = self.kills[-1]
            if message.pid != kill.old_pid:
                kill.states.append((message.state, message.state_text))
                if message.state == OK and np.isnan(kill.trusted_s):
                    kill.trusted_s = now - kill.at

    def health(self) -> Any:
        """Newest HEALTH of the front end."""
        found = [entry for (name, _), entry in self.listener.health.items() if name == "lio_frontend"]
        return max(found, key=lambda entry: entry[0])[1] if found else None

    def true_pose(self, utime: int) -> tuple[Rotation, np.ndarray]:
        """Nearest in time; the truth comes every 4 ms."""
        message = self.truth[min(self.truth, key=lambda each: abs(each - utime))]
        assert abs(message.utime - utime) < 10_000
        ahead = np.array(message.velocity) * 1e-6 * (utime - message.utime)
        return Rotation.from_quat(message.quaternion, scalar_first=True), np.array(message.position) + ahead

    def judge(self, kill: Kill) -> None:
        """Time to the first good pose, and how far it is from where the last pose before the kill and the truth say."""
        before = [s for at, s in self.scans if at <= kill.at and s.applied][-1]
        at, after = next((at, s) for at, s in self.scans if at > kill.at + RESTART_DELAY_S and s.applied)
        kill.first_good_s = at - kill.at
        rotation_before, place_before = self.true_pose(before.utime)
        _, place_after = self.true_pose(after.utime)
        turn = Rotation.from_quat(before.quaternion, scalar_first=True) * rotation_before.inv()
        moved = np.array(after.position) - np.array(before.position)
        kill.step_m = float(np.linalg.norm(moved - turn.apply(place_after - place_before)))


class Vehicle:
    """The processes of a simulated drive; the front end with a checkpoint."""

    def __init__(self, pipeline: Pipeline, folder: Path, url: str) -> None:
        self.pipeline, self.folder = pipeline, folder
        self.watch = Watch(url)

    def start(self, scene_file: Path) -> None:
        """All of them; returns when the simulated sensor has begun."""
        tty = self.folder / "l1.pty"
        config = ("--config", CONFIG)
        self.pipeline.start("map_builder", *config, "--port", PORT)
        self.pipeline.start("graph_backend", *config)
        self.start_front_end()
        self.pipeline.start("l1_sim", "--scene", scene_file, *config, "--pty", tty, "--wait", 30)
        self.pipeline.wait_for_text("l1_sim", "waiting", 30.0)
        self.pipeline.start("l1_driver", *config, "--port", tty)

    def start_front_end(self) -> None:
        """The front end alone."""
        self.pipeline.start("lio_frontend", "--config", CONFIG, "--checkpoint", self.folder / "checkpoint")

    def kill_front_end(self) -> Kill:
        """Kills it, and listens for as long as a supervisor takes to start the next one."""
        process = self.pipeline.processes["lio_frontend"]
        kill = Kill(time.monotonic(), process.pid)
        process.send_signal(signal.SIGKILL)
        process.wait()
        self.watch.kills.append(kill)
        self.watch.listener.listen(RESTART_DELAY_S)
        return kill

    def drive_until(self, began: float, seconds: float) -> None:
        """Listens until so long after the beginning."""
        self.watch.listener.listen(max(began + seconds - time.monotonic(), 0.0))


@pytest.fixture(scope="module", params=DRIVES.items(), ids=lambda item: item[0])
def driven(
    private_network, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Watch]:
    """A drive with kills at seeded instants."""
    terms = request.param[1]
    folder = tmp_path_factory.mktemp("warm_start")
    rng = random.Random(5)
    with Pipeline(folder, effective_config(CONFIG)["lcm"]["url"]) as pipeline:
        vehicle = Vehicle(pipeline, folder, pipeline.environment["LCM_DEFAULT_URL"])
        vehicle.start(scene(folder, terms["speed_m_s"], terms["acceleration_m_s2"]))
        began = time.monotonic()
        at = terms["first"]
        for _ in range(terms["kills"]):
            vehicle.drive_until(began, at)
            vehicle.kill_front_end()
            vehicle.start_front_end()
            at += rng.uniform(*terms["every"])
        vehicle.drive_until(began, at + 4.0)
        for kill in vehicle.watch.kills:
            vehicle.watch.judge(kill)
            print(
                f"good after {kill.first_good_s:.2f} s, trusted after {kill.trusted_s:.2f} s, step {kill.step_m:.3f} m"
            )
    yield vehicle.watch


def test_the_first_good_pose_is_early_and_true(driven: Watch) -> None:
    for kill in driven.kills:
        assert kill.first_good_s < GOOD_WITHIN_S
        assert kill.step_m < MAX_STEP_M


def test_the_state_is_degraded_until_scans_have_confirmed_it(driven: Watch) -> None:
    for kill in driven.kills:
        assert kill.trusted_s < TRUSTED_WITHIN_S, kill.states
        assert kill.states[0][0] != OK, kill.states
        assert any("resumed" in text for state, text in kill.states if state == DEGRADED), kill.states


def test_no_keyframe_id_is_used_twice_and_none_is_missing(driven: Watch) -> None:
    assert all(len(instants) == 1 for instants in driven.keyframes.values())
    assert {session for session, _ in driven.keyframes} == {0}
    ids = sorted(number for _, number in driven.keyframes)
    assert ids == list(range(len(ids))) and len(ids) > 5


def test_graph_and_map_keep_what_they_had(driven: Watch) -> None:
    graph = driven.listener.channels["SMOOTHED_KEYFRAMES"].newest
    assert graph.session == 0
    assert abs(graph.graph_keyframes - len(driven.keyframes)) <= 1
    assert all(later >= earlier for earlier, later in zip(driven.map_keyframes, driven.map_keyframes[1:], strict=False))
    assert graph.graph_keyframes - driven.map_keyframes[-1] <= 2


def test_a_damaged_checkpoint_begins_a_new_session_and_says_why(private_network, tmp_path: Path) -> None:
    with Pipeline(tmp_path, effective_config(CONFIG)["lcm"]["url"]) as pipeline:
        vehicle = Vehicle(pipeline, tmp_path, pipeline.environment["LCM_DEFAULT_URL"])
        vehicle.start(scene(tmp_path, 1.5, 0.8))
        vehicle.drive_until(time.monotonic(), 8.0)
        kill = vehicle.kill_front_end()
        file = tmp_path / "checkpoint" / "lio_frontend.checkpoint"
        damaged = bytearray(file.read_bytes())
        damaged[len(damaged) // 2] ^= 1
        file.write_bytes(damaged)
        vehicle.start_front_end()
        vehicle.drive_until(time.monotonic(), 4.0)
        assert vehicle.watch.health().pid != kill.old_pid
        assert vehicle.watch.health().resets == 1
        assert "checksum" in kill.states[0][1], kill.states
        assert all(state != OK for state, _ in kill.states), "\n".join(map(str, kill.states))


def test_a_second_front_end_on_the_same_folder_is_refused(private_network, tmp_path: Path) -> None:
    with Pipeline(tmp_path, effective_config(CONFIG)["lcm"]["url"]) as pipeline:
        folder = tmp_path / "checkpoint"
        pipeline.start("lio_frontend", "--config", CONFIG, "--checkpoint", folder)
        deadline = time.monotonic() + 10.0
        while not (folder / "lio_frontend.lock").exists():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        # On another bus: on the same one the process is refused before it looks at the folder.
        second = Pipeline(tmp_path / "second", pipeline.environment["LCM_DEFAULT_URL"].replace(":7667", ":7668"))
        with second:
            assert second.start("lio_frontend", "--config", CONFIG, "--checkpoint", folder).wait(10) == 1
            assert "another lio_frontend uses the checkpoint" in second.last_words("lio_frontend")
