# SPDX-License-Identifier: Apache-2.0
"""Tells the running front end to begin a new session with an empty map, and waits until it has begun.

It waits for a start as configured, which means standing unless frontend.start is moving. Graph and map follow."""

from __future__ import annotations

import argparse
import os
import sys

from ignis_lcm.ignis import health_t, imu_t, lio_command_t

from ignis.bus import Bus, default_url, open_bus
from ignis.errors import InputError

ANSWER_SECONDS = 6.0
_ATTEMPTS = 3
# Ahead of the newest sample, so that a log holds the command before it is due (lcmtypes/lio_command_t.lcm).
_LEAD_US = 300_000


class FrontEnd:
    """What the bus says of the front end and of time."""

    def __init__(self, bus: Bus) -> None:
        self.session: int | None = None
        self.reason = ""
        self.newest_utime: int | None = None
        bus.subscribe("HEALTH", self._on_health)
        bus.subscribe("L1_IMU", self._on_imu)

    @property
    def is_known(self) -> bool:
        """Whether a command can be made."""
        return self.session is not None and self.newest_utime is not None

    @property
    def missing(self) -> str:
        """What was not heard of, for people."""
        return "lio_frontend" if self.session is None else "inertial samples, and a session begins with one"

    def _on_health(self, _: str, data: bytes) -> None:
        health = health_t.decode(data)
        if health.process == "lio_frontend":
            self.session, self.reason = health.resets, health.state_text

    def _on_imu(self, _: str, data: bytes) -> None:
        self.newest_utime = imu_t.decode(data).utime


def command_for(front_end: FrontEnd, sequence: int) -> lio_command_t:
    """The command as a message. Requires front_end.is_known."""
    assert front_end.session is not None and front_end.newest_utime is not None
    message = lio_command_t()
    message.utime = front_end.newest_utime + _LEAD_US
    message.sequence = sequence
    message.session = front_end.session
    message.command = lio_command_t.BEGIN_ANEW
    message.sender = f"ignis reset {os.getpid()}"
    return message


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="ignis reset", description=__doc__)
    parser.add_argument("--lcm-url", default=default_url())
    options = parser.parse_args(arguments)
    try:
        bus = open_bus(options.lcm_url)
    except InputError as error:
        print(f"ignis reset: {error}", file=sys.stderr)
        return 1
    front_end = FrontEnd(bus)
    if not bus.wait_until(lambda: front_end.is_known, ANSWER_SECONDS):
        print(f"ignis reset: nothing was heard of {front_end.missing} on {options.lcm_url}", file=sys.stderr)
        return 1
    ended = front_end.session
    # A datagram may be lost; the session's number keeps a second one from ending the next session.
    for attempt in range(_ATTEMPTS):
        bus.publish("LIO_COMMAND", command_for(front_end, attempt).encode())
        if bus.wait_until(lambda: front_end.session != ended, ANSWER_SECONDS / _ATTEMPTS):
            print(f"session {ended} has ended, {front_end.session} begins: {front_end.reason}")
            return 0
    print(
        f"ignis reset: session {ended} goes on after {ANSWER_SECONDS:.0f} s; the front end says: {front_end.reason}",
        file=sys.stderr,
    )
    return 1


if __name__ == "__main__":
    sys.exit(main())
