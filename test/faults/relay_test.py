# SPDX-License-Identifier: Apache-2.0
"""Rows B1 and G5: one drive, a back end beside the front end and others behind relays that each spoil the way.

Every relay stands between two real buses; its generator is seeded. All run in the same drive, so that they are judged
by the same keyframes.
"""

import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field

import numpy as np
import pytest

from fault_drive import CONFIG, SCENE
from graph_listener import GraphListener, wait_until_equal
from ignis.pipeline import Pipeline
from seeded_relay import Disturbance, SeededRelay

SEED = 20
DRIVE_S = 60.0
SPEED = 2.0
GROUP = "udpm://239.255.76.67:{port}?ttl=0&recv_buf_size=2097152"
NEAR = GROUP.format(port=7667)
SAME_PLACE = 1e-3  # [m]
THERE, BACK = ("LIO_KEYFRAME", "LIO_STATE"), ("KEYFRAME_REQUEST",)
STOP_AT_S, STOP_FOR_S = 8.0, 10.0


@dataclass
class Far:
    """A back end behind a relay, and what must be seen of the disturbance for the test to mean anything."""

    disturbance: Disturbance
    evidence: tuple[str, str, int]  # what the relay must have done to a channel, and how often at least
    listener: GraphListener | None = None
    relay: SeededRelay | None = None


def far_back_ends() -> dict[str, Far]:
    return {
        "1 % lost": Far(Disturbance(loss=0.01), ("lost", "LIO_STATE", 50)),
        "10 % lost in bursts": Far(Disturbance(loss=0.10, burst=3), ("lost", "LIO_KEYFRAME", 1)),
        "30 % lost": Far(Disturbance(loss=0.30), ("lost", "LIO_KEYFRAME", 5)),
        "delayed, overtaking, doubled": Far(Disturbance(delay_s=0.1, duplicate=0.05), ("doubled", "LIO_KEYFRAME", 1)),
        "stopped": Far(Disturbance(), ("forwarded", "LIO_KEYFRAME", 20)),
        "corrupted": Far(Disturbance(corrupt=0.02), ("corrupted", "LIO_STATE", 100)),
    }


@dataclass
class Session:
    near: GraphListener
    far: dict[str, Far]
    alive: dict[str, bool] = field(default_factory=dict)


@pytest.fixture(scope="module")
def session(private_network: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    """The finished drive."""
    folder = tmp_path_factory.mktemp("relays")
    log, config = folder / "drive.lcmlog", ("--config", CONFIG)
    far = far_back_ends()
    print("seed", SEED)
    with ExitStack() as stack:
        near = stack.enter_context(Pipeline(folder, NEAR))
        simulator = near.start("l1_sim", "--scene", SCENE, *config, "--log", log, "--duration", DRIVE_S)
        assert simulator.wait(300) == 0, near.last_words("l1_sim")
        processes = {}
        for number, (name, each) in enumerate(far.items()):
            url = GROUP.format(port=7671 + number)
            pipeline = stack.enter_context(Pipeline(folder / f"far{number}", url))
            each.listener = GraphListener(url)
            each.relay = stack.enter_context(SeededRelay(NEAR, url, THERE, BACK, each.disturbance, SEED + 2 * number))
            processes[name] = pipeline.start("graph_backend", *config)
        result = Session(GraphListener(NEAR), far)
        near.start("graph_backend", *config)
        near.start("lio_frontend", *config)
        time.sleep(2.0)
        player = near.start("lcm-logplayer", f"--speed={SPEED}", "--regexp=L1_.*", log)
        began = time.monotonic()
        listeners = [result.near, *(each.listener for each in far.values())]
        stopped = processes["stopped"]
        while player.poll() is None:
            passed = time.monotonic() - began
            assert passed < 5.0 * DRIVE_S, "the player hangs"
            if STOP_AT_S < passed < STOP_AT_S + 1.0:
                stopped.send_signal(signal.SIGSTOP)
            elif passed > STOP_AT_S + STOP_FOR_S:
                stopped.send_signal(signal.SIGCONT)
            for listener in listeners:
                listener.listen(0.05)
        wait_until_equal([result.near, *(each.listener for name, each in far.items() if name != "corrupted")])
        near.check("l1_sim", "lcm-logplayer")
        result.alive = {name: process.poll() is None for name, process in processes.items()}
        yield result


@pytest.mark.parametrize("name", [name for name in far_back_ends() if name != "corrupted"])
def test_fault_b1_the_graph_behind_a_bad_network_is_the_one_beside_the_front_end(session: Session, name: str) -> None:
    far = session.far[name]
    kind, channel, at_least = far.evidence
    print(name, far.relay, "largest distance [m]", far.listener.distance(session.near))
    assert far.relay.count(kind, channel) >= at_least, "the relay did nothing"
    assert len(session.near.poses) > 10 and session.near.closed(), "a drive with loops"
    assert far.listener.distance(session.near) < SAME_PLACE
    assert far.listener.revision == session.near.revision
    assert far.listener.closed() == session.near.closed()


def test_fault_b5_altered_bits_on_the_way_end_no_back_end_and_poison_no_graph(session: Session) -> None:
    far = session.far["corrupted"]
    print(far.relay, len(far.listener.poses), "of", len(session.near.poses), "keyframes")
    kind, channel, at_least = far.evidence
    assert far.relay.count(kind, channel) >= at_least
    assert session.alive["corrupted"]
    assert far.listener.poses and all(np.isfinite(pose).all() for pose in far.listener.poses.values())
