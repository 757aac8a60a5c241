# SPDX-License-Identifier: Apache-2.0
"""A long simulated drive through the real processes with viewers: memory, latency, keyframes, descriptors over time.

Not part of the test run; called by hand:

    ./ignis shell python3 test/faults/soak.py --seconds 3600 --out results/soak
    ./ignis shell python3 test/faults/soak.py --seconds 1800 --viewers 0 --browsers 3 --out results/soak
    ./ignis shell python3 test/faults/soak.py --seconds 3600 --speed 5 --out results/soak
    ./ignis shell python3 test/faults/soak.py --seconds 10800 --speed 6 --set backend.estimated_keyframes=1000 \\
        --out results/soak

With --speed the sensor is a lap that is played again and again, without the driver; seconds are those of the sensor.

Writes soak.csv, soak.json and soak.png. Exits with 1 when a keyframe was lost, a process died, descriptors or threads
grew, or a browser's page was disconnected or fell over something. Memory and latency depend on what is simulated and on
who else works: they are printed, by quarters and halves.
"""

from __future__ import annotations

import argparse
import csv
import json
import re
import sys
import threading
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE.parent / "system", HERE.parent / "map", HERE.parent / "web"):
    sys.path.insert(0, str(folder))

from l1_endurance import long_scene  # noqa: E402
from lap_player import LapPlayer, simulate_laps  # noqa: E402
from soak_pages import WatchedPages  # noqa: E402
from soak_pages import troubles as troubles_of_pages  # noqa: E402

from fault_drive import BUS, CONFIG, PORT, SCENE  # noqa: E402
from ignis.bus import Listener  # noqa: E402
from ignis.pipeline import Pipeline, enter_private_network  # noqa: E402
from ignis.status import STATES  # noqa: E402
from stream_server import Server  # noqa: E402

matplotlib.use("Agg")

PROCESSES = ("l1_driver", "lio_frontend", "graph_backend", "map_builder")
NUMBERS = re.compile(r"[0-9.]+")
MOST_TOLD = 400
SETTLED_S = 60.0  # caches and windows fill


@dataclass
class Sample:
    """What one process used at one instant."""

    seconds: float
    process: str
    memory_mb: float
    latency_ms: float
    cpu_percent: float
    descriptors: int
    threads: int
    keyframes: int
    state: int


class Viewer(threading.Thread):
    """Reads the stream as fast as it comes and counts."""

    def __init__(self, server: Any) -> None:
        super().__init__(daemon=True)
        status, self.socket = server.upgrade()
        assert status == 101
        self.frames = self.bytes = 0
        self.longest_pause = self.longest_pause_began = 0.0
        self.start()

    def run(self) -> None:
        began = last = time.monotonic()
        try:
            while True:
                opcode, payload = self.socket.receive()
                if opcode == 2:
                    now = time.monotonic()
                    if now - last > self.longest_pause:
                        self.longest_pause, self.longest_pause_began = now - last, last - began
                    last, self.frames, self.bytes = now, self.frames + 1, self.bytes + len(payload)
        except OSError:
            return


class ViewAddress(Server):
    """A running map_builder as a server to connect to."""

    def __init__(self, port: int) -> None:
        self.port = port


def used_by(pid: int) -> tuple[int, int]:
    """Open descriptors and threads."""
    return len(list(Path(f"/proc/{pid}/fd").iterdir())), len(list(Path(f"/proc/{pid}/task").iterdir()))


class LiveSensor:
    """The simulated sensor on its line, and the driver: in real time."""

    def __init__(self, pipeline: Pipeline, folder: Path, seconds: float, common: tuple[object, ...]) -> None:
        port = folder / "l1.pty"
        scene = long_scene(folder)
        pipeline.start("l1_sim", "--scene", scene, *common, "--pty", port, "--wait", 60, "--duration", seconds + 30)
        pipeline.wait_for_text("l1_sim", "waiting", 60.0)
        pipeline.start("l1_driver", *common, "--port", port)
        self._began = time.monotonic()

    @property
    def played_s(self) -> float:
        return time.monotonic() - self._began

    def end(self) -> None:
        """Ends with the pipeline."""


