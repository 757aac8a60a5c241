# SPDX-License-Identifier: Apache-2.0
"""Row F9 over the bus: the sensor's messages stalled and then all at once, or overtaking each other, on their way."""

import math
import time
from itertools import pairwise
from pathlib import Path

import ignis_lcm.ignis as types
import numpy as np

from fault_drive import BUS, FaultRun, Seen
from seeded_relay import Disturbance, SeededRelay

SENSOR_BUS = "udpm://239.255.76.67:7681?ttl=0&recv_buf_size=2097152"
SENSOR = ("L1_IMU", "L1_SCAN")
SEED = 9
STALL_AT_S, STALL_FOR_S = 4.0, 1.0
CAUGHT_UP_S = 0.1
CAUGHT_UP_WITHIN_S = 2.0
JITTER_S = 0.02
IMU_PER_SCAN = 12.5


class DelayedRun(FaultRun):
    """The processes behind a relay that the sensor's messages must pass; notes when each pose came."""

    def __init__(self, folder: Path, disturbance: Disturbance) -> None:
        super().__init__(folder)
        self.arrivals: list[tuple[float, float]] = []  # time of arrival and stamp [s], each with its own origin
        self.covariances = 0
        self._relay = SeededRelay(SENSOR_BUS, BUS, SENSOR, (), disturbance, SEED)
        self.bus.subscribe("LIO_STATE", self._note_arrival).set_queue_capacity(20_000)

    def _note_arrival(self, _: str, data: bytes) -> None:
        state = types.state_t.decode(data)
        self.arrivals.append((time.monotonic(), 1e-6 * state.utime))
        self.covariances += state.covariance_valid

    def play_through(self, log: Path) -> None:
        """Plays the log at its own speed onto the sensor's bus."""
        self.pipeline.environment["LCM_DEFAULT_URL"] = SENSOR_BUS
        with self._relay:
            self.play(log, speed=1.0)
        print("seed", SEED, self._relay)

    def latencies(self) -> tuple[np.ndarray, np.ndarray]:
        """Times of arrival since the first pose, and delays beyond the usual one [s]."""
        arrival, stamp = np.array(self.arrivals).T
        delay = arrival - stamp
        return arrival - arrival[0], delay - np.median(delay)


def test_fault_f9_after_a_second_of_stall_the_pose_is_late_for_less_than_two(
    drive_log: Path, undisturbed: Seen, tmp_path: Path
) -> None:
    with DelayedRun(tmp_path, Disturbance(stalls=((STALL_AT_S, STALL_FOR_S),))) as run:
        run.play_through(drive_log)
    at, late = run.latencies()
    resumed = 1 + int(np.diff(at).argmax())  # the first pose after the longest silence
    caught_up = at[resumed:][late[resumed:] < CAUGHT_UP_S]
    print(f"late by {late[resumed]:.2f} s, caught up after {caught_up[:1] - at[resumed]} s")
    assert late[resumed] > 0.8 * STALL_FOR_S, "the stall did not happen"
    assert caught_up.size and caught_up[0] - at[resumed] < CAUGHT_UP_WITHIN_S
    assert run.seen.keyframes == undisturbed.keyframes, "what came late was used all the same"


def test_fault_f9_messages_that_overtake_each_other_are_counted_and_stamps_ascend(
    drive_log: Path, tmp_path: Path
) -> None:
    with DelayedRun(tmp_path, Disturbance(delay_s=JITTER_S, duplicate=0.02)) as run:
        run.play_through(drive_log)
    assert run.seen.rejected("lio_frontend", "L1_IMU") > 100, "what was overtaken is refused and counted"
    back = [(a, b) for a, b in pairwise(run.seen.states) if b <= a]
    assert not back, "stamps of LIO_STATE ascend"
    assert run.covariances > 0.5 * len(run.seen.states) / IMU_PER_SCAN, "covariances still come at the rate of scans"
    assert set(run.seen.poses) == set(run.seen.keyframes)
    assert all(math.isfinite(value) for pose in run.seen.poses.values() for value in pose)
