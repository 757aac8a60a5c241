# SPDX-License-Identifier: Apache-2.0
"""Row P7: the processes of a drive may start in any order, even in the middle of it."""

import math
from pathlib import Path

from fault_drive import CONFIG, PORT, FaultRun, Seen

SAME_PLACE_M = 1e-3


def test_fault_p7_a_graph_and_a_map_that_start_in_mid_drive_end_like_those_that_were_first(
    drive_log: Path, undisturbed: Seen, tmp_path: Path
) -> None:
    late = {"map_builder": (2.5, ("--port", PORT)), "graph_backend": (4.0, ())}
    # The front end must hear the standing start of the log; the other two find it driving.
    with FaultRun(tmp_path, ("lio_frontend",)) as run:

        def meanwhile(seconds: float) -> None:
            for name, (at, more) in late.items():
                if seconds > at and name not in run.pipeline.processes:
                    run.pipeline.start(name, "--config", CONFIG, *more)

        run.play(drive_log, meanwhile)
        run.listen(3.0)
        status = run.view_status()
    assert run.seen.keyframes == undisturbed.keyframes
    assert run.seen.poses.keys() == undisturbed.poses.keys(), "what was sent before is asked for again"
    assert all(math.dist(run.seen.poses[i][:3], undisturbed.poses[i][:3]) < SAME_PLACE_M for i in run.seen.poses)
    assert status["keyframes"] == undisturbed.status["keyframes"]
