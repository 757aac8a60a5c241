# SPDX-License-Identifier: Apache-2.0
"""A listener on the bus ends with its owner."""

import gc
import os

from ignis.bus import DEFAULT_URL, Listener, open_bus


class Owner:
    """Hears by its own method and by a closure over itself."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []
        self.bus = open_bus(DEFAULT_URL)
        self.bus.subscribe("NEWS", self._take)
        self.bus.subscribe("NEWS", lambda _, data: self.heard.append(data))

    def _take(self, _: str, data: bytes) -> None:
        self.heard.append(data)


def threads() -> int:
    """Of this process, also those that Python did not start."""
    return len(os.listdir("/proc/self/task"))


def test_a_listener_that_nobody_holds_stops_reading(private_network: None) -> None:
    owner = Owner()
    owner.bus.publish("NEWS", b"heard twice")
    while len(owner.heard) < 2:
        assert owner.bus.handle_timeout(2000) > 0
    gc.collect()
    before = threads()
    many = [Owner() for _ in range(3)] + [Listener(DEFAULT_URL) for _ in range(3)]
    assert threads() == before + len(many)
    del many
    gc.collect()
    assert threads() == before
