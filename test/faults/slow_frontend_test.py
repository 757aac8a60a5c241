# SPDX-License-Identifier: Apache-2.0
"""Row B3: a computer that is too slow for its LiDAR, for a while."""

import itertools
import time
from dataclasses import dataclass, field
from pathlib import Path

import ignis_lcm.ignis as types
from l1_endurance import cpu_seconds

from fault_drive import BUS, CHECKOUT
from ignis.bus import Listener
from ignis.logs import read_log
from ignis.pipeline import Pipeline
from slow_process import slowed_main_thread

SCENE = CHECKOUT / "config" / "scenes" / "hall_spinning64.json"
CONFIG = CHECKOUT / "config" / "spinning.json"
SECONDS = 17.0
MOST_WAITING_S = 1.5
SLOW, SLOW_UNTIL = 4.0, 13.0  # [s] of the drive
CAUGHT_UP = 10.5  # by then, though still slow
SCAN_TAKES_S = 0.25  # then, of ten a second
WORK_S = 0.004  # at a stretch
LONGEST_HOLE_S = 2.0
LATE_S = 2.0  # of a scan once it is handled; some more where others want the processor as well


@dataclass
class Told:
    """What the front end said, and when [s] since the drive began."""

    began: float = 0.0
    scans: list[tuple[float, types.scan_stats_t]] = field(default_factory=list)
    health: list[tuple[float, types.health_t]] = field(default_factory=list)

    def take(self, channel: str, message: object) -> None:
        at = time.monotonic() - self.began
        if channel == "LIO_SCAN_STATS":
            self.scans.append((at, message))
        elif message.process == "lio_frontend":
            self.health.append((at, message))


def test_fault_b3_a_front_end_that_is_too_slow_leaves_the_oldest_scans_out_and_its_pose_is_of_now(
    private_network: None, tmp_path: Path
) -> None:
    log = tmp_path / "drive.lcmlog"
    told = Told()
    with Pipeline(tmp_path, BUS) as pipeline:
        options = ("--config", CONFIG)
        simulator = pipeline.start("l1_sim", "--scene", SCENE, *options, "--log", log, "--duration", SECONDS)
        assert simulator.wait(300) == 0, pipeline.last_words("l1_sim")
        sent = sorted({event.message.sequence for event in read_log(log, ("L1_SCAN",))})
        listener = Listener(BUS, "HEALTH|LIO_SCAN_STATS", told.take)
        frontend = pipeline.start("lio_frontend", *options, "--set", f"lcm.scan_backlog_s={MOST_WAITING_S}")
        assert listener.bus.wait_until(lambda: bool(told.health), 20.0)
        pipeline.start("lcm-logplayer", "--regexp=L1_(IMU|SCAN)", log)
        told.began = time.monotonic()

        def play_until(seconds: float) -> None:
            listener.bus.wait_until(lambda: time.monotonic() - told.began > seconds, seconds + 20.0)

        play_until(SLOW)
        scan_s = cpu_seconds(frontend.pid) / len(told.scans)
        print(f"{1e3 * scan_s:.1f} ms of a processor for each scan")
        with slowed_main_thread(frontend.pid, WORK_S, WORK_S * (SCAN_TAKES_S / scan_s - 1.0)):
            play_until(SLOW_UNTIL)
        play_until(SECONDS + 2.0)

    newest = told.health[-1][1]
    row = newest.channels.index("L1_SCAN")
    print(f"{newest.queue_drops[row]} of {len(sent)} scans left out, {newest.lost[row]} lost")
    assert not any(newest.lost), "the queues are long enough"
    reasons = {scan.scan_sequence: scan.reason for _, scan in told.scans}
    assert sorted(reasons) == sent, "each scan has a reason"
    left_out = [number for number, reason in reasons.items() if reason == types.scan_stats_t.BEHIND]
    assert 20 < len(left_out) == newest.queue_drops[row] < 0.9 * len(sent)

    used = [(at, scan.utime) for at, scan in told.scans if scan.reason != types.scan_stats_t.BEHIND]
    holes = [1e-6 * (b - a) for (_, a), (_, b) in itertools.pairwise(used)]
    lateness = [at - 1e-6 * utime for at, utime in used]
    in_time = max(late for late, (at, _) in zip(lateness, used, strict=True) if at < SLOW)
    behind = [late - in_time for late, (at, _) in zip(lateness, used, strict=True) if CAUGHT_UP < at < SLOW_UNTIL]
    print(f"longest hole {max(holes):.2f} s; later than in time by {min(behind):.2f} to {max(behind):.2f} s")
    assert max(holes) < LONGEST_HOLE_S
    assert max(behind) < LATE_S
    told_behind = [health for at, health in told.health if CAUGHT_UP < at < SLOW_UNTIL]
    assert all(each.state == each.DEGRADED and "scans are left out" in each.state_text for each in told_behind)
