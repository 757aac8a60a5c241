# SPDX-License-Identifier: Apache-2.0
"""`./ignis demo`: a simulated drive through every process, over the real bus, ending in a comparison.

l1_sim writes the sensor's bytes on a pseudo-terminal, l1_driver reads them, lio_frontend, graph_backend and map_builder
do their work, lcm-logger records. All of them live in a network namespace of their own; only the browser view's
listening socket belongs to the host's.
"""

import argparse
import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from datetime import datetime
from pathlib import Path
from typing import Any

from ignis import results
from ignis.bus import open_bus
from ignis.compare import comparison, table
from ignis.errors import EXIT_FAILURE, InputError, run_command
from ignis.files import put_in_place, write_text
from ignis.log_config import CONFIG_CHANNEL, encoded
from ignis.pipeline import Pipeline, ProcessDied, binary, effective_config, enter_private_network
from ignis.progress import Progress

SCENES = {False: "battery_hall", True: "battery_hall_quick"}
SETTLE_SECONDS = 3.0
LOG_NAME = "run.lcmlog"


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    options = _parse(sys.argv[1:] if arguments is None else arguments)
    return run_command(lambda: _demo(options))


def _parse(arguments: list[str]) -> argparse.Namespace:
    checkout = Path(os.environ["IGNIS_CHECKOUT"])
    parser = argparse.ArgumentParser(prog="./ignis demo", description="A simulated drive through every process.")
    parser.add_argument("--quick", action="store_true", help="a drive of about one minute instead of more than three")
    parser.add_argument("--scene", type=Path, help="another scene file")
    parser.add_argument(
        "--config", type=Path, default=checkout / "config" / "ignis8_tuned.json", help="configuration file"
    )
    parser.add_argument("--seed", type=int, default=1, help="seed of all noise")
    parser.add_argument("--out", type=Path, help="results folder (default: results/demo-DATE-TIME)")
    parser.add_argument(
        "--port", type=int, help="TCP port of the browser view (default: hmi.port, or the next free one)"
    )
    parser.add_argument("--no-serve", action="store_true", help="end after the table instead of serving the view")
    options = parser.parse_args(arguments)
    options.scene = options.scene or checkout / "config" / "scenes" / f"{SCENES[options.quick]}.json"
    options.out = options.out or checkout / "results" / f"demo-{datetime.now():%Y%m%d-%H%M%S}"
    return options


def _demo(options: argparse.Namespace) -> int:
    if not options.config.is_file():
        raise InputError(f"{options.config}: no such configuration file")
    config = effective_config(options.config)
    duration = _drive_seconds(options.scene)
    listener = _listen(options.port, config["hmi"]["port"])
    address = f"http://127.0.0.1:{listener.getsockname()[1]}/"
    options.out.mkdir(parents=True, exist_ok=True)
    enter_private_network()

    print(f"Scene {options.scene.stem}, {duration:.0f} s in real time. Watch it at {address}", flush=True)
    with Pipeline(options.out, config["lcm"]["url"]) as pipeline:
        try:
            _drive(pipeline, options, config, listener, duration)
        except ProcessDied as error:
            print(f"ignis: {error}", file=sys.stderr)
            print(f"ignis: what each process said is in {pipeline.logs}", file=sys.stderr)
            return EXIT_FAILURE
        except KeyboardInterrupt:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # A second Ctrl-C must not cost the evaluation.
            print("\nInterrupted; evaluating what was driven.", flush=True)
            options.no_serve = True
        pipeline.stop("l1_sim", "l1_driver", "lio_frontend", "graph_backend", "lcm-logger")
        _keep_log(options.out)
        summary = results.write_results(options.out / LOG_NAME, options.out)
        compared = comparison(options.out)
        write_text(options.out / "summary.json", json.dumps(summary, indent=2) + "\n")
        write_text(options.out / "config.json", json.dumps(config, indent=2) + "\n")
        print(_report(summary, compared))
        print(f"Results:      {options.out}")
        if options.no_serve or not sys.stdin.isatty():
            print(f"Browser view: was at {address}; run `./ignis demo` in a terminal to keep it up after the drive")
        else:
            print(f"Browser view: {address}   (Ctrl-C ends it)", flush=True)
            _serve(pipeline)
    return 0


