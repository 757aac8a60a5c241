# SPDX-License-Identifier: Apache-2.0
"""Which drive the map shows: front ends that start cold, and messages of a session that nobody drives."""

import json
import math
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from map_drive import LARGEST, URL, Drive, forged_message, hall_scan
from stream_server import Server

PAUSE_S = 0.002  # between two scans


class FollowedDrive(Drive):
    """A drive and the map_builder that follows it."""

    def __init__(self, server: Server, session: int = 0) -> None:
        super().__init__(session=session)
        self.server = server

    def advance_by(self, steps: int) -> None:
        for _ in range(steps):
            self.advance()
            time.sleep(PAUSE_S)

    def wait_for(self, condition: Callable[[dict[str, Any]], bool], seconds: float = 10.0) -> dict[str, Any]:
        deadline = time.monotonic() + seconds
        while not condition(status := json.loads(self.server.request("/api/status")[2])):
            assert time.monotonic() < deadline, status
            time.sleep(0.05)
        return status

    def wait_until_shown(self) -> dict[str, Any]:
        """Until the map holds this drive's keyframes, and nothing but these and what came before the first."""
        known = len(self.keyframes)
        return self.wait_for(lambda status: known <= status.get("keyframes", 0) <= known + 1)


@pytest.fixture
def server(private_network: None, start_server: Callable[..., Server]) -> Iterator[Server]:
    running = start_server("--port", "0", url=URL)
    yield running
    assert running.stop() == 0


@pytest.mark.parametrize("before", [0, 1, 7])
def test_a_front_end_that_starts_cold_begins_the_map_anew(server: Server, before: int) -> None:
    drive = FollowedDrive(server, session=before)
    drive.advance_by(90)
    assert len(drive.keyframes) == 5
    drive.wait_until_shown()
    drive.start_cold()
    drive.advance_by(30)
    assert len(drive.keyframes) == 1, "fewer than the map has of the old drive"
    status = drive.wait_until_shown()
    drive.publish_correction(1)
    status = drive.wait_for(lambda status: status["revision"] == 1)
    assert status["keyframes"] <= 2


@pytest.mark.parametrize("kind", ["LIO_CLOUD", "LOOP_RESULT", "SMOOTHED_KEYFRAMES"])
def test_a_message_of_a_session_that_nobody_drives_ends_no_drive_and_is_counted(server: Server, kind: str) -> None:
    drive = FollowedDrive(server)
    drive.advance_by(90)
    shown = drive.wait_until_shown()
    drive.bus.publish(*forged_message(kind))
    drive.wait_for(lambda status: "1 messages of another session than 0 refused" in status["health"])
    drive.advance_by(30)
    after = drive.wait_for(lambda status: status["keyframes"] == len(drive.keyframes) + 1)
    assert after["keyframes"] > shown["keyframes"]


def test_after_a_forged_keyframe_of_another_session_the_drive_comes_back(server: Server) -> None:
    drive = FollowedDrive(server)
    drive.advance_by(60)
    drive.wait_until_shown()
    stranger = Drive(session=LARGEST)
    stranger.publish_keyframe(stranger.position(), drive.generator.uniform(-3, 3, (50, 3)))
    drive.wait_for(lambda status: status["keyframes"] == 1)
    drive.advance_by(60)
    assert len(drive.keyframes) == 6
    drive.wait_for(lambda status: status["keyframes"] >= 3)


@pytest.mark.parametrize(("kind", "refused"), [("clouds", (1, 0)), ("poses", (0, 1))])
def test_a_refused_message_is_told_while_it_is_new_and_stays_counted(
    server: Server, kind: str, refused: tuple[int, int]
) -> None:
    drive = FollowedDrive(server)
    drive.advance_by(20)
    drive.wait_for(lambda status: status["health"] == "OK")
    far_away = [1e7, 0.0, 0.0]
    if kind == "clouds":
        drive.publish_cloud(far_away, hall_scan([0.0, 0.0, 0.0], drive.generator))
    else:
        drive.publish_state(far_away)
    drive.wait_for(lambda status: "{} clouds and {} poses refused".format(*refused) in status["health"])
    status = drive.wait_for(lambda status: status["health"] == "OK")
    assert (status["refused"]["clouds"], status["refused"]["poses"]) == refused


def test_fault_m1_points_that_no_map_can_hold_are_refused_and_counted(server: Server) -> None:
    drive = FollowedDrive(server)
    drive.advance_by(20)
    drive.wait_for(lambda status: status["health"] == "OK" and status["clouds_inserted"] == 20)
    scan = hall_scan([0.0, 0.0, 0.0], drive.generator)
    mixed = scan.copy()
    mixed[7] = [0.0, math.nan, 0.0]
    drive.publish_cloud(drive.position(), mixed)
    text = "0 clouds and 0 poses refused, and 1 points that no map can hold"
    before = drive.wait_for(lambda status: text in status["health"])
    assert before["clouds_inserted"] == 21, "the sound points of a mixed scan are used"
    for value in (math.nan, 1e30):
        drive.publish_cloud(drive.position(), np.full_like(scan, value))
    after = drive.wait_for(lambda status: status["refused"]["clouds"] == 2)
    assert after["refused"]["points"] == 1 + 2 * len(scan) and after["refused"]["poses"] == 0
    assert after["clouds_inserted"] == 21 and after["voxels"] == before["voxels"]
    drive.wait_for(lambda status: status["health"] == "OK")


def test_keyframes_that_nobody_sends_are_given_up_by_name(server: Server) -> None:
    drive = FollowedDrive(server)
    drive.advance_by(60)
    drive.wait_until_shown()
    # The graph has two keyframes more, of which the newest may still be on its way.
    drive.keyframes += [drive.keyframes[-1]] * 2
    drive.publish_correction(1)
    status = drive.wait_for(lambda status: "given up" in status["health"], seconds=30.0)
    assert "the clouds of 1 keyframes are given up: nobody sends them again" in status["health"]
    assert status["keyframes_given_up"] == 1
