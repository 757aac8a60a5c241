# SPDX-License-Identifier: Apache-2.0
"""Two message buses and a relay that carries some channels from one to the other, and what a bad network does to them.

All our messages fit one datagram, so a message lost here is a datagram lost.
"""

from __future__ import annotations

import heapq
import itertools
import random
import select
import threading
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from ignis.bus import Bus, open_bus

QUEUE = 5000  # messages per subscription
LONGEST_SLEEP_S = 0.05


@dataclass(frozen=True)
class Disturbance:
    """What happens to messages on their way, all of it drawn from one seeded generator."""

    loss: float = 0.0  # share of messages
    burst: int = 1  # messages: mean length of a loss
    duplicate: float = 0.0  # share of messages that arrive twice
    corrupt: float = 0.0  # share of messages with one altered bit behind the type's hash
    delay_s: float = 0.0  # each by 0 to this much, so that they overtake each other
    stalls: tuple[tuple[float, float], ...] = ()  # (begin, length) [s] since the first message: all arrive at its end


@dataclass
class Way:
    """One channel's way from one bus to the other; its own generator, so that other channels do not shift it."""

    sink: Bus
    random: random.Random
    losing: int = 0  # messages of the present burst that are still to be lost
    counts: Counter[str] = field(default_factory=Counter)


class SeededRelay:
    """Forwards `there` from bus a to bus b and `back` from b to a. A context manager: leaving it ends the thread."""

    def __init__(
        self, a: str, b: str, there: Sequence[str], back: Sequence[str], disturbance: Disturbance, seed: int
    ) -> None:
        self._disturbance = disturbance
        self._buses = (open_bus(a), open_bus(b))
        self._ways: dict[str, Way] = {}
        self._connect(self._buses[0], self._buses[1], there, seed)
        self._connect(self._buses[1], self._buses[0], back, seed)
        self._waiting: list[tuple[float, int, str, bytes]] = []
        self._order = itertools.count()
        self._first: float | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def count(self, what: str, channel: str) -> int:
        """Messages of a channel that were forwarded, lost, doubled or corrupted."""
        return self._ways[channel].counts[what]

    def __str__(self) -> str:
        return ", ".join(f"{channel} {dict(way.counts)}" for channel, way in self._ways.items())

    def __enter__(self) -> SeededRelay:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _connect(self, source: Bus, sink: Bus, channels: Sequence[str], seed: int) -> None:
        for channel in channels:
            self._ways[channel] = Way(sink, random.Random(f"{seed} {channel}"))
            source.subscribe(channel, self._take).set_queue_capacity(QUEUE)

    def _take(self, channel: str, data: bytes) -> None:
        way, how = self._ways[channel], self._disturbance
        if self._is_lost(way):
            way.counts["lost"] += 1
            return
        copies = 1
        if way.random.random() < how.duplicate:
            way.counts["doubled"] += 1
            copies = 2
        if way.random.random() < how.corrupt:
            way.counts["corrupted"] += 1
            data = _with_altered_bit(data, way.random)
        for _ in range(copies):
            due = self._after_stalls(time.monotonic()) + way.random.uniform(0.0, how.delay_s)
            heapq.heappush(self._waiting, (due, next(self._order), channel, data))

    def _is_lost(self, way: Way) -> bool:
        how = self._disturbance
        if way.losing == 0 and way.random.random() < how.loss / (how.burst * (1.0 - how.loss) + how.loss):
            way.losing = way.random.randint(1, 2 * how.burst - 1)
        if way.losing == 0:
            return False
        way.losing -= 1
        return True

    def _after_stalls(self, now: float) -> float:
        self._first = now if self._first is None else self._first
        for begin, length in self._disturbance.stalls:
            if begin <= now - self._first < begin + length:
                return self._first + begin + length
        return now

    def _forward_due(self) -> None:
        while self._waiting and self._waiting[0][0] <= time.monotonic():
            _, _, channel, data = heapq.heappop(self._waiting)
            way = self._ways[channel]
            way.counts["forwarded"] += 1
            way.sink.publish(channel, data)

    def _run(self) -> None:
        while not self._stop.is_set():
            left = self._waiting[0][0] - time.monotonic() if self._waiting else LONGEST_SLEEP_S
            ready, _, _ = select.select(
                [bus.fileno() for bus in self._buses], [], [], min(max(left, 0.0), LONGEST_SLEEP_S)
            )
            for bus in self._buses:
                if bus.fileno() in ready:
                    bus.handle()
            self._forward_due()


def _with_altered_bit(data: bytes, draw: random.Random) -> bytes:
    altered = bytearray(data)
    altered[draw.randrange(min(8, len(data) - 1), len(data))] ^= 1 << draw.randrange(8)
    return bytes(altered)
