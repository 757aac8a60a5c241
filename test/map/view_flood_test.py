# SPDX-License-Identifier: Apache-2.0
"""Row W6: a client that changes its view 10,000 times a second, beside one that looks at a drive in a large map."""

import json
import select
import threading
import time
from typing import Any

import pytest
from l1_endurance import cpu_seconds
from map_load_test import FastViewer, HallDrive
from websocket_frames import CLOSE, PING, frame

from map_drive import URL
from stream_client import ViewState
from stream_server import Server

RATE = 10_000  # view changes a second
SECONDS = 3.0
TICKS_PER_S = 10.0  # hmi.frame_rate_hz
WORK_PER_TICK_S = 0.020
NEWEST = 140.0


def views(first: int, count: int) -> bytes:
    """Requests of which each one asks for another radius."""
    radii = (10 + 5 * (number % 26) for number in range(first, first + count))
    return b"".join(frame(json.dumps({"view": radius}).encode()) for radius in radii)


class Flood(threading.Thread):
    """Comes back at once whenever it is thrown out."""

    def __init__(self, server: Server) -> None:
        super().__init__(daemon=True)
        self.sent = self.connections = 0
        self._server = server
        self._end = time.monotonic() + SECONDS
        self.start()

    def run(self) -> None:
        began = time.monotonic()
        while time.monotonic() < self._end:
            try:
                status, peer = self._server.upgrade()
            except (OSError, IndexError):  # the server has no ear for one that was thrown out a moment ago
                continue
            self.connections += status == 101
            try:
                while not self._is_thrown_out(peer) and (now := time.monotonic()) < self._end:
                    due = min(int(RATE * (now - began)) - self.sent, 500)
                    peer.connection.sendall(views(self.sent, due))
                    self.sent += due
            except OSError:
                pass
            peer.close()

    @staticmethod
    def _is_thrown_out(peer: Any) -> bool:
        """Reads what has come, for 2 ms."""
        while select.select([peer.connection], [], [], 0.002)[0]:
            opcode, payload = peer.receive_one()
            if opcode == CLOSE:
                return True
            if opcode == PING:
                peer.send(payload, opcode=10)
        return False


@pytest.fixture(scope="module")
def hall(private_network: None, start_shared_server: Any) -> tuple[Server, HallDrive]:
    """A server with a map of 200 m by 200 m."""
    server, drive = start_shared_server("--port", "0", url=URL), HallDrive()
    drive.fill()
    return server, drive


def test_fault_w6_ten_thousand_view_changes_a_second_cost_little_work(hall: tuple[Server, HallDrive]) -> None:
    server, drive = hall
    viewer = FastViewer(server)
    drive.drive(2.0)

    def work() -> tuple[float, int]:
        """Seconds of a processor in a stretch of the drive, and frames that the honest viewer got in it."""
        before, frames = cpu_seconds(server.process.pid), len(viewer.frames)
        drive.drive(SECONDS)
        return cpu_seconds(server.process.pid) - before, len(viewer.frames) - frames

    alone, frames_alone = work()
    flood = Flood(server)
    beside, frames_beside = work()
    flood.join()
    per_tick = (beside - alone) / (TICKS_PER_S * SECONDS)
    print(
        f"{flood.sent} changes over {flood.connections} connections; {alone:.2f} s of work alone, {beside:.2f} s beside"
        f" them: {1e3 * per_tick:.1f} ms a tick; {frames_alone} and {frames_beside} frames"
    )
    assert flood.sent > 0.5 * RATE * SECONDS, "that was no flood"
    assert per_tick < WORK_PER_TICK_S
    assert frames_beside > 0.8 * frames_alone


def test_fault_w6_only_the_newest_of_many_views_is_served(hall: tuple[Server, HallDrive]) -> None:
    server, _ = hall
    _, peer = server.upgrade()
    state, frames, announced = ViewState(), 0, {}

    def listen(seconds: float) -> None:
        nonlocal frames, announced
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            if not select.select([peer.connection], [], [], left)[0]:
                return
            opcode, payload = peer.receive_one()
            if opcode == PING:
                peer.send(payload, opcode=10)
            elif opcode == 1:
                announced = json.loads(payload)
            elif opcode == 2:
                state.apply(announced, payload)
                frames += 1

    listen(1.0)
    before = frames
    peer.connection.sendall(views(0, 50) + frame(json.dumps({"view": NEWEST}).encode()))
    listen(1.5)
    print(f"{frames - before} frames after 51 views")
    assert 1 <= frames - before <= 2, "the map stands still: one for the newest view, or two where a tick fell between"
    served = {view["radius"]: view for view in json.loads(server.request("/api/status")[2])["views"]}
    assert served[NEWEST]["checksum"] == f"{state.checksum:016x}"
    peer.close()
