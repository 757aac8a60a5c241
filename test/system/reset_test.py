# SPDX-License-Identifier: Apache-2.0
"""`./ignis reset` ends the session of the running front end; graph and map follow, and a replay of the log as well."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from ignis_lcm.ignis import health_t, smoothed_keyframes_t, state_t
from live_agreement import require_equal_up_to_the_first_drop

from ignis.bus import Bus, open_bus
from ignis.pipeline import Pipeline, effective_config

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
PORT = 18097
REST_SECONDS, DRIVE_SECONDS = 12, 8.0


class Listener:
    """The newest of what the processes say."""

    def __init__(self, bus: Bus) -> None:
        self.states: list[tuple[int, int]] = []  # session and stamp
        self.graph_session = -1
        self.map_resets = 0
        self.front_end_text = ""
        self._bus = bus
        bus.subscribe("LIO_STATE", self._on_state).set_queue_capacity(5000)
        bus.subscribe("SMOOTHED_KEYFRAMES", self._on_revision)
        bus.subscribe("HEALTH", self._on_health)

    def _on_state(self, _: str, data: bytes) -> None:
        state = state_t.decode(data)
        self.states.append((state.session, state.utime))

    def _on_revision(self, _: str, data: bytes) -> None:
        self.graph_session = smoothed_keyframes_t.decode(data).session

    def _on_health(self, _: str, data: bytes) -> None:
        health = health_t.decode(data)
        if health.process == "lio_frontend":
            self.front_end_text = health.state_text
        elif health.process == "map_builder":
            self.map_resets = health.resets

    def until(self, condition: Any, seconds: float) -> None:
        """Listens until something is so."""
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, self.front_end_text
            self._bus.handle_timeout(50)


def resetting(pipeline: Pipeline, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "ignis.reset", *arguments]
    return subprocess.run(command, env=pipeline.environment, capture_output=True, text=True, timeout=30, check=False)


def scene_that_rests(folder: Path) -> Path:
    """Long enough for three starts."""
    scene = json.loads(SCENE.read_text())
    scene["geometry"] = str(SCENE.parent / scene["geometry"])
    scene["trajectory"]["waypoints"][0]["rest_s"] = REST_SECONDS
    file = folder / "scene.json"
    file.write_text(json.dumps(scene))
    return file


def test_a_reset_begins_a_new_session_everywhere_and_is_replayed(
    private_network: None, tmp_path: Path, run_binary: Any
) -> None:
    config = ("--config", CONFIG)
    url = effective_config(CONFIG)["lcm"]["url"]
    tty, log = tmp_path / "l1.pty", tmp_path / "run.lcmlog"
    with Pipeline(tmp_path, url) as pipeline:
        listener = Listener(open_bus(url))
        pipeline.start("lcm-logger", "--quiet", log)
        pipeline.start("map_builder", *config, "--port", PORT)
        pipeline.start("graph_backend", *config)
        pipeline.start("lio_frontend", *config)
        scene = scene_that_rests(tmp_path)
        pipeline.start("l1_sim", "--scene", scene, *config, "--pty", tty, "--wait", 20)
        pipeline.wait_for_text("l1_sim", "waiting", 10.0)
        pipeline.start("l1_driver", *config, "--port", tty)
        listener.until(lambda: len(listener.states) > 250 and listener.graph_session == 0, 20.0)

        done = resetting(pipeline)
        assert done.returncode == 0, done.stderr
        assert "session 0 has ended, 1 begins: new session: 0 was ended by a command" in done.stdout
        listener.until(lambda: listener.states[-1][0] == 1 and listener.graph_session == 1, 10.0)
        listener.until(lambda: listener.map_resets == 1, 3.0)
        time.sleep(DRIVE_SECONDS)
        pipeline.check("l1_sim", "l1_driver")
        pipeline.stop("l1_sim", "l1_driver", "lio_frontend", "graph_backend", "map_builder", "lcm-logger")

    sessions = [session for session, _ in listener.states]
    assert sorted(sessions) == sessions, "it goes on once it has begun"
    stamps = [stamp for _, stamp in listener.states]
    assert sorted(stamps) == stamps

    run_binary("lio_replay", log, *config, "--out", tmp_path / "replay")
    report = json.loads((tmp_path / "replay" / "report.json").read_text())
    assert report["live"]["recorded_scans"] > 100
    assert report["sessions"] == 2 and not report["refused_commands"]
    require_equal_up_to_the_first_drop(report)
    with (tmp_path / "replay" / "scan_stats.csv").open() as file:
        reasons = file.read()
    assert reasons.count("not initialised yet") > 50, "two starts of 1.5 s at 20 Hz"


def test_a_front_end_that_is_killed_before_the_new_session_has_started_begins_one_more(
    private_network: None, tmp_path: Path
) -> None:
    config = ("--config", CONFIG)
    url = effective_config(CONFIG)["lcm"]["url"]
    tty = tmp_path / "l1.pty"
    front_end = ("lio_frontend", *config, "--checkpoint", tmp_path / "checkpoint")
    with Pipeline(tmp_path, url) as pipeline:
        listener = Listener(open_bus(url))
        pipeline.start(*front_end)
        pipeline.start("l1_sim", "--scene", scene_that_rests(tmp_path), *config, "--pty", tty, "--wait", 20)
        pipeline.wait_for_text("l1_sim", "waiting", 10.0)
        pipeline.start("l1_driver", *config, "--port", tty)
        listener.until(lambda: len(listener.states) > 250, 20.0)
        assert resetting(pipeline).returncode == 0
        pipeline.processes["lio_frontend"].kill()
        pipeline.processes["lio_frontend"].wait()
        pipeline.start(*front_end)
        listener.until(lambda: listener.states[-1][0] == 2, 10.0)
    assert {session for session, _ in listener.states} == {0, 2}


def test_a_reset_without_a_front_end_says_what_is_missing(
    private_network: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Pipeline(tmp_path, effective_config(CONFIG)["lcm"]["url"]) as pipeline:
        done = resetting(pipeline)
        assert done.returncode == 1
        assert "nothing was heard of lio_frontend" in done.stderr
        pipeline.start("lio_frontend", "--config", CONFIG)
        done = resetting(pipeline)
        assert done.returncode == 1
        assert "nothing was heard of inertial samples" in done.stderr
