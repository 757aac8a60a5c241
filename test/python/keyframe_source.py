# SPDX-License-Identifier: Apache-2.0
"""Recorded keyframes sent to a real back end over LCM, with losses and kills, and what it makes of them."""

import random
import signal
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import lcm
import numpy as np
from ignis_lcm.ignis import health_t, keyframe_request_t, keyframe_t, loop_result_t, smoothed_keyframes_t

from ignis.bus import open_bus
from ignis.pipeline import Pipeline

BUS = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152"
REPLAY_SPEED = 4.0


def record_keyframes(folder: Path, scene: Path, config: Path, seconds: float) -> list[list[bytes]]:
    """Simulates a drive, runs the front end over it, and returns its keyframes: for each id its parts as sent."""
    drive, recording = folder / "drive.lcmlog", folder / "keyframes.lcmlog"
    with Pipeline(folder, BUS) as pipeline:
        simulator = pipeline.start(
            "l1_sim", "--scene", scene, "--config", config, "--log", drive, "--duration", seconds
        )
        if simulator.wait(300) != 0:
            raise RuntimeError(pipeline.last_words("l1_sim"))
        pipeline.start("lcm-logger", "--quiet", "--channel=LIO_KEYFRAME", recording)
        pipeline.start("lio_frontend", "--config", config)
        time.sleep(1.0)
        player = pipeline.start("lcm-logplayer", f"--speed={REPLAY_SPEED}", "--regexp=L1_.*", drive)
        if player.wait(2.0 * seconds / REPLAY_SPEED + 60.0) != 0:
            raise RuntimeError(pipeline.last_words("lcm-logplayer"))
        time.sleep(1.0)
        pipeline.stop("lio_frontend", "lcm-logger")
    return read_keyframes(recording)


def read_keyframes(recording: Path) -> list[list[bytes]]:
    """The keyframes of a log, by id."""
    by_id: dict[int, list[bytes]] = {}
    for event in lcm.EventLog(str(recording), "r"):
        if event.channel == "LIO_KEYFRAME":
            by_id.setdefault(keyframe_t.decode(event.data).id, []).append(event.data)
    return [by_id[number] for number in sorted(by_id)]


@dataclass
class Outcome:
    """What the back end had at the end, and what it said on the way."""

    poses: dict[int, np.ndarray] = field(default_factory=dict)
    revision: int = -1
    loops: set[tuple[int, int]] = field(default_factory=set)
    kills: int = 0
    resumes: list[str] = field(default_factory=list)
    health: list[str] = field(default_factory=list)
    sent: int = 0
    dropped: int = 0
    asked_again: list[set[int]] = field(default_factory=list)  # for each kill: keyframes that were sent again after it

    def distance(self, other: "Outcome") -> float:
        """Largest distance of a keyframe in both [m]; infinite when they do not hold the same ones."""
        if self.poses.keys() != other.poses.keys():
            return float("inf")
        return max(float(np.linalg.norm(self.poses[i][:3] - other.poses[i][:3])) for i in self.poses)


