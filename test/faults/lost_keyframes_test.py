# SPDX-License-Identifier: Apache-2.0
"""Rows B1 and B5: keyframes that nobody sends again, and one whose number is damaged, at the real back end."""

import time
from pathlib import Path
from typing import Any

import ignis_lcm.ignis as types

from fault_drive import FaultRun
from hostile_messages import LARGEST, sample

OK, DEGRADED = 0, 1


def keyframe(id_: int) -> Any:
    """A sound one, a second and 3 m behind the one before it."""
    message = sample(types.keyframe_t)
    message.id = message.sequence = id_
    message.utime, message.previous_utime = 1_000_000 * (id_ % 100_000 + 1), 1_000_000 * (id_ % 100_000)
    message.position = [0.0, 0.0, -3.0 * (id_ % 100_000)]
    return message


def newest(run: FaultRun) -> Any:
    """What the back end has told last."""
    return run.seen.health["graph_backend"][-1]


def test_fault_b1_keyframes_that_nobody_sends_again_are_given_up_and_told(private_network, tmp_path: Path) -> None:
    with FaultRun(tmp_path, ("graph_backend",)) as run:
        run.send("LIO_KEYFRAME", keyframe(3).encode())
        deadline = time.monotonic() + 60.0
        while not run.seen.poses:
            assert time.monotonic() < deadline, newest(run).state_text
            run.listen(0.5)
        run.listen(1.5)
        told = newest(run)
        assert told.state == DEGRADED
        assert "3 keyframes are given up" in told.state_text
        assert told.queue_drops[told.channels.index("LIO_KEYFRAME")] == 3
        run.send("LIO_KEYFRAME", keyframe(4).encode())
        run.listen(1.5)
        assert "3 keyframes are given up" in newest(run).state_text, "the next one does not hide it"
        said = run.pipeline.last_words("graph_backend")
    assert "keyframes 0 to 2 are given up: nobody sends them again" in said


def test_fault_b5_a_keyframe_with_a_damaged_number_leaves_no_gap_to_wait_for(private_network, tmp_path: Path) -> None:
    with FaultRun(tmp_path, ("graph_backend",)) as run:
        for id_ in (0, 70_000, LARGEST, 1):
            run.send("LIO_KEYFRAME", keyframe(id_).encode())
            run.listen(0.3)
        run.listen(1.5)
        assert set(run.seen.poses) == {0, 1}
        assert newest(run).state == OK, newest(run).state_text
        assert run.seen.rejected("graph_backend", "LIO_KEYFRAME") == 2
