# SPDX-License-Identifier: Apache-2.0
"""A short simulated drive played to the real processes, while something goes wrong, and what they made of it."""

from __future__ import annotations

import json
import os
import random
import time
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import ignis_lcm.ignis as types
from l1_endurance import cpu_seconds

from ignis.bus import open_bus
from ignis.logs import LogEvent
from ignis.pipeline import Pipeline

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
BUS = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152"
PORT = 18095
SECONDS = 14.0
SPEED = 2.0  # of the replay
WHOLE_S = 3.0  # of the drive, for the start
MEAN_BURST = 3  # messages that are lost at a time


def record_drive(folder: Path, seconds: float = SECONDS) -> Path:
    """Simulates the beginning of a drive; its log holds what the driver would publish, and the truth."""
    log = folder / "drive.lcmlog"
    with Pipeline(folder, BUS) as pipeline:
        simulator = pipeline.start("l1_sim", "--scene", SCENE, "--config", CONFIG, "--log", log, "--duration", seconds)
        if simulator.wait(300) != 0:
            raise RuntimeError(pipeline.last_words("l1_sim"))
    return log


def lossy(events: list[LogEvent], share: float, generator: random.Random) -> list[LogEvent]:
    """Loses this share of the sensor's messages, in bursts; the first three seconds stay whole for the start."""
    kept, left = [], 0
    begin = events[0].utime + 1e6 * WHOLE_S
    for event in events:
        if event.channel in ("L1_IMU", "L1_SCAN") and event.utime > begin:
            if left == 0 and generator.random() < share / (MEAN_BURST * (1.0 - share)):
                left = generator.randint(1, 2 * MEAN_BURST - 1)
            if left > 0:
                left -= 1
                continue
        kept.append(event)
    return kept


@dataclass
class Seen:
    """What was on the bus."""

    keyframes: dict[int, bytes] = field(default_factory=dict)
    poses: dict[int, tuple[float, ...]] = field(default_factory=dict)
    states: list[int] = field(default_factory=list)  # stamps of LIO_STATE
    states_sent: int = 0  # by their running number, so that it counts those too that did not arrive here
    smoothed: list[Any] = field(default_factory=list)
    health: dict[str, list[Any]] = field(default_factory=dict)
    status: dict[str, Any] = field(default_factory=dict)
    frontend_work: float = 0.0  # [s] of a processor

    def newest_with_data(self) -> Any:
        """The front end's last word before it missed the player, which had ended."""
        spoken = self.health["lio_frontend"]
        return next(each for each in reversed(spoken) if not each.state_text.startswith("no sensor data"))

    def rejected(self, process: str, channel: str) -> int:
        """What the process says that it refused on the channel."""
        newest = self.health[process][-1]
        return newest.rejected[newest.channels.index(channel)]


