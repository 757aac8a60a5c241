# SPDX-License-Identifier: Apache-2.0
"""Row F7 at the real front end: for some seconds of a drive scans come at 200 Hz, ten times too often."""

import math
import time
from pathlib import Path

import ignis_lcm.ignis as types
import numpy as np

from fault_drive import FaultRun, Seen
from ignis.logs import LogEvent, LogWriter, read_events

TENFOLD_S = (5.0, 9.0)  # of the drive
END_S = 10.5
LATE_S = 15.0  # that a busy machine may add
PERIOD_US = 5_000
WORK_LIMIT_MS = 5.0  # 200 scans a second then fill one core
SAME_PLACE_M = 0.05


def tenfold(log: Path, target: Path) -> tuple[int, int]:
    """The drive with nine copies of each scan in between, each a little later; how many copies and scans there are."""
    events: list[LogEvent] = []
    begin = next(iter(read_events(log))).utime
    sequence = copies = 0
    for event in read_events(log):
        if event.utime > begin + 1e6 * END_S:
            break
        if event.channel != "L1_SCAN":
            events.append(event)
            continue
        scan = types.scan_t.decode(event.data)
        assert scan.part_count == 1
        at = 1e-6 * (event.utime - begin)
        for copy in range(10 if TENFOLD_S[0] < at < TENFOLD_S[1] else 1):
            scan.sequence = sequence
            events.append(event._replace(utime=event.utime + PERIOD_US * copy, data=scan.encode()))
            scan.utime += PERIOD_US
            sequence += 1
            copies += copy > 0
    with LogWriter(target) as out:
        for event in sorted(events, key=lambda each: each.utime):
            out.write(*event)
    return copies, sequence


def test_fault_f7_scans_ten_times_too_often_are_refused_by_name_and_the_pose_stays(
    drive_log: Path, undisturbed: Seen, tmp_path: Path
) -> None:
    copies, scans = tenfold(drive_log, tmp_path / "tenfold.lcmlog")
    stats: list[types.scan_stats_t] = []
    with FaultRun(tmp_path, ("lio_frontend", "graph_backend")) as run:
        taken = run.bus.subscribe("LIO_SCAN_STATS", lambda _, data: stats.append(types.scan_stats_t.decode(data)))
        taken.set_queue_capacity(20_000)
        run.play(tmp_path / "tenfold.lcmlog", speed=1.0)
        late_until = time.monotonic() + LATE_S
        while len(stats) < scans - 1 and time.monotonic() < late_until:
            run.listen(0.2)
        newest = run.seen.newest_with_data()
        worked_ms = 1e3 * run.work("lio_frontend") / len(stats)
    refused = [each for each in stats if each.reason == types.scan_stats_t.TOO_OFTEN]
    spent = np.array([each.time_spent_ms for each in stats])
    # The promise is about the time that passes; on a busy machine that is others' time, so the processor's is bounded.
    within = np.percentile(spent, 99)
    print(f"{copies} copies, {len(refused)} refused, 99 % within {within:.1f} ms, {worked_ms:.2f} ms of work each")
    assert len(refused) > 0.7 * copies and all(each.reason_text for each in refused)
    assert worked_ms < WORK_LIMIT_MS
    # On a busy machine its latency alone degrades it.
    assert newest.state == newest.OK or newest.state_text.startswith("latency"), newest.state_text
    assert newest.resets == 0
    pairs = ((mine, other) for mine in run.seen.smoothed[-50:] for other in undisturbed.smoothed)
    mine, other = min(pairs, key=lambda pair: abs(pair[0].utime - pair[1].utime))
    assert abs(mine.utime - other.utime) < PERIOD_US
    assert math.dist(mine.position, other.position) < SAME_PLACE_M
