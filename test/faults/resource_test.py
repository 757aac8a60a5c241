# SPDX-License-Identifier: Apache-2.0
"""Rows D6 and W2: a driver that waits for its port costs no processor; a server without descriptors goes on."""

import os
import resource
import socket
import time
from pathlib import Path

import pytest

from fault_drive import BUS, CONFIG
from ignis.pipeline import Pipeline
from stream_server import Server

WATCHED_S = 5.0
IDLE_SHARE = 0.02
BUSY_SHARE = 0.3
DESCRIPTORS = 28


def processor_seconds(pid: int) -> float:
    """User and system time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def processor_share(pid: int, seconds: float) -> float:
    """Of one core, over the next seconds."""
    began, used = time.monotonic(), processor_seconds(pid)
    time.sleep(seconds)
    return (processor_seconds(pid) - used) / (time.monotonic() - began)


@pytest.mark.parametrize("port", ["silent", "vanished"])
def test_fault_d6_a_driver_that_waits_for_its_port_costs_no_processor(
    port: str, private_network: None, tmp_path: Path
) -> None:
    sensor, line = os.openpty()
    device = tmp_path / "port"
    device.symlink_to(os.ttyname(line))
    with Pipeline(tmp_path, BUS) as pipeline:
        driver = pipeline.start("l1_driver", "--config", CONFIG, "--port", device)
        time.sleep(1.0)
        os.close(line)
        if port == "vanished":
            device.unlink()
            os.close(sensor)
            time.sleep(0.5)
        share = processor_share(driver.pid, WATCHED_S)
        pipeline.check()
        print(f"{port}: {100 * share:.2f} % of a core; {pipeline.last_words('l1_driver', 1)}")
    if port == "silent":
        os.close(sensor)
    assert share < IDLE_SHARE


def test_fault_w2_a_server_without_descriptors_waits_and_serves_again() -> None:
    limit = (DESCRIPTORS, DESCRIPTORS)
    server = Server("--config", CONFIG, "--port", "0", before=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, limit))
    crowd: list[socket.socket] = []
    try:
        for _ in range(2 * DESCRIPTORS):
            crowd.append(server.connect())
        time.sleep(0.5)
        in_use = len(list(Path(f"/proc/{server.process.pid}/fd").iterdir()))
        assert in_use == DESCRIPTORS, "the limit must bite"
        share = processor_share(server.process.pid, 2.0)
        print(f"{100 * share:.1f} % of a core while nobody can be let in")
        assert share < BUSY_SHARE
        for connection in crowd:
            connection.close()
        crowd.clear()
        assert server.request("/")[0] == 200
    finally:
        for connection in crowd:
            connection.close()
        assert server.stop() == 0