def start_sensor(
    pipeline: Pipeline, folder: Path, seconds: float, speed: float, common: tuple[object, ...]
) -> LiveSensor | LapPlayer:
    """What the processes get their measurements from."""
    if speed == 1.0:
        return LiveSensor(pipeline, folder, seconds, common)
    player = LapPlayer(simulate_laps(SCENE, CONFIG, folder, BUS), BUS, speed)
    player.start()
    return player


def drive(
    folder: Path, seconds: float, viewers: int, browsers: int, speed: float, settings: list[str]
) -> tuple[list[Sample], dict[str, Any]]:
    """One soak; returns the samples and what was counted."""
    samples: list[Sample] = []
    ids: set[int] = set()
    told: list[tuple[float, str, str]] = []

    def note(channel: str, message: Any) -> None:
        if channel == "LIO_KEYFRAME":
            ids.add(message.id)

    listener = Listener(BUS, "HEALTH|LIO_KEYFRAME|SMOOTHED_KEYFRAMES|MAP_STATUS", note)
    with Pipeline(folder, BUS) as pipeline:
        common = ("--config", CONFIG, *(word for setting in settings for word in ("--set", setting)))
        pipeline.start("map_builder", *common, "--port", PORT)
        pipeline.wait_for_text("map_builder", "http://", 20.0)
        with WatchedPages(f"http://127.0.0.1:{PORT}/", browsers, folder) as pages:
            pipeline.start("graph_backend", *common, "--journal", folder / "journal")
            pipeline.start("lio_frontend", *common)
            sensor = start_sensor(pipeline, folder, seconds, speed, common)
            watching = [Viewer(ViewAddress(PORT)) for _ in range(viewers)]
            while (passed := sensor.played_s) < seconds:
                listener.listen(2.0)
                pipeline.check()
                pages.look(passed)
                for (name, pid), (_, health) in listener.health.items():
                    note_text(told, round(passed, 1), name, health)
                    descriptors, threads = used_by(pid)
                    samples.append(
                        Sample(
                            round(passed, 1), name, health.memory_mb, health.latency_ms, health.cpu_percent,
                            descriptors, threads, len(ids), health.state,
                        )
                    )  # fmt: skip
            sensor.end()
            listener.listen(5.0)
            browser_pages = pages.figures()
            newest = {name: listener.channels[name].newest for name in ("SMOOTHED_KEYFRAMES", "MAP_STATUS")}
            journal = sum(file.stat().st_size for file in (folder / "journal").iterdir())
        pipeline.stop("l1_driver", "l1_sim")
    lost = {
        f"{name} {channel}": count
        for (name, _), (_, health) in listener.health.items()
        for channel, count in zip(health.channels, health.lost, strict=True)
        if count
    }
    return samples, {
        "seconds": seconds,
        "keyframes": len(ids),
        "keyframes_not_seen": sorted(set(range(max(ids) + 1)) - ids),
        "keyframes_in_graph": newest["SMOOTHED_KEYFRAMES"].graph_keyframes,
        "keyframes_in_map": newest["MAP_STATUS"].keyframes,
        "journal_mb": round(journal / 1e6, 2),
        "messages_lost": lost,
        "viewers": [
            {
                "frames": each.frames,
                "mb": round(each.bytes / 1e6, 1),
                "longest_pause_s": round(each.longest_pause, 2),
                "it_began_at_s": round(each.longest_pause_began, 1),
            }
            for each in watching
        ],
        "pages": browser_pages,
        "told": told[-MOST_TOLD:],
    }


def note_text(told: list[tuple[float, str, str]], seconds: float, name: str, health: Any) -> None:
    """Keeps what a process says of itself when it begins to be not OK, or OK again, or so for another reason."""
    words = f"{STATES[health.state]}: {NUMBERS.sub('#', health.state_text)}"
    before = next((text for _, other, text in reversed(told) if other == name), "OK")
    if health.state == 0 and before.startswith("OK"):
        return
    if words != before:
        told.append((seconds, name, words))