class FaultRun:
    """The front end, the back end and the map, and a listener that may also send. A context manager."""

    def __init__(
        self,
        folder: Path,
        names: tuple[str, ...] = ("map_builder", "graph_backend", "lio_frontend"),
        map_options: tuple[str | Path, ...] = (),
        frontend_options: tuple[str | Path, ...] = (),
        backend_options: tuple[str | Path, ...] = (),
    ) -> None:
        self.seen = Seen()
        self.killed: set[str] = set()  # and not yet started again
        self.hostile: set[int] = set()  # hashes of what the tests themselves have sent
        self.pipeline = Pipeline(folder, BUS)
        self.bus = open_bus(BUS)
        self._names = names
        self._options = {
            "map_builder": ("--port", PORT, *map_options),
            "lio_frontend": frontend_options,
            "graph_backend": backend_options,
        }
        for channel, take in {
            "LIO_KEYFRAME": self._on_keyframe,
            "SMOOTHED_KEYFRAMES": self._on_revision,
            "LIO_STATE": self._on_state,
            "SMOOTHED_STATE": lambda data: self.seen.smoothed.append(types.state_t.decode(data)),
            "HEALTH": self._on_health,
        }.items():
            self.bus.subscribe(channel, self._guarded(take)).set_queue_capacity(20_000)

    def __enter__(self) -> FaultRun:
        for name in self._names:
            self._start(name)
        self.listen(1.0)
        wanted = set(self._names)
        deadline = time.monotonic() + 20.0
        while set(self.seen.health) < wanted:
            assert time.monotonic() < deadline, f"only {set(self.seen.health)} spoke"
            self.listen(0.1)
        return self

    def _start(self, name: str) -> None:
        self.pipeline.start(name, "--config", CONFIG, *self._options.get(name, ()))

    def start_sensor(self, folder: Path) -> Path:
        """A sensor that goes on by itself; returns the serial port that the driver reads it from."""
        port = folder / "l1.pty"
        self.pipeline.start("l1_sim", "--scene", SCENE, "--config", CONFIG, "--pty", port, "--wait", 30)
        self.pipeline.wait_for_text("l1_sim", "waiting", 20.0)
        return port

    def kill_and_restart(self, name: str) -> None:
        """Kills a process and starts it again at once."""
        self.kill(name)
        self.restart(name)

    def kill(self, name: str) -> None:
        """Kills a process; nobody minds that it is gone until it is started again."""
        self.killed.add(name)
        self.pipeline.processes[name].kill()
        self.pipeline.processes[name].wait()

    def restart(self, name: str) -> None:
        """Starts one again that was killed."""
        self.killed.discard(name)
        self._start(name)

    def __exit__(self, *_: object) -> None:
        self.pipeline.stop(*reversed(self.pipeline.processes))

    def _guarded(self, take: Callable[[bytes], None]) -> Callable[[str, bytes], None]:
        def handler(_: str, data: bytes) -> None:
            # What is not ours may be anything.
            if hash(data) not in self.hostile:
                take(data)

        return handler

    def _on_keyframe(self, data: bytes) -> None:
        part = types.keyframe_t.decode(data)
        if part.part == 0:
            self.seen.keyframes.setdefault(part.id, data)

    def _on_revision(self, data: bytes) -> None:
        part = types.smoothed_keyframes_t.decode(data)
        rows = zip(part.px, part.py, part.pz, part.qw, part.qx, part.qy, part.qz, strict=True)
        self.seen.poses.update(zip(part.ids, rows, strict=True))

    def _on_state(self, data: bytes) -> None:
        state = types.state_t.decode(data)
        self.seen.states.append(state.utime)
        self.seen.states_sent = max(self.seen.states_sent, state.sequence + 1)

    def _on_health(self, data: bytes) -> None:
        message = types.health_t.decode(data)
        if message.pid in {process.pid for process in self.pipeline.processes.values()}:
            self.seen.health.setdefault(message.process, []).append(message)

    def work(self, name: str) -> float:
        """Seconds of a processor that a process has taken so far."""
        return cpu_seconds(self.pipeline.processes[name].pid)

    def send(self, channel: str, body: bytes) -> None:
        """Publishes what nobody should send; the listener knows it again."""
        self.hostile.add(hash(body))
        self.bus.publish(channel, body)

    def listen(self, seconds: float) -> None:
        """Handles what arrives for so long; every process must live."""
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            self.bus.handle_timeout(max(int(1000 * left), 1))
        self.pipeline.check("lcm-logplayer", *self.killed)

    def play(self, log: Path, meanwhile: Callable[[float], None] = lambda _: None, speed: float = SPEED) -> None:
        """Plays the sensor's part of a log; `meanwhile` is called often with the seconds since the start."""
        player = self.pipeline.start("lcm-logplayer", f"--speed={speed}", "--regexp=L1_(IMU|SCAN)", log)
        began = time.monotonic()
        while player.poll() is None:
            for _ in range(20):
                self.bus.handle_timeout(2)
            meanwhile(time.monotonic() - began)
            self.pipeline.check("lcm-logplayer", *self.killed)
        assert player.returncode == 0
        self.listen(3.5)  # a full set of poses comes every two seconds, HEALTH every second

    def view_status(self, seconds: float = 3.0) -> dict[str, Any]:
        """What the map's status page says, when it answers in time."""
        with urllib.request.urlopen(f"http://127.0.0.1:{PORT}/api/status", timeout=seconds) as answer:
            return json.load(answer)
