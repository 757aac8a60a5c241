# SPDX-License-Identifier: Apache-2.0
"""Row M3: a map that lags. What waits on the bus meanwhile is bounded, and what found no place is asked for again."""

import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np
from ignis_lcm import ignis as types

from map_drive import SCAN_PERIOD, SPEED, URL, Drive, hall_scan
from slow_process import stopped_main_thread

KEYFRAMES = 420  # more than the queue takes
COPIES = 4000  # as when a back end that lags has them sent again and again
POINTS = 2900  # as many as fit one message
SPACING_M = 2.0
PAUSE_S = 0.0005  # the receiving thread keeps up
MAX_BACKLOG_MB = 40.0
SECONDS = 20.0


def resident_mb(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def step_of(number: int) -> int:
    """The scan of a keyframe."""
    return round(number * SPACING_M / (SPEED * SCAN_PERIOD))


class Sender(Drive):
    """A front end that keeps what it sent and sends it again when asked, and a back end that counts it."""

    def __init__(self) -> None:
        super().__init__()
        self.scan = hall_scan(np.zeros(3), self.generator, POINTS)
        self.asked = 0
        self.bus.subscribe("KEYFRAME_REQUEST", self._send_again)

    def send(self, number: int) -> None:
        self.step = step_of(number - 1)
        self.last_keyframe_stamp = self.stamp()  # also of one that is sent again
        self.step = step_of(number)
        del self.keyframes[number:]  # its length is the next id
        self.publish_keyframe(self.position(), self.scan)

    def announce(self) -> None:
        graph = types.smoothed_keyframes_t()  # one more than was sent: the newest is not asked for yet
        graph.part_count, graph.graph_keyframes, graph.newest_id = 1, KEYFRAMES + 1, KEYFRAMES
        graph.map_odom_quaternion = [1.0, 0.0, 0.0, 0.0]
        self.bus.publish("SMOOTHED_KEYFRAMES", graph.encode())

    def _send_again(self, _channel: str, data: bytes) -> None:
        request = types.keyframe_request_t.decode(data)
        for number in request.ids:
            self.asked += 1
            self.send(number)


def test_fault_m3_a_map_that_lags_holds_a_bounded_backlog_and_asks_for_the_rest(
    private_network: None, start_server: Any
) -> None:
    server = start_server("--port", "0", url=URL)
    pid = server.process.pid
    sender = Sender()
    sender.send(0)
    time.sleep(1.0)
    before = resident_mb(pid)
    with stopped_main_thread(pid):
        for number in [*range(KEYFRAMES), *[KEYFRAMES - 1] * COPIES]:
            sender.keyframes += [None] * (number - len(sender.keyframes))
            sender.send(number)
            time.sleep(PAUSE_S)
        backlog = resident_mb(pid) - before
    deadline = time.monotonic() + SECONDS
    while time.monotonic() < deadline and json.loads(server.request("/api/status")[2])["keyframes"] < KEYFRAMES:
        sender.announce()
        sender.bus.handle_timeout(300)
    told = json.loads(server.request("/api/status")[2])
    print(f"backlog {backlog:.1f} MB, {sender.asked} keyframes asked for again, {told['keyframes']} in the map")
    assert backlog < MAX_BACKLOG_MB
    assert told["keyframes"] == KEYFRAMES
    assert sender.asked > 0, "nothing overflowed: the test shows nothing"
    assert server.stop() == 0
