# SPDX-License-Identifier: Apache-2.0
"""Two message buses and a thread that carries some channels from one to the other, losing a share on the way."""

import random
import select
import threading
from collections.abc import Sequence

import lcm


class LossyRelay:
    """Forwards `there` from bus a to bus b and `back` from b to a. A context manager: leaving it ends the thread."""

    def __init__(self, a: str, b: str, there: Sequence[str], back: Sequence[str], loss: float, seed: int) -> None:
        self.forwarded = 0
        self.dropped = 0
        self._random = random.Random(seed)
        self._loss = loss
        self._a, self._b = lcm.LCM(a), lcm.LCM(b)
        self._connect(self._a, self._b, there)
        self._connect(self._b, self._a, back)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> "LossyRelay":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _connect(self, source: lcm.LCM, sink: lcm.LCM, channels: Sequence[str]) -> None:
        def carry(channel: str, data: bytes) -> None:
            if self._random.random() < self._loss:
                self.dropped += 1
            else:
                self.forwarded += 1
                sink.publish(channel, data)

        for channel in channels:
            source.subscribe(channel, carry).set_queue_capacity(5000)

    def _run(self) -> None:
        while not self._stop.is_set():
            ready, _, _ = select.select([self._a.fileno(), self._b.fileno()], [], [], 0.05)
            for bus in (self._a, self._b):
                if bus.fileno() in ready:
                    bus.handle()
