# SPDX-License-Identifier: Apache-2.0
"""Computer: receive buffers, clock, disk, CPU governor. Reads /proc and /sys below a root, so tests can give it."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from pathlib import Path

from ignis.doctoring.finding import Finding, Severity

RMEM_MAX = 8388608
RMEM_DEFAULT = 2097152
DISK_WARNING = 10e9
DISK_ERROR = 1e9
_SLOW_GOVERNORS = frozenset({"powersave", "conservative", "userspace"})
_SYSCTL_FILE = "/etc/sysctl.d/60-ignis-lio.conf"


def check_host(root: Path, folder: Path, built: float) -> Iterator[Finding]:
    """All of this module. `folder`: where recordings go; `built`: [s] when the executables were made."""
    yield from check_receive_buffers(root)
    yield check_clock(time.time(), built)
    yield check_disk(folder, shutil.disk_usage(folder).free)
    yield check_governor(root)


def check_receive_buffers(root: Path) -> Iterator[Finding]:
    """The kernel's limits for receive buffers: LCM asks for 2 MB, and lcm-spy takes the default."""
    for name, wanted in (("rmem_max", RMEM_MAX), ("rmem_default", RMEM_DEFAULT)):
        path = root / "proc/sys/net/core" / name
        if not path.exists():
            yield Finding("host", name, Severity.NOTE, "cannot be seen in this network namespace; look on the host")
            continue
        value = int(path.read_text())
        if value >= wanted:
            yield Finding("host", name, Severity.OK, f"{value} bytes")
            continue
        yield Finding(
            "host",
            name,
            Severity.WARNING,
            f"{value} bytes, should be {wanted}: bursts of scans and keyframes are lost",
            f"echo net.core.{name}={wanted} | sudo tee -a {_SYSCTL_FILE} && sudo sysctl -w net.core.{name}={wanted}",
        )


def check_clock(now: float, built: float) -> Finding:
    """Stamps of files and logs come from the system's clock; without a clock chip it starts in the past."""
    if now < built - 86400.0:
        return Finding(
            "host",
            "clock",
            Severity.ERROR,
            f"the clock says {time.strftime('%Y-%m-%d %H:%M', time.gmtime(now))} UTC, before this software was built",
            "sudo timedatectl set-ntp true",
        )
    return Finding("host", "clock", Severity.OK, time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(now)))


def check_disk(folder: Path, free: float) -> Finding:
    """An hour of recording takes about 2.5 GB."""
    text = f"{free / 1e9:.1f} GB free in {folder}"
    if free >= DISK_WARNING:
        return Finding("host", "disk", Severity.OK, text)
    severity = Severity.ERROR if free < DISK_ERROR else Severity.WARNING
    return Finding(
        "host", "disk", severity, f"{text}, about {free / 2.5e9:.1f} hours of recording", f"du -sh {folder}/*"
    )


def check_governor(root: Path) -> Finding:
    """A governor that keeps the clock low makes scans late."""
    files = sorted(root.glob("sys/devices/system/cpu/cpu[0-9]*/cpufreq/scaling_governor"))
    governors = {path.read_text().strip() for path in files}
    if not governors:
        return Finding("host", "governor", Severity.OK, "the system does not scale the CPU clock")
    if slow := governors & _SLOW_GOVERNORS:
        return Finding(
            "host",
            "governor",
            Severity.WARNING,
            f"CPU governor is {', '.join(sorted(slow))}: scans may be late",
            "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor",
        )
    return Finding("host", "governor", Severity.OK, ", ".join(sorted(governors)))
