# SPDX-License-Identifier: Apache-2.0
"""A sensor that never ends: one lap of a simulated drive, played again and again with stamps and numbers that go on."""

from __future__ import annotations

import json
import struct
import threading
import time
from pathlib import Path

import ignis_lcm.ignis as types
import lcm
import numpy as np

from ignis.logs import LogEvent, read_events
from ignis.pipeline import Pipeline
from ignis.sim import read_scene

# Behind the fingerprint, all our types begin with int64 utime and int32 sequence.
_HEAD = struct.Struct(">qi")
_HEAD_AT = 8
FIRST_LAP_S = 10.0  # on the leg that all laps share
LEAST_LAP_S = 25.0
LAP_LOG_S = 90.0
SAME_PLACE_M = 0.05


def simulate_laps(scene_file: Path, config: Path, folder: Path, url: str) -> Path:
    """A log of somewhat more than one round of a scene whose way ends on its first leg."""
    scene = read_scene(scene_file)
    scene["geometry"] = ""
    way = scene["trajectory"]["waypoints"]
    scene["trajectory"]["waypoints"] = way + way[1:] * 3
    (folder / "laps.json").write_text(json.dumps(scene))
    log = folder / "laps.lcmlog"
    with Pipeline(folder, url) as pipeline:
        arguments = ("--scene", folder / "laps.json", "--config", config, "--log", log, "--duration", LAP_LOG_S)
        simulator = pipeline.start("l1_sim", *arguments)
        if simulator.wait(900) != 0:
            raise RuntimeError(pipeline.last_words("l1_sim"))
    return log


class LapPlayer(threading.Thread):
    """Publishes the sensor's messages at `speed` times their pace until it is told to end."""

    def __init__(self, log: Path, url: str, speed: float) -> None:
        super().__init__(daemon=True)
        events = [event for event in read_events(log) if event.channel in ("L1_IMU", "L1_SCAN", "GROUND_TRUTH")]
        begin, end = _lap(events)
        sensor = [event for event in events if event.channel != "GROUND_TRUTH"]
        self._prelude = [event for event in sensor if event.utime < begin]
        self._lap = [event for event in sensor if begin <= event.utime < end]
        self.lap_s = 1e-6 * (end - begin)
        self.played_s = 0.0  # of the sensor's time
        self._bus = lcm.LCM(url)
        self._speed = speed
        self._ended = threading.Event()
        self._sequences = dict.fromkeys(("L1_IMU", "L1_SCAN"), 0)

    def run(self) -> None:
        first = self._prelude[0].utime
        began = time.monotonic()
        self._play(self._prelude, 0, first, began)
        shift = 0
        while not self._ended.is_set():
            self._play(self._lap, shift, first, began)
            shift += round(1e6 * self.lap_s)

    def end(self) -> None:
        """Ends it and waits."""
        self._ended.set()
        self.join()

    def _play(self, events: list[LogEvent], shift: int, first: int, began: float) -> None:
        for event in events:
            self.played_s = 1e-6 * (event.utime + shift - first)
            ahead = self.played_s / self._speed - (time.monotonic() - began)
            if ahead > 0.002 and self._ended.wait(ahead):
                return
            data = bytearray(event.data)
            utime, _ = _HEAD.unpack_from(data, _HEAD_AT)
            _HEAD.pack_into(data, _HEAD_AT, utime + shift, self._sequences[event.channel])
            self._sequences[event.channel] += 1
            self._bus.publish(event.channel, bytes(data))


def _lap(events: list[LogEvent]) -> tuple[int, int]:
    """From an instant on the first leg to the one, a round later, at which the vehicle is there again [us]."""
    truth = [types.pose_t.decode(event.data) for event in events if event.channel == "GROUND_TRUTH"]
    at = np.array([event.utime for event in events if event.channel == "GROUND_TRUTH"])
    places = np.array([pose.position for pose in truth])
    turns = np.array([pose.quaternion for pose in truth])
    start = int(np.searchsorted(at, at[0] + 1e6 * FIRST_LAP_S))
    later = at > at[start] + 1e6 * LEAST_LAP_S
    same_way = np.abs(turns @ turns[start]) > 0.999
    distance = np.where(later & same_way, np.linalg.norm(places - places[start], axis=1), np.inf)
    end = int(distance.argmin())
    if distance[end] > SAME_PLACE_M:
        raise ValueError(f"the drive never comes back to where it was: {distance[end]:.2f} m at best")
    return int(at[start]), int(at[end])
