# SPDX-License-Identifier: Apache-2.0
"""Whether something keeps the system's clock right. Asks the kernel, so any daemon will do (NTP, PTP, GPS)."""

from __future__ import annotations

import ctypes
import os

from ignis.doctoring.finding import Finding, Severity

# linux/timex.h
_UNSYNCHRONISED = 0x0040
_LARGEST_ERROR_S = 0.05  # between two computers: a scan


class _Timex(ctypes.Structure):
    """The beginning of struct timex (adjtimex(2)); the rest is room for what the kernel writes behind it."""

    _fields_ = (
        ("modes", ctypes.c_uint),
        ("offset", ctypes.c_long),
        ("freq", ctypes.c_long),
        ("maxerror", ctypes.c_long),
        ("esterror", ctypes.c_long),
        ("status", ctypes.c_int),
        ("rest", ctypes.c_byte * 256),
    )


def read_kernel_clock() -> tuple[int, float]:
    """Status bits and greatest error [s] of the kernel's clock; changes nothing, needs no rights."""
    timex = _Timex()
    if ctypes.CDLL(None, use_errno=True).adjtimex(ctypes.byref(timex)) < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return timex.status, timex.maxerror * 1e-6


def check_synchronisation(status: int, max_error_s: float, *, several_computers: bool) -> Finding:
    """One computer does without: its stamps agree with themselves. Between several they do not."""
    mend = "sudo apt install systemd-timesyncd && sudo timedatectl set-ntp true"
    severity = Severity.WARNING if several_computers else Severity.NOTE
    if status & _UNSYNCHRONISED:
        text = "nothing keeps the clock right (no NTP, PTP or GPS)"
        if several_computers:
            text += ", and the bus reaches other computers"
        return Finding("host", "synchronisation", severity, text, mend)
    text = f"the clock is kept right, within {1e3 * max_error_s:.0f} ms"
    if max_error_s > _LARGEST_ERROR_S and several_computers:
        return Finding(
            "host", "synchronisation", severity, f"{text} only", "chronyc tracking || timedatectl timesync-status"
        )
    return Finding("host", "synchronisation", Severity.OK, text)
