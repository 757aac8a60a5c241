# SPDX-License-Identifier: Apache-2.0
"""A simulated drive with all processes under `ignis up` (s6), watched over the bus."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ignis.bus import Listener
from ignis.pipeline import Pipeline, effective_config
from ignis.status import page

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
PORT = 18090
# The state of the drive is carried on after each; the order is that of the data.
VICTIMS = ("l1_driver", "lio_frontend", "graph_backend", "map_builder")
BACK_WITHIN_S = 15.0


def command(name: str, *arguments: object, seconds: float = 90.0) -> subprocess.CompletedProcess:
    line = [sys.executable, "-m", f"ignis.{name}", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, timeout=seconds)


class Vehicle:
    """A drive under s6, watched over the bus."""

    def __init__(self, folder: Path, url: str) -> None:
        self.folder = folder
        self.listener = Listener(url)
        self.seconds: dict[str, float] = {}
        self.driver_gaps: list[float] = []

    def health(self, process: str) -> Any:
        """Newest HEALTH of a process."""
        found = [entry for (name, _), entry in self.listener.health.items() if name == process]
        return max(found, key=lambda entry: entry[0])[1] if found else None

    def wait(self, condition: Callable[[], bool], seconds: float) -> float:
        """Seconds until the condition held; fails the test when it does not in time."""
        began = time.monotonic()
        while not condition():
            assert time.monotonic() - began < seconds, page(self.listener, colour=False)
            self.listener.listen(0.05)
        return time.monotonic() - began

    def kill(self, process: str, output: str) -> float:
        """Kills a process; seconds until its successor speaks and its output flows again."""
        old = self.health(process).pid
        os.kill(old, signal.SIGKILL)
        began = time.monotonic()
        self.wait(lambda: self.health(process).pid != old, BACK_WITHIN_S)
        back = time.monotonic()
        self.wait(lambda: self.listener.channels[output].last_at > back, BACK_WITHIN_S)
        return time.monotonic() - began

    def gap_of_killed_driver(self) -> float:
        """Kills the driver; for so many seconds nothing came from the sensor."""
        old = self.health("l1_driver").pid
        os.kill(old, signal.SIGKILL)
        began = time.monotonic()
        self.listener.listen(0.02)  # what was on its way
        before = self.listener.channels["L1_IMU"].received
        while self.listener.channels["L1_IMU"].received == before and time.monotonic() - began < BACK_WITHIN_S:
            self.listener.listen(0.005)
        gap = time.monotonic() - began
        self.wait(lambda: self.health("l1_driver").pid != old, BACK_WITHIN_S)
        return gap


OUTPUTS = {
    "l1_driver": "L1_IMU",
    "lio_frontend": "LIO_STATE",
    "graph_backend": "SMOOTHED_STATE",
    "map_builder": "MAP_STATUS",
}


@contextlib.contextmanager
def simulated_vehicle(folder: Path) -> Iterator[Vehicle]:
    """A vehicle that has begun to drive; the simulated sensor goes on whatever happens to the others."""
    tty = folder / "l1.pty"
    url = effective_config(CONFIG)["lcm"]["url"]
    with Pipeline(folder, url) as pipeline:
        pipeline.start("l1_sim", "--scene", SCENE, "--config", CONFIG, "--pty", tty, "--wait", 60)
        pipeline.wait_for_text("l1_sim", "waiting", 30.0)
        driven = Vehicle(folder, url)
        options = ("--config", CONFIG, "--state", folder / "state")
        up = command("up", *options, "--port", tty, "--view-port", PORT, "--seconds", 60)
        assert up.returncode == 0, up.stderr
        try:
            driven.wait(lambda: driven.listener.channels.get("LIO_KEYFRAME") is not None, 60.0)
            driven.listener.listen(8.0)
            yield driven
        finally:
            down = command("down", "--state", folder / "state")
            assert down.returncode == 0, down.stderr
