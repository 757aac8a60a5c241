# SPDX-License-Identifier: Apache-2.0
"""Row G4 at the process: keyframes that no solver can put together. The back end says so and keeps what it has."""

import math
import random
from pathlib import Path

import ignis_lcm.ignis as types
import pytest

from fault_drive import BUS, CONFIG
from ignis.bus import Listener
from ignis.pipeline import Pipeline

FAULT, OK = 3, 0
KEYFRAMES = 25
PERIOD_US = 2_000_000
LEAP_M = 740.0  # below the speed that is refused at once
BELIEVED = 1e16  # information: a micrometre and less
SESSIONS = 20
SEED = 72  # of the seeds up to 100, 74 alone makes a graph that cannot be rebuilt
# What makes the back end believe such odometry, and the priors that the seed was looked for with.
TRUSTING = [
    word
    for setting in (
        "odometry_floor_m=1e-6",
        "odometry_floor_rad=1e-7",
        "scan_information_scale=1",
        "prior_position_m=0.001",
        "prior_velocity=0.5",
    )
    for word in ("--set", f"backend.{setting}")
]


def keyframe(session: int, number: int, position: list[float], information: float) -> bytes:
    message = types.keyframe_t()
    message.utime, message.previous_utime = (number + 1) * PERIOD_US, number * PERIOD_US
    message.sequence = message.id = number
    message.session, message.part_count, message.resolution = session, 1, 0.001
    message.position, message.quaternion = position, [1.0, 0.0, 0.0, 0.0]
    message.covariance = [1e-4 * (i % 16 == 0) for i in range(225)]
    message.scan_information = [information * (i % 7 == 0) for i in range(36)]
    return message.encode()


def hopeless_drive(session: int) -> list[bytes]:
    """Leaps of hundreds of metres without IMU, each known to less than a micrometre."""
    generator = random.Random(SEED + session)
    position, messages = [0.0, 0.0, 0.0], []
    for number in range(KEYFRAMES):
        step = [generator.gauss(0.0, 1.0) for _ in range(3)]
        position = [p + LEAP_M * s / math.hypot(*step) for p, s in zip(position, step, strict=True)]
        messages.append(keyframe(session, number, position, BELIEVED))
    return messages


def test_fault_g4_a_graph_that_no_solver_can_rebuild_is_a_fault_until_a_new_session_begins(
    private_network: None, tmp_path: Path
) -> None:
    listener = Listener(BUS, "HEALTH|SMOOTHED_KEYFRAMES")

    def told() -> tuple[int, str]:
        states = [health for (name, _), (_, health) in listener.health.items() if name == "graph_backend"]
        return (states[-1].state, states[-1].state_text) if states else (OK, "")

    with Pipeline(tmp_path, BUS) as pipeline:
        process = pipeline.start("graph_backend", "--config", CONFIG, *TRUSTING, "--journal", tmp_path / "journal")
        listener.listen(1.5)
        for session in range(1, SESSIONS + 1):
            for message in hopeless_drive(session):
                listener.bus.publish("LIO_KEYFRAME", message)
                listener.listen(0.005)
            listener.listen(0.3)
            print(session, told())
            if told()[0] == FAULT:
                break
        else:
            pytest.fail("every one of these graphs could be solved: the test shows nothing")
        assert "the graph takes no more keyframes: the graph cannot be rebuilt" in told()[1]
        held = listener.channels["SMOOTHED_KEYFRAMES"].newest.graph_keyframes
        listener.listen(2.5)  # it goes on to publish what it has
        newest = listener.channels["SMOOTHED_KEYFRAMES"].newest
        assert newest.full == 1 and newest.graph_keyframes == held
        assert all(map(math.isfinite, [*newest.px, *newest.py, *newest.pz]))
        assert told()[0] == FAULT and process.poll() is None
        for number in range(3):
            listener.bus.publish("LIO_KEYFRAME", keyframe(session + 1, number, [0.0, 0.0, -2.0 * number], 1e4))
        listener.listen(2.0)
        print(told())
        assert told()[0] == OK
        assert listener.channels["SMOOTHED_KEYFRAMES"].newest.graph_keyframes == 3
