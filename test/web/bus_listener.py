# SPDX-License-Identifier: Apache-2.0
"""Remembers what the processes published, for comparison with what the page shows."""

from __future__ import annotations

import contextlib
import threading
from typing import Any

from ignis.bus import open_bus


class BusListener:
    """Listens in a thread of its own until closed."""

    def __init__(self, url: str) -> None:
        from ignis_lcm.ignis import graph_command_t, loop_result_t, state_t

        self.states: dict[int, Any] = {}
        self.smoothed: list[Any] = []
        self.loops: list[Any] = []
        self.commands: list[Any] = []
        self._bus = open_bus(url)
        self._subscribe("LIO_STATE", state_t, lambda message: self.states.__setitem__(message.utime, message))
        self._subscribe("SMOOTHED_STATE", state_t, self.smoothed.append)
        self._subscribe("LOOP_RESULT", loop_result_t, self.loops.append)
        self._subscribe("GRAPH_COMMAND", graph_command_t, self.commands.append)
        self._open = True
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _subscribe(self, channel: str, kind: Any, take: Any) -> None:
        self._bus.subscribe(channel, lambda _, data: take(kind.decode(data))).set_queue_capacity(2000)

    def _listen(self) -> None:
        while self._open:
            with contextlib.suppress(OSError):
                self._bus.handle_timeout(100)

    def publish(self, channel: str, message: Any) -> None:
        self._bus.publish(channel, message.encode())

    def close(self) -> None:
        self._open = False
        self._thread.join()
