# SPDX-License-Identifier: Apache-2.0
"""Real front end and real back ends over one drive with loops: a loop withdrawn and vetoed by command, and a back end
that loses datagrams and is killed beside one that nothing happens to."""

import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from ignis_lcm.ignis import loop_result_t

from graph_listener import GraphListener, wait_until_equal
from ignis import graph
from ignis.pipeline import Pipeline
from seeded_relay import Disturbance, SeededRelay

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
THERE, BACK = ("LIO_KEYFRAME", "LIO_STATE"), ("KEYFRAME_REQUEST",)
SAME_PLACE = 1e-3  # [m]


class Session:
    """A finished drive whose back ends still run."""

    def __init__(self, near: GraphListener, far: GraphListener, relay: SeededRelay, resumed: int) -> None:
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
        beside, behind = GraphListener(BUS), GraphListener(FAR_BUS)
        with SeededRelay(BUS, FAR_BUS, THERE, BACK, Disturbance(loss=LOSS), 11) as relay:
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
            wait_until_equal([beside, behind])
            near.check("l1_sim", "lcm-logplayer")
            far.check()
            yield Session(beside, behind, relay, resumed)


def test_losses_and_kills_end_with_the_graph_of_the_undisturbed_back_end(session: Session) -> None:
    assert len(session.near.poses) > 10
    assert session.near.closed(), "the drive has no loop"
    assert session.relay.count("lost", "LIO_STATE") > 20
    assert session.resumed == len(KILLS)
    assert session.far.distance(session.near) < SAME_PLACE
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