class BackendRun:
    """One drive of recorded keyframes through a back end. Acts as the front end: sends, keeps, sends again."""

    def __init__(self, folder: Path, config: Path, keyframes: Sequence[list[bytes]], loss: float, seed: int) -> None:
        self.outcome = Outcome()
        self._keyframes = keyframes
        self._loss, self._random = loss, random.Random(seed)
        self._published = 0
        self._dead_pid: int | None = None  # of the back end that was killed, until its successor is heard
        self._may_miss = 0
        self._parts: dict[int, smoothed_keyframes_t] = {}
        self._arguments = ("--config", config, "--journal", folder / "journal")
        self._pipeline = Pipeline(folder, BUS)
        self._bus = open_bus(BUS)
        self._bus.subscribe("KEYFRAME_REQUEST", self._on_request)
        self._bus.subscribe("SMOOTHED_KEYFRAMES", self._on_revision).set_queue_capacity(1000)
        self._bus.subscribe("LOOP_RESULT", self._on_loop).set_queue_capacity(1000)
        self._bus.subscribe("HEALTH", self._on_health)

    def drive(self, interval: float, kill_times: Sequence[float] = ()) -> Outcome:
        """Sends a keyframe every `interval` seconds; kills the back end at these times after the start."""
        with self._pipeline:
            backend = self._start()
            began = time.monotonic()
            kills = sorted(kill_times)
            while self._published < len(self._keyframes) or kills:
                self._bus.handle_timeout(5)
                now = time.monotonic() - began
                if kills and now >= kills[0]:
                    kills.pop(0)
                    backend = self._kill(backend)
                if self._published < len(self._keyframes) and now >= self._published * interval and self._is_heard():
                    self._send(self._published)
                    self._published += 1
                self._pipeline.check()
            self._await_all()
            self._note_resume()
        return self.outcome

    def _start(self) -> subprocess.Popen:
        return self._pipeline.start("graph_backend", *self._arguments)

    def _kill(self, backend: subprocess.Popen) -> subprocess.Popen:
        self._note_resume()
        backend.send_signal(signal.SIGKILL)
        backend.wait()
        self.outcome.kills += 1
        self.outcome.asked_again.append(set())
        self._dead_pid = backend.pid
        self._may_miss = int(self._published - 1 in self.outcome.poses)
        return self._start()

    def _is_heard(self) -> bool:
        """Whether the next keyframe may go. On the vehicle seconds lie between two of them and a restart takes less, so
        it costs the one that was under way, or else one that comes meanwhile."""
        if self._dead_pid is None:
            return True
        self._may_miss -= 1
        return self._may_miss >= 0

    def _note_resume(self) -> None:
        said = self._pipeline.last_words("graph_backend")
        if "resumed" in said:
            self.outcome.resumes.append(said)

    def _send(self, number: int) -> None:
        for part in self._keyframes[number]:
            self.outcome.sent += 1
            if self._random.random() < self._loss:
                self.outcome.dropped += 1
            else:
                self._bus.publish("LIO_KEYFRAME", part)

    def _await_all(self) -> None:
        """Waits until every keyframe is in the graph and a full set has had time to follow."""
        deadline = time.monotonic() + 60.0
        while len(self.outcome.poses) < len(self._keyframes) and time.monotonic() < deadline:
            self._bus.handle_timeout(50)
        quiet_until = time.monotonic() + 2.5
        while time.monotonic() < quiet_until:
            self._bus.handle_timeout(50)

    def _on_request(self, _: str, data: bytes) -> None:
        if self._random.random() < self._loss:
            return
        for number in keyframe_request_t.decode(data).ids:
            if number < self._published:
                self._send(number)
                if self.outcome.asked_again:
                    self.outcome.asked_again[-1].add(number)

    def _on_revision(self, _: str, data: bytes) -> None:
        part = smoothed_keyframes_t.decode(data)
        if self._parts and next(iter(self._parts.values())).sequence != part.sequence:
            self._parts.clear()
        self._parts[part.part] = part
        if len(self._parts) < part.part_count:
            return
        self.outcome.revision = part.revision
        if part.full:
            self.outcome.poses.clear()
        for each in self._parts.values():
            rows = np.column_stack([each.px, each.py, each.pz, each.qw, each.qx, each.qy, each.qz])
            self.outcome.poses.update(zip(each.ids, rows, strict=True))
        self._parts.clear()

    def _on_loop(self, _: str, data: bytes) -> None:
        loop = loop_result_t.decode(data)
        if loop.reason == loop_result_t.ACCEPTED:
            self.outcome.loops.add((loop.from_id, loop.to_id))
        elif loop.reason == loop_result_t.WITHDRAWN:
            self.outcome.loops.discard((loop.from_id, loop.to_id))

    def _on_health(self, _: str, data: bytes) -> None:
        health = health_t.decode(data)
        if health.process == "graph_backend":
            self.outcome.health.append(health.state_text)
            if health.pid != self._dead_pid:
                self._dead_pid = None
