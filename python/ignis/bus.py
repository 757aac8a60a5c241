# SPDX-License-Identifier: Apache-2.0
"""A listener on the bus: what arrives on each channel, how often, how large, what was lost by its running number."""

from __future__ import annotations

import contextlib
import os
import time
import weakref
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import ignis_lcm.ignis as types
import lcm

from ignis.errors import InputError

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152"
# Several processes send on these, each with its own running number.
SHARED_CHANNELS = frozenset(
    {"HEALTH", "KEYFRAME_REQUEST", "CLOUD_REQUEST", "LIO_CLOUD_AGAIN", "LIO_COMMAND", "GRAPH_COMMAND"}
)
RATE_WINDOW_S = 5.0
_QUEUE = 5000


def default_url() -> str:
    """LCM_DEFAULT_URL, else the URL that the configuration's default has."""
    return os.environ.get("LCM_DEFAULT_URL") or DEFAULT_URL


class Bus(lcm.LCM):
    """An lcm.LCM that ends with its owner, also when a handler is a method of the owner.

    Python's garbage collector does not see what lcm.LCM holds. A handler that leads back to the bus would keep both
    for ever, with a thread that takes every later message of the network. So only the list here holds the handlers.
    """

    def __init__(self, url: str) -> None:
        super().__init__(url)
        self._handlers: list[Callable[[str, bytes], None]] = []

    def subscribe(self, channel: str, handler: Callable[[str, bytes], None]) -> Any:
        """As lcm.LCM does; the bus keeps the handler for as long as it lives itself."""
        self._handlers.append(handler)
        return super().subscribe(channel, weakref.proxy(handler))

    def wait_until(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Handles what arrives until something is so, or the time is over; whether it is."""
        deadline = time.monotonic() + seconds
        while not condition() and time.monotonic() < deadline:
            self.handle_timeout(50)
        return condition()


def open_bus(url: str) -> Bus:
    """The bus; an InputError that says what to do when it cannot be opened."""
    try:
        return Bus(url)
    except (RuntimeError, OSError) as error:
        raise InputError(
            f"cannot open the message bus {url}: {error}. If multicast has no route, run: "
            "sudo ip link set lo up multicast on && sudo ip route add 224.0.0.0/4 dev lo"
        ) from None


def message_types() -> dict[bytes, Any]:
    """Our message types by their fingerprint."""
    found: list[Any] = [getattr(types, name) for name in dir(types) if name.endswith("_t")]
    return {kind._get_packed_fingerprint(): kind for kind in found}


@dataclass
class ChannelCount:
    """What arrived on one channel."""

    kind: str = "?"
    received: int = 0
    bytes: int = 0
    lost: int = 0
    undecodable: int = 0
    last_at: float = 0.0
    newest: Any = None
    _arrivals: deque[tuple[float, int]] = field(default_factory=deque)
    _sequence: int | None = None

    def add(self, now: float, size: int, message: Any, *, counts_gaps: bool) -> None:
        """One message of `size` bytes arrived at `now` [s]; `message` is None when it could not be decoded."""
        self.received += 1
        self.bytes += size
        self.last_at = now
        self._arrivals.append((now, size))
        if message is None:
            self.undecodable += 1
            return
        self.kind = type(message).__name__
        self.newest = message
        sequence = getattr(message, "sequence", None)
        if sequence is None or not counts_gaps:
            return
        if self._sequence is not None and sequence > self._sequence:
            self.lost += sequence - self._sequence - 1
        self._sequence = sequence

    def rate(self, now: float, listened_s: float) -> tuple[float, float]:
        """Messages and bytes a second over the last RATE_WINDOW_S seconds."""
        while self._arrivals and self._arrivals[0][0] < now - RATE_WINDOW_S:
            self._arrivals.popleft()
        window = max(min(RATE_WINDOW_S, listened_s), 1e-3)
        return len(self._arrivals) / window, sum(size for _, size in self._arrivals) / window


class Listener:
    """Counts what arrives and keeps the newest message of each channel, and the newest HEALTH of each process."""

    def __init__(self, url: str, channels: str = ".*", on_message: Callable[[str, Any], None] | None = None) -> None:
        self.bus = open_bus(url)
        self.channels: dict[str, ChannelCount] = {}
        self.health: dict[tuple[str, int], tuple[float, Any]] = {}
        self.began = time.monotonic()
        self._types = message_types()
        self._on_message = on_message
        self.bus.subscribe(channels, self._take).set_queue_capacity(_QUEUE)

    def _take(self, channel: str, data: bytes) -> None:
        now = time.monotonic()
        message = None
        if (kind := self._types.get(bytes(data[:8]))) is not None:
            with contextlib.suppress(Exception):  # a damaged body may raise anything
                message = kind.decode(data)
        count = self.channels.setdefault(channel, ChannelCount())
        count.add(now, len(data), message, counts_gaps=channel not in SHARED_CHANNELS)
        if message is not None and channel == "HEALTH":
            self.health[(message.process, message.pid)] = (now, message)
        if message is not None and self._on_message is not None:
            self._on_message(channel, message)

    def listen(self, seconds: float) -> None:
        """Handles what arrives for so long."""
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            # A signal makes LCM fail with an OSError before Python raises what the signal stands for.
            with contextlib.suppress(OSError):
                self.bus.handle_timeout(max(int(left * 1000), 1))

    @property
    def listened_s(self) -> float:
        """[s] since the subscription."""
        return time.monotonic() - self.began
