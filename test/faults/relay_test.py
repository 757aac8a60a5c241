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

import ignis_lcm.ignis as types
import numpy as np
import pytest

from fault_drive import CONFIG, SCENE
from graph_listener import GraphListener, wait_until_equal
from ignis.bus import open_bus
from ignis.pipeline import Pipeline
from seeded_relay import Disturbance, SeededRelay
from slow_process import slowed_main_thread

SEED = 20
DRIVE_S = 60.0
SPEED = 2.0
GROUP = "udpm://239.255.76.67:{port}?ttl=0&recv_buf_size=2097152"
NEAR = GROUP.format(port=7667)
SAME_PLACE = 1e-3  # [m]
THERE, BACK = ("LIO_KEYFRAME", "LIO_STATE"), ("KEYFRAME_REQUEST",)
STOP_AT_S, STOP_FOR_S = 8.0, 10.0
WORK_S, PAUSE_S = 0.001, 1.0  # of the slow back end, by turns
STATES_PER_SAMPLE = (250 + 20) / 250  # one for each inertial sample and each scan


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
        "slow": Far(Disturbance(), ("forwarded", "LIO_KEYFRAME", 20)),
        "corrupted": Far(Disturbance(corrupt=0.02), ("corrupted", "LIO_STATE", 100)),
    }


class SlowPhase:
    """What is seen while a back end is stopped and another one slow, and until the slow one has caught up."""

    def __init__(self, near: GraphListener, slow: GraphListener) -> None:
        self.near, self.slow = near, slow
        self.odometry = (0, 0)  # inertial samples in the phase, and states of the front end
        self.behind = 0  # keyframes, in the end
        self.told_ms = 0.0  # latency in HEALTH
        self.ended_at = self.caught_up_s = float("inf")
        self._newest_sample = b""
        self._states: dict[int, int] = {}  # running number by stamp
        self._bus = open_bus(NEAR)
        for channel, take in (("L1_IMU", self._take_sample), ("LIO_STATE", self._take_state)):
            self._bus.subscribe(channel, take).set_queue_capacity(20_000)

    def _take_sample(self, _channel: str, data: bytes) -> None:
        self._newest_sample = data

    def _take_state(self, _channel: str, data: bytes) -> None:
        state = types.state_t.decode(data)
        self._states[state.utime] = state.sequence

    def begin(self) -> None:
        self._first = self._sample()

    def end(self) -> None:
        self._last = self._sample()
        self.behind = len(self.near.poses) - len(self.slow.poses)
        self.ended_at = time.monotonic()

    def close(self) -> None:
        """Once the front end has seen all: its states between the stamps of the two samples, however late they came."""
        self._drain()
        first, last = (
            self._states[max(stamp for stamp in self._states if stamp <= sample.utime)]
            for sample in (self._first, self._last)
        )
        self.odometry = (self._last.sequence - self._first.sequence, last - first)

    def _drain(self) -> None:
        while self._bus.handle_timeout(0) > 0:
            pass

    def look(self) -> None:
        self._drain()
        if time.monotonic() < self.ended_at or self.caught_up_s < float("inf"):
            return
        if self.slow.poses.keys() == self.near.poses.keys():
            self.caught_up_s = time.monotonic() - self.ended_at
            self.told_ms = max(self.slow.latencies_ms)

    def _sample(self) -> types.imu_t:
        """The newest inertial sample."""
        self._drain()
        return types.imu_t.decode(self._newest_sample)


@dataclass
class Session:
    near: GraphListener
    far: dict[str, Far]
    slow: SlowPhase
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
        listener = GraphListener(NEAR)
        result = Session(listener, far, SlowPhase(listener, far["slow"].listener))
        near.start("graph_backend", *config)
        near.start("lio_frontend", *config)
        time.sleep(2.0)
        player = near.start("lcm-logplayer", f"--speed={SPEED}", "--regexp=L1_.*", log)
        began = time.monotonic()
        listeners = [result.near, *(each.listener for each in far.values())]
        hindrance = ExitStack()
        coming = [STOP_AT_S, STOP_AT_S + STOP_FOR_S]
        while player.poll() is None:
            passed = time.monotonic() - began
            assert passed < 5.0 * DRIVE_S, "the player hangs"
            if coming and passed > coming[0]:
                if len(coming) == 2:
                    result.slow.begin()
                    processes["stopped"].send_signal(signal.SIGSTOP)
                    hindrance.callback(processes["stopped"].send_signal, signal.SIGCONT)
                    hindrance.enter_context(slowed_main_thread(processes["slow"].pid, WORK_S, PAUSE_S))
                else:
                    result.slow.end()
                    hindrance.close()
                coming.pop(0)
            for each in listeners:
                each.listen(0.05)
            result.slow.look()
        wait_until_equal([result.near, *(each.listener for name, each in far.items() if name != "corrupted")])
        result.slow.close()
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


def test_fault_g5_a_slow_solver_costs_the_odometry_nothing_is_told_and_catches_up(session: Session) -> None:
    slow = session.slow
    samples, states = slow.odometry
    print(
        f"slow for {STOP_FOR_S:.0f} s: {slow.behind} keyframes behind, told {slow.told_ms:.0f} ms, caught up after"
        f" {slow.caught_up_s:.1f} s; {states} states of {samples} samples meanwhile"
    )
    assert slow.behind >= 2, "it was not slow"
    assert samples > 0.8 * 250 * SPEED * STOP_FOR_S and abs(states - STATES_PER_SAMPLE * samples) < 0.005 * samples
    assert slow.told_ms > 1e3 * PAUSE_S
    assert slow.caught_up_s < STOP_FOR_S, "the phase and as long again"
