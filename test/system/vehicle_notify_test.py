# SPDX-License-Identifier: Apache-2.0
"""Real executables before a supervisor with systemd's protocol: ready, fed from progress, starved when they hang."""

import os
import signal
import socket
import subprocess
import time
from pathlib import Path

import pytest

from ignis.pipeline import binary

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
WATCHDOG_S = 2.0  # that of the units


def heard(listener: socket.socket, seconds: float) -> list[str]:
    """What arrives on the socket within so long."""
    messages = []
    deadline = time.monotonic() + seconds
    while (left := deadline - time.monotonic()) > 0:
        listener.settimeout(left)
        try:
            messages.append(listener.recv(4096).decode())
        except TimeoutError:
            break
    return messages


def test_fault_p7_each_unit_s_watchdog_waits_two_seconds() -> None:
    # Replaced within 3 s: the wait, the pause before a start and the start.
    for service in ("driver", "frontend", "backend", "map"):
        unit = (CHECKOUT / "packaging" / "systemd" / f"ignis-{service}.service").read_text()
        assert "\nWatchdogSec=2\n" in unit, service


@pytest.mark.parametrize("name", ["l1_driver", "lio_frontend", "graph_backend", "map_builder"])
def test_process_says_ready_feeds_the_watchdog_and_starves_it_when_it_hangs(
    private_network, name: str, tmp_path: Path
) -> None:
    path = tmp_path / "notify"
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    listener.bind(str(path))
    near, far = os.openpty()
    arguments = {"l1_driver": ["--port", os.ttyname(far)], "map_builder": ["--port", "0"]}.get(name, [])
    environment = {**os.environ, "NOTIFY_SOCKET": str(path), "WATCHDOG_USEC": str(int(WATCHDOG_S * 1e6))}
    process = subprocess.Popen(
        [binary(name), "--config", CONFIG, *arguments], env=environment, stdout=subprocess.DEVNULL
    )
    try:
        assert "READY=1" in heard(listener, 10.0 if name == "map_builder" else 5.0)
        assert heard(listener, WATCHDOG_S).count("WATCHDOG=1") >= 2
        process.send_signal(signal.SIGSTOP)
        heard(listener, 0.2)
        assert heard(listener, WATCHDOG_S) == []
        process.send_signal(signal.SIGCONT)
        assert "WATCHDOG=1" in heard(listener, WATCHDOG_S)
        process.terminate()
        assert process.wait(15) == 0
    finally:
        process.kill()
        process.wait()
        listener.close()
        os.close(near)
        os.close(far)


def test_fault_d6_a_supervised_driver_waits_for_a_port_that_is_not_there_yet(private_network, tmp_path: Path) -> None:
    port = tmp_path / "l1"
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    listener.bind(str(tmp_path / "notify"))
    near, far = os.openpty()
    process = subprocess.Popen(
        [binary("l1_driver"), "--config", CONFIG, "--port", port],
        env={**os.environ, "NOTIFY_SOCKET": str(tmp_path / "notify")},
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
    )
    try:
        said = heard(listener, 2.0)
        assert "READY=1" in said and any("does not exist" in word for word in said), said
        port.symlink_to(os.ttyname(far))
        assert process.stderr is not None
        lines = [process.stderr.readline().decode(), process.stderr.readline().decode()]
        assert "trying again" in lines[0] and "is back" in lines[1], lines
    finally:
        process.kill()
        process.wait()
        listener.close()
        os.close(near)
        os.close(far)
