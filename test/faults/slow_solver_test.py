# SPDX-License-Identifier: Apache-2.0
"""Row G5: what waits for a back end whose solver stands still, and what becomes of it."""

import time
from pathlib import Path

import ignis_lcm.ignis as types

from fault_drive import BUS, CONFIG
from ignis.bus import Listener
from ignis.pipeline import Pipeline
from slow_process import stopped_main_thread

KEYFRAMES = 110  # some minutes of driving
PERIOD_US, STEP_M = 1_500_000, 1.5
PARTS, POINTS = 4, 2900  # of an L1's keyframe, and of a part
MOST_WAITING = 50
PAUSE_S = 0.002  # LCM's receiver keeps up
SECONDS = 30.0


def part_of(number: int, part: int) -> bytes:
    """Of a keyframe straight ahead."""
    message = types.keyframe_t()
    message.utime, message.previous_utime = (number + 1) * PERIOD_US, number * PERIOD_US
    message.sequence = message.id = number
    message.session, message.part, message.part_count, message.resolution = 1, part, PARTS, 0.001
    message.position, message.quaternion = [0.0, 0.0, -STEP_M * number], [1.0, 0.0, 0.0, 0.0]
    message.covariance = [1e-4 * (i % 16 == 0) for i in range(225)]
    message.scan_information = [1e4 * (i % 7 == 0) for i in range(36)]
    message.num_points = POINTS
    message.x, message.y, message.z = ([(axis + i) % 9000 for i in range(POINTS)] for axis in (0, 3000, 6000))
    message.intensity = bytes(POINTS)
    return message.encode()


def test_fault_g5_fifty_keyframes_wait_for_a_solver_that_stands_still_and_the_others_are_asked_for(
    private_network: None, tmp_path: Path
) -> None:
    listener = Listener(
        BUS, "HEALTH|SMOOTHED_KEYFRAMES|KEYFRAME_REQUEST", lambda channel, message: take(channel, message)
    )
    drive = [[part_of(number, part) for part in range(PARTS)] for number in range(KEYFRAMES)]
    asked: set[int] = set()
    held = 0

    def take(channel: str, message: object) -> None:
        nonlocal held
        if channel == "SMOOTHED_KEYFRAMES":
            held = message.graph_keyframes
        elif channel == "KEYFRAME_REQUEST":
            for number in message.ids:
                if number < KEYFRAMES:
                    asked.add(number)
                    send(number)

    def send(number: int) -> None:
        for part in drive[number]:
            listener.bus.publish("LIO_KEYFRAME", part)
            time.sleep(PAUSE_S)

    options = ("--config", CONFIG, "--set", "backend.use_loop_closing=false")
    with Pipeline(tmp_path, BUS) as pipeline:
        process = pipeline.start("graph_backend", *options)
        assert listener.bus.wait_until(lambda: "HEALTH" in listener.channels, SECONDS)
        with stopped_main_thread(process.pid):
            for number in range(KEYFRAMES):
                send(number)
        assert listener.bus.wait_until(lambda: held == KEYFRAMES, SECONDS), held
    waited = KEYFRAMES - len(asked)
    print(f"{waited} keyframes had waited, {len(asked)} were asked for")
    assert waited <= MOST_WAITING
    assert waited > 0 and asked >= set(range(MOST_WAITING, KEYFRAMES)), "the oldest wait"
