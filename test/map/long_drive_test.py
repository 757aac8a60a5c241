# SPDX-License-Identifier: Apache-2.0
"""Row M3 over the real bus: ten kilometres of keyframes and scans into a map that may hold little."""

import json
import os
import re
import time
from pathlib import Path

import numpy as np

from map_drive import SCAN_PERIOD, SPEED, URL, Drive, hall_scan

LENGTH_M = 10_000.0
SPACING_M = 5.0
POINTS = 700
MAX_VOXELS = 10_000  # less than the windows of this drive would hold
MAX_POINTS = 50_000  # of some 70 keyframes
SETTLED_M = 2_000.0
MAX_GROWTH = 1.05
PAUSE_S = 0.001


def resident_mb(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def test_fault_m3_ten_kilometres_stay_within_the_bounds_and_say_that_these_are_reached(
    private_network: None, start_server
) -> None:
    limits = ("--set", f"map.max_voxels={MAX_VOXELS}", "--set", f"map.max_keyframe_points={MAX_POINTS}")
    server = start_server("--port", "0", *limits, url=URL)
    drive = Drive()
    scans = [hall_scan(np.zeros(3), drive.generator, POINTS) for _ in range(10)]

    def status() -> dict:
        return json.loads(server.request("/api/status")[2])

    settled = 0.0
    for number in range(round(LENGTH_M / SPACING_M)):
        drive.step = round(number * SPACING_M / (SPEED * SCAN_PERIOD))
        position = drive.position()
        drive.publish_keyframe(position, scans[number % 10])
        drive.publish_cloud(position, scans[number % 10])
        time.sleep(PAUSE_S)
        if settled == 0.0 and number * SPACING_M >= SETTLED_M:
            settled = resident_mb(server.process.pid)
    time.sleep(1.5)  # the status is made once a second
    at_end, told = resident_mb(server.process.pid), status()
    print(
        f"{settled:.1f} MB after {SETTLED_M:.0f} m, {at_end:.1f} MB after {LENGTH_M:.0f} m",
        told["voxels"],
        told["health"],
    )
    assert server.process.poll() is None
    assert told["clouds_inserted"] > 0.9 * LENGTH_M / SPACING_M, "what came too fast is dropped by the bus"
    assert at_end < MAX_GROWTH * settled
    assert sum(told["voxels"]) <= MAX_VOXELS and told["voxels"][2] > 100
    assert told["health"].startswith("DEGRADED: map.max_voxels is reached")
    dropped = re.search(r"map.max_keyframe_points is reached, the (\d+) farthest", told["health"])
    assert dropped and int(dropped[1]) + told["keyframes"] > 0.9 * LENGTH_M / SPACING_M
    assert server.stop() == 0
