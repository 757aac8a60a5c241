# SPDX-License-Identifier: Apache-2.0
"""The serial port of the sensor: there, allowed, at the right speed, and nobody else's."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

from ignis.doctoring.finding import Finding, Severity

L1_BAUD = 2_000_000


def check_sensor(port: str, baud: int, *, driver_runs: bool = False) -> Iterator[Finding]:
    """All of this module. `driver_runs`: l1_driver is on the bus, so it rightly holds the port."""
    if port.startswith("udp://"):
        yield Finding("sensor", "port", Severity.OK, f"{port}: the sensor's UDP board, no serial port to look at")
        return
    if baud != L1_BAUD:
        text = f"driver.baud is {baud}; the L1 speaks at {L1_BAUD} only"
        yield Finding("sensor", "baud", Severity.ERROR, text, f"set driver.baud to {L1_BAUD} in the configuration")
    else:
        yield Finding("sensor", "baud", Severity.OK, f"{baud}")
    yield check_port(Path(port), driver_runs=driver_runs)


def check_port(path: Path, *, driver_runs: bool) -> Finding:
    """The device file."""
    if not path.exists():
        others = sorted(str(p) for pattern in ("ttyUSB*", "ttyACM*") for p in Path("/dev").glob(pattern))
        seen = f"; there is {', '.join(others)}" if others else ""
        fix = "sudo dmesg | grep -i -e cp210x -e ttyUSB | tail   # is the adapter plugged in and powered?"
        return Finding("sensor", "port", Severity.ERROR, f"{path} does not exist{seen}", fix)
    mode = path.stat().st_mode
    if not stat.S_ISCHR(mode):
        return Finding("sensor", "port", Severity.ERROR, f"{path} is no serial device", "ls -l /dev/ttyUSB*")
    if not os.access(path, os.R_OK | os.W_OK):
        text = f"{path} may not be read and written by {_user()} (mode {stat.filemode(mode)})"
        return Finding("sensor", "port", Severity.ERROR, text, "sudo usermod -aG dialout $USER   # then log in again")
    holders = [] if driver_runs else port_holders(path)
    if holders:
        text = f"{path} is held by {', '.join(holders)}: two readers tear the stream apart"
        return Finding("sensor", "port", Severity.ERROR, text, f"sudo fuser -v {path}")
    return Finding("sensor", "port", Severity.OK, f"{path}" + (" (l1_driver has it)" if driver_runs else ""))


def _user() -> str:
    return os.environ.get("USER") or f"user {os.getuid()}"


def port_holders(path: Path) -> list[str]:
    """Processes, other than this one, that have the device open, as far as we may see."""
    device = path.resolve()
    holders = []
    for entry in Path("/proc").glob("[0-9]*"):
        if entry.name == str(os.getpid()):
            continue
        try:
            if any(os.readlink(fd) == str(device) for fd in (entry / "fd").iterdir()):
                holders.append(f"{(entry / 'comm').read_text().strip()} ({entry.name})")
        except OSError:
            continue  # gone, or not ours to look at
    return holders
