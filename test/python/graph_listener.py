# SPDX-License-Identifier: Apache-2.0
"""What back ends say on a bus, and waiting until several of them hold the same graph."""

import time
from collections.abc import Sequence

import numpy as np
from ignis_lcm.ignis import health_t, loop_result_t, smoothed_keyframes_t

from ignis.bus import open_bus


class GraphListener:
    """What back ends say on a bus."""

    def __init__(self, url: str) -> None:
        self.loops: list[loop_result_t] = []
        self.poses: dict[int, np.ndarray] = {}
        self.revision = -1
        self.latencies_ms: list[float] = []  # as the back ends tell them, once a second
        self._bus = open_bus(url)
        self._bus.subscribe("LOOP_RESULT", self._on_loop).set_queue_capacity(1000)
        self._bus.subscribe("SMOOTHED_KEYFRAMES", self._on_keyframes).set_queue_capacity(1000)
        self._bus.subscribe("HEALTH", self._on_health)

    def listen(self, seconds: float) -> None:
        """Takes what comes for so long."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._bus.handle_timeout(max(1, int(1e3 * min(left, 0.1))))

    def distance(self, other: "GraphListener") -> float:
        """Largest distance of a keyframe in both [m]; infinite when they do not hold the same ones."""
        if self.poses.keys() != other.poses.keys():
            return float("inf")
        return max((float(np.linalg.norm(self.poses[i] - other.poses[i])) for i in self.poses), default=0.0)

    def closed(self) -> list[tuple[int, int]]:
        """Loops that are in the graph, oldest first."""
        state: dict[tuple[int, int], bool] = {}
        for loop in self.loops:
            stage = loop.stage in (loop_result_t.STAGE_ON_TRIAL, loop_result_t.STAGE_KEPT)
            if stage or loop.stage == loop_result_t.STAGE_WITHDRAWN:
                state[(loop.from_id, loop.to_id)] = stage
        return [pair for pair, is_in in state.items() if is_in]

    def _on_loop(self, _: str, data: bytes) -> None:
        self.loops.append(loop_result_t.decode(data))

    def _on_health(self, _: str, data: bytes) -> None:
        health = health_t.decode(data)
        if health.process == "graph_backend":
            self.latencies_ms.append(health.latency_ms)

    def _on_keyframes(self, _: str, data: bytes) -> None:
        part = smoothed_keyframes_t.decode(data)
        self.revision = max(self.revision, part.revision)
        for i, number in enumerate(part.ids):
            self.poses[number] = np.array([part.px[i], part.py[i], part.pz[i]])


def wait_until_equal(listeners: Sequence[GraphListener], quiet_s: float = 6.0, limit_s: float = 60.0) -> None:
    """Missed keyframes are asked for, and full sets follow every two seconds. Returns at the limit all the same."""
    end = time.monotonic() + limit_s
    quiet_until = time.monotonic() + quiet_s
    while time.monotonic() < end:
        for listener in listeners:
            listener.listen(0.2)
        same = all(listener.poses.keys() == listeners[0].poses.keys() for listener in listeners)
        if same and time.monotonic() > quiet_until:
            return