def judged(samples: list[Sample], figures: dict[str, Any]) -> list[str]:
    """Adds the trends to the figures; what is wrong, in words."""
    troubles = troubles_of_pages(figures["pages"])
    if figures["keyframes_in_graph"] < figures["keyframes"]:
        troubles.append("the graph lost keyframes")
    for name in PROCESSES:
        own = [sample for sample in samples if sample.process == name and sample.seconds > SETTLED_S]
        if not own:
            continue
        seconds = np.array([sample.seconds for sample in own])
        memory = np.array([sample.memory_mb for sample in own])
        half = len(own) // 2
        latency = [sample.latency_ms for sample in own]
        figures[name] = {
            "memory_mb": [round(float(memory[0]), 1), round(float(memory[-1]), 1)],
            "memory_mb_of_quarters": [round(float(np.median(part)), 1) for part in np.array_split(memory, 4)],
            "memory_mb_per_hour": round(float(3600 * np.polyfit(seconds, memory, 1)[0]), 1),
            "latency_ms_median_of_halves": [
                round(float(np.median(part)), 2) for part in (latency[:half], latency[half:])
            ],
            "latency_ms_p99": round(float(np.percentile(latency, 99)), 1),
            "cpu_percent": round(float(np.mean([sample.cpu_percent for sample in own])), 1),
            "descriptors": [own[0].descriptors, own[-1].descriptors],
            "threads": [own[0].threads, own[-1].threads],
            "not_ok": sum(sample.state != 0 for sample in own),
        }
        if figures[name]["descriptors"][1] > figures[name]["descriptors"][0]:
            troubles.append(f"{name}: descriptors grow")
        if own[-1].threads > own[0].threads + 1:  # a rebuild has a thread of its own
            troubles.append(f"{name}: threads grow")
    return troubles


def plot(samples: list[Sample], file: Path) -> None:
    """Memory and latency over time."""
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(3, 1, figsize=(9, 8), sharex=True, layout="constrained")
    for name in PROCESSES:
        own = [sample for sample in samples if sample.process == name]
        times = [sample.seconds / 60 for sample in own]
        axes[0].plot(times, [sample.memory_mb for sample in own], label=name)
        axes[1].plot(times, [sample.latency_ms for sample in own], label=name, linewidth=0.8)
    axes[2].plot([sample.seconds / 60 for sample in samples], [sample.keyframes for sample in samples], color="black")
    axes[1].set_yscale("symlog", linthresh=1.0)
    for axis, label in zip(
        axes, ("resident memory [MB]", "longest latency of a second [ms]", "keyframes"), strict=True
    ):
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
    axes[0].legend(ncols=4, fontsize="small")
    axes[2].set_xlabel("minutes")
    figure.savefig(file, dpi=110)


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0, help="length of the drive (default 600)")
    parser.add_argument("--speed", type=float, default=1.0, help="of the sensor's time (default 1: through the driver)")
    parser.add_argument("--viewers", type=int, default=3, help="WebSocket clients (default 3)")
    parser.add_argument("--browsers", type=int, default=0, help="headless browsers with the page open (default 0)")
    parser.add_argument("--set", action="append", default=[], metavar="section.key=value", help="for every process")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    options = parser.parse_args()
    if options.seconds < 2 * SETTLED_S:
        parser.error(f"--seconds must be at least {2 * SETTLED_S:.0f}: the first {SETTLED_S:.0f} are left out")
    options.out.mkdir(parents=True, exist_ok=True)
    enter_private_network()
    samples, figures = drive(
        options.out.resolve(), options.seconds, options.viewers, options.browsers, options.speed, options.set
    )
    troubles = judged(samples, figures)
    with open(options.out / "soak.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, list(asdict(samples[0])))
        writer.writeheader()
        writer.writerows(asdict(sample) for sample in samples)
    (options.out / "soak.json").write_text(json.dumps({**figures, "troubles": troubles}, indent=1))
    plot(samples, options.out / "soak.png")
    print(json.dumps({**figures, "troubles": troubles}, indent=1))
    return 1 if troubles else 0


if __name__ == "__main__":
    sys.exit(main())