def _drive_seconds(scene: Path) -> float:
    command: list[str | Path] = [binary("l1_sim"), "--scene", scene, "--print-scene"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise InputError(done.stderr.strip())
    return json.loads(done.stdout)["drive"]["duration_s"]


def _listen(wanted: int | None, default: int) -> socket.socket:
    """A listening socket in the host's namespace: the wanted port, or the first free one from the default on."""
    candidates = [wanted] if wanted is not None else [*range(default, default + 20), 0]
    for port in candidates:
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind(("127.0.0.1", port))
        except OSError:
            listener.close()
            continue
        listener.listen(64)
        return listener
    raise InputError(f"port {wanted} is occupied; give another one with --port, or leave it out")


def _drive(
    pipeline: Pipeline, options: argparse.Namespace, effective: dict[str, Any], listener: socket.socket, duration: float
) -> None:
    """Starts everything, waits for the end of the drive, and lets the last messages arrive."""
    config = ("--config", options.config)
    port = options.out / "l1.pty"
    pipeline.start("lcm-logger", "--quiet", "--force", options.out / f"{LOG_NAME}.tmp")
    pipeline.start("map_builder", *config, listen_fd=listener.fileno())
    pipeline.start("graph_backend", *config)
    pipeline.start("lio_frontend", *config)
    simulator = pipeline.start(
        "l1_sim", "--scene", options.scene, *config, "--seed", options.seed, "--pty", port, "--wait", 20
    )
    pipeline.wait_for_text("l1_sim", "waiting", 10.0)
    news = _News(pipeline.environment["LCM_DEFAULT_URL"])
    news.bus.publish(CONFIG_CHANNEL, encoded(effective))  # into the log, so that it can be replayed by itself
    pipeline.start("l1_driver", *config, "--port", port)

    progress = Progress("driving")
    began = time.monotonic()
    while simulator.poll() is None:
        pipeline.check("l1_sim")
        news.listen(0.5)
        driven = min(time.monotonic() - began, duration)
        progress.update(driven / duration, f"of {duration:.0f} s, {duration - driven:.0f} s left; {news.line()}")
    progress.close()
    if simulator.returncode != 0:
        raise ProcessDied(f"l1_sim ended with code {simulator.returncode}: {pipeline.last_words('l1_sim')}")
    time.sleep(SETTLE_SECONDS)
    news.bus.publish(CONFIG_CHANNEL, encoded(effective))  # again: datagrams may be lost
    pipeline.check("l1_sim", "l1_driver")


class _News:
    """The newest word of each process, for the progress line."""

    def __init__(self, url: str) -> None:
        from ignis_lcm.ignis import health_t, loop_result_t, scan_stats_t

        self.bus = open_bus(url)
        self.applied = self.scans = self.loops = 0
        self.states: dict[str, str] = {}
        self.types = {"LIO_SCAN_STATS": scan_stats_t, "LOOP_RESULT": loop_result_t, "HEALTH": health_t}
        for channel in self.types:
            self.bus.subscribe(channel, self._take).set_queue_capacity(500)

    def _take(self, channel: str, data: bytes) -> None:
        message = self.types[channel].decode(data)
        if channel == "LIO_SCAN_STATS":
            self.scans += 1
            self.applied += message.applied
        elif channel == "LOOP_RESULT":
            self.loops += message.accepted
        else:
            self.states[message.process] = "" if message.state == message.OK else message.state_text

    def listen(self, seconds: float) -> None:
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            # A signal makes LCM fail with an OSError before Python raises what the signal stands for.
            with contextlib.suppress(OSError):
                self.bus.handle_timeout(int(left * 1000) + 1)

    def line(self) -> str:
        troubles = [f"{name}: {text}" for name, text in sorted(self.states.items()) if text]
        return "; ".join([f"scans {self.applied}/{self.scans} applied, loops {self.loops}", *troubles])


def _keep_log(folder: Path) -> None:
    put_in_place(folder / f"{LOG_NAME}.tmp", folder / LOG_NAME)


def _report(summary: dict[str, Any], compared: dict[str, Any]) -> str:
    rejected = ", ".join(f"{count} {reason}" for reason, count in summary["rejected"].items()) or "none"
    voxels = summary["voxels"] or {}
    lines = [
        "",
        table(compared),
        "",
        f"Scans:        {summary['applied']} of {summary['scans']} applied; rejected: {rejected}",
        f"Keyframes:    {summary['keyframes']}, in the graph {summary['keyframes_in_graph']}",
        f"Loops:        {summary['loops']['accepted']} accepted; "
        + ", ".join(f"{count} {reason}" for reason, count in summary["loops"]["by_reason"].items()),
        "Voxels:       " + ", ".join(f"{count} {level}" for level, count in voxels.items()),
        "Lost:         " + "; ".join(_losses(summary)),
    ]
    return "\n".join(lines)


def _losses(summary: dict[str, Any]) -> list[str]:
    """One entry per receiver: what it lost, by channel where it lost anything."""
    entries = []
    for process, channels in summary["receivers"].items():
        if not channels:
            continue
        bad = {
            name: counts["lost"] + counts["rejected"] + counts["queue_drops"]
            for name, counts in channels.items()
            if counts["lost"] + counts["rejected"] + counts["queue_drops"] > 0
        }
        received = sum(counts["received"] for counts in channels.values())
        detail = ", ".join(f"{name} {count}" for name, count in bad.items())
        entries.append(f"{process} {sum(bad.values())} of {received}" + (f" ({detail})" if detail else ""))
    return entries


def _serve(pipeline: Pipeline) -> None:
    try:
        while True:
            pipeline.check()
            time.sleep(0.5)
    except KeyboardInterrupt:
        print()


if __name__ == "__main__":
    sys.exit(main())
