# SPDX-License-Identifier: Apache-2.0
"""A wire between the simulated sensor and the driver that delays what passes, and into which a test can speak."""

import contextlib
import os
import random
import select
import threading
import time
import tty
from pathlib import Path
from typing import Self

_POLL_SECONDS = 0.05


class PtyRelay:
    """Opens the sensor's port and offers its bytes on another one. A context manager: leaving it ends the wire.

    Every read from the sensor is held for a random time up to `most_delay_s`, as a busy reading loop would hold it.
    What finds the host's buffer full waits; with `drops` it is lost, as on a serial line.
    """

    def __init__(
        self, sensor: Path, host: Path, most_delay_s: float = 0.0, seed: int = 1, *, drops: bool = False
    ) -> None:
        self._most_delay_s = most_delay_s
        self._random = random.Random(seed)
        self._sensor = os.open(sensor, os.O_RDWR | os.O_NOCTTY)
        self._host, self._far_end = os.openpty()
        tty.setraw(self._far_end)
        os.set_blocking(self._host, not drops)
        host.symlink_to(os.ttyname(self._far_end))
        self._link = host
        self._running = True
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._running = False
        self._thread.join()
        self._link.unlink()
        for descriptor in (self._sensor, self._host, self._far_end):
            os.close(descriptor)

    def tell_sensor(self, data: bytes) -> None:
        """Sends bytes to the sensor as if the host had."""
        os.write(self._sensor, data)

    def _run(self) -> None:
        while self._running:
            ready, _, _ = select.select([self._sensor, self._host], [], [], _POLL_SECONDS)
            try:
                if self._host in ready:
                    os.write(self._sensor, os.read(self._host, 4096))
                if self._sensor in ready:
                    data = os.read(self._sensor, 4096)
                    time.sleep(self._random.uniform(0.0, self._most_delay_s))
                    with contextlib.suppress(BlockingIOError):
                        os.write(self._host, data)
            except OSError:
                return  # the sensor is gone
