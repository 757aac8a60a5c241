# SPDX-License-Identifier: Apache-2.0
"""Real front end and real back ends over one drive with loops: a loop withdrawn and vetoed by command, and a back end
that loses datagrams and is killed beside one that nothing happens to."""

import os
import signal
import subprocess
import time
from pathlib import Path

import lcm
import numpy as np
import pytest
from ignis_lcm.ignis import loop_result_t, smoothed_keyframes_t

from ignis import graph
from ignis.pipeline import Pipeline
from lossy_relay import LossyRelay

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
DRIVE_SECONDS = 60.0
SPEED = 2.0
KILLS = (9.0, 17.0, 24.0)  # [s] after the start of the player
LOSS = 0.1
OPTIONS = "?ttl=0&recv_buf_size=2097152"
BUS = "udpm://239.255.76.67:7667" + OPTIONS
FAR_BUS = "udpm://239.255.76.67:7668" + OPTIONS  # behind the relay
SAME_PLACE = 1e-3  # [m]


class Listener:
    """What back ends say on a bus."""

    def __init__(self, url: str) -> None:
        self.loops: list[loop_result_t] = []
        self.poses: dict[int, np.ndarray] = {}
        self.revision = -1
        self._bus = lcm.LCM(url)
        self._bus.subscribe("LOOP_RESULT", self._on_loop).set_queue_capacity(1000)
        self._bus.subscribe("SMOOTHED_KEYFRAMES", self._on_keyframes).set_queue_capacity(1000)

    def listen(self, seconds: float) -> None:
        """Takes what comes for so long."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._bus.handle_timeout(max(1, int(1e3 * min(left, 0.1))))

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

    def _on_keyframes(self, _: str, data: bytes) -> None:
        part = smoothed_keyframes_t.decode(data)
        self.revision = max(self.revision, part.revision)
        for i, number in enumerate(part.ids):
            self.poses[number] = np.array([part.px[i], part.py[i], part.pz[i]])


class Session:
    """A finished drive whose back ends still run."""

    def __init__(self, near: Listener, far: Listener, relay: LossyRelay, resumed: int) -> None:
        self.near, self.far, self.relay, self.resumed = near, far, relay, resumed


def restart_killed(pipeline: Pipeline, backend: subprocess.Popen, arguments: tuple[object, ...]) -> subprocess.Popen:
    backend.send_signal(signal.SIGKILL)
    backend.wait()
    return pipeline.start("graph_backend", *arguments)


@pytest.fixture(scope="module")
def session(private_network, tmp_path_factory: pytest.TempPathFactory):
    """One drive through lio_frontend, a back end beside it, and one behind the relay that is killed again and again."""
    folder = tmp_path_factory.mktemp("pair")
    log = folder / "drive.lcmlog"
    config = ("--config", CONFIG)
    far_arguments = (*config, "--journal", folder / "journal")
    (folder / "far").mkdir()
    with Pipeline(folder, BUS) as near, Pipeline(folder / "far", FAR_BUS) as far:
        simulator = near.start("l1_sim", "--scene", SCENE, *config, "--log", log, "--duration", DRIVE_SECONDS)
        assert simulator.wait(300) == 0, near.last_words("l1_sim")
        beside, behind = Listener(BUS), Listener(FAR_BUS)
        with LossyRelay(BUS, FAR_BUS, ["LIO_KEYFRAME", "LIO_STATE"], ["KEYFRAME_REQUEST"], LOSS, 11) as relay:
            near.start("lio_frontend", *config)
            near.start("graph_backend", *config)
            backend = far.start("graph_backend", *far_arguments)
            time.sleep(2.0)
            player = near.start("lcm-logplayer", f"--speed={SPEED}", "--regexp=L1_.*", log)
            began = time.monotonic()
            kills = list(KILLS)
            resumed = 0
            while player.poll() is None:
                assert time.monotonic() - began < 5.0 * DRIVE_SECONDS, "the player hangs"
                beside.listen(0.1)
                behind.listen(0.1)
                if kills and time.monotonic() - began > kills[0]:
                    kills.pop(0)
                    backend = restart_killed(far, backend, far_arguments)
                    behind.listen(1.5)
                    resumed += "resumed" in far.last_words("graph_backend")
            wait_until_equal(beside, behind)
            near.check("l1_sim", "lcm-logplayer")
            far.check()
            yield Session(beside, behind, relay, resumed)


def wait_until_equal(beside: Listener, behind: Listener) -> None:
    """Missed keyframes are asked for, and full sets follow every two seconds."""
    end = time.monotonic() + 60.0
    quiet_until = time.monotonic() + 6.0
    while time.monotonic() < end:
        beside.listen(0.2)
        behind.listen(0.2)
        if beside.poses.keys() == behind.poses.keys() and time.monotonic() > quiet_until:
            return


def test_losses_and_kills_end_with_the_graph_of_the_undisturbed_back_end(session: Session) -> None:
    assert len(session.near.poses) > 10
    assert session.near.closed(), "the drive has no loop"
    assert session.relay.dropped > 20
    assert session.resumed == len(KILLS)
    assert session.far.poses.keys() == session.near.poses.keys()
    largest = max(np.linalg.norm(session.far.poses[i] - session.near.poses[i]) for i in session.near.poses)
    assert largest < SAME_PLACE
    assert session.far.revision == session.near.revision


def send(command: str, pair: tuple[int, int]) -> int:
    return graph.main(["--lcm-url", BUS, command, *map(str, pair)])


def test_a_real_loop_is_withdrawn_by_command(session: Session) -> None:
    near = session.near
    pair = near.closed()[-1]
    before, revision, heard = dict(near.poses), near.revision, len(near.loops)
    assert send("withdraw", pair) == 0
    near.listen(3.0)
    answers = [loop for loop in near.loops[heard:] if (loop.from_id, loop.to_id) == pair]
    assert [loop.stage for loop in answers] == [loop_result_t.STAGE_WITHDRAWN]
    assert answers[0].reason == loop_result_t.WITHDRAWN
    assert "by command" in answers[0].reason_text
    assert near.revision == revision + 1
    assert pair not in near.closed()
    moved = max(np.linalg.norm(near.poses[i] - before[i]) for i in before)
    assert 1e-4 < moved < 0.5, "the poses do not show that the loop is gone"


def test_a_vetoed_loop_is_answered_and_leaves_the_others(session: Session) -> None:
    near = session.near
    pair = near.closed()[-1]
    others = near.closed()[:-1]
    heard = len(near.loops)
    assert send("veto", pair) == 0
    near.listen(3.0)
    assert any(
        (loop.from_id, loop.to_id) == pair and loop.stage == loop_result_t.STAGE_WITHDRAWN
        for loop in near.loops[heard:]
    )
    assert near.closed() == others
    assert send("withdraw", pair) == 0
    near.listen(1.0)
    assert near.loops[-1].reason_text == "there is no such loop to withdraw"
