# SPDX-License-Identifier: Apache-2.0
"""Row B6: commands to the graph that are none, that name no keyframes of it, or that come without end."""

import time
from pathlib import Path

import ignis_lcm.ignis as types
from lost_keyframes_test import keyframe, newest

from fault_drive import FaultRun
from hostile_messages import LARGEST, SMALLEST

FLOOD = 300
AT_ONCE, PER_SECOND = 50, 10  # commands that the back end carries out


def command(kind: int, from_id: int, to_id: int) -> bytes:
    message = types.graph_command_t()
    message.session, message.command, message.from_id, message.to_id = -1, kind, from_id, to_id
    return message.encode()


def test_fault_b6_commands_that_are_none_or_come_without_end_are_refused_by_name(
    private_network, tmp_path: Path
) -> None:
    answers: list[types.loop_result_t] = []
    veto = types.graph_command_t.VETO_LOOP
    with FaultRun(tmp_path, ("graph_backend",)) as run:
        for id_ in range(4):
            run.send("LIO_KEYFRAME", keyframe(id_).encode())
        run.listen(1.0)
        assert set(run.seen.poses) == set(range(4)), newest(run).state_text
        run.bus.subscribe("LOOP_RESULT", lambda _, data: answers.append(types.loop_result_t.decode(data)))

        run.send("GRAPH_COMMAND", command(77, 3, 0))
        run.listen(1.5)
        assert not answers
        assert "GRAPH_COMMAND: refused 1 messages, the last one: there is no such command" in newest(run).state_text

        for from_id, to_id in ((SMALLEST, LARGEST), (3, 4), (3, 3)):
            run.send("GRAPH_COMMAND", command(veto, from_id, to_id))
        run.listen(1.5)
        assert {answer.reason_text for answer in answers} == {"the graph does not hold these two keyframes"}
        assert [(answer.from_id, answer.to_id) for answer in answers] == [(SMALLEST, LARGEST), (3, 4), (3, 3)]
        assert run.seen.rejected("graph_backend", "GRAPH_COMMAND") == 4

        answers.clear()
        began = time.monotonic()
        for _ in range(FLOOD):
            run.send("GRAPH_COMMAND", command(veto, 3, 0))
            run.listen(0.001)
        run.listen(2.0)
        assert 1 < len(answers) <= AT_ONCE + PER_SECOND * (time.monotonic() - began)
        assert "too many commands" in newest(run).state_text
