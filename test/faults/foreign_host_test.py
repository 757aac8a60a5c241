# SPDX-License-Identifier: Apache-2.0
"""Row B6 between two computers: with ttl=0 nothing from another host arrives, while our own datagrams still do.

The multicast route leads through the cable and not through the loopback interface: the group is joined where the
stranger's datagrams come in, and our own come back as the kernel's copies of what goes out.
"""

import subprocess
import sys
import time
from pathlib import Path

import pytest
from vehicle_two_computers_test import CONFIG, Computer, join

STRANGER = """
import sys, time, lcm
from ignis_lcm.ignis import imu_t
bus = lcm.LCM("udpm://239.255.76.67:7667?ttl=1")
for number in range(300):
    message = imu_t()
    message.utime, message.sequence, message.accel = 1_000_000 + 4000 * number, number, [0.0, 9.81, 0.0]
    bus.publish("L1_IMU", message.encode())
    time.sleep(0.01)
"""
HEAR = """
import sys, lcm
from ignis_lcm.ignis import health_t
bus = lcm.LCM("udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152")
heard = []
bus.subscribe("HEALTH", lambda _, data: heard.append(health_t.decode(data)))
bus.subscribe("L1_IMU", lambda _, data: None)
import time
end = time.monotonic() + 4.0
while time.monotonic() < end:
    bus.handle_timeout(100)
for name in ("lio_frontend", "graph_backend"):
    newest = [each for each in heard if each.process == name][-1]
    counts = {c: (r, x) for c, r, x in zip(newest.channels, newest.received, newest.rejected)}
    print(name, counts.get("L1_IMU", (0, 0))[0], counts["UDP"][1], counts["HEALTH"][0])
"""


@pytest.mark.parametrize("ttl", [0, 1])
def test_fault_b6_datagrams_of_another_host_arrive_only_where_the_bus_may_leave_the_computer(
    ttl: int, tmp_path: Path
) -> None:
    near, far = Computer(tmp_path), Computer(tmp_path)
    try:
        join(near, far)
        url = f"udpm://239.255.76.67:7667?ttl={ttl}&recv_buf_size=2097152"
        for name in ("lio_frontend", "graph_backend"):
            near.start(name, "--config", CONFIG, "--lcm-url", url)
        time.sleep(1.5)
        stranger = subprocess.Popen(far.line(sys.executable, "-c", STRANGER))
        heard = near.run(sys.executable, "-c", HEAR)
        assert stranger.wait(20) == 0
    finally:
        near.close()
        far.close()
    assert heard.returncode == 0, heard.stderr[-500:]
    rows = {words[0]: [int(word) for word in words[1:]] for words in map(str.split, heard.stdout.splitlines())}
    received, refused, own = rows["lio_frontend"]
    assert own > 0, "our own datagrams come back although they leave through the cable"
    assert (received == 0 and refused > 100) if ttl == 0 else received > 100
