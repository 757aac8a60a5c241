# SPDX-License-Identifier: Apache-2.0
"""Scan to pose, live: how long after a scan is on the bus what the front end made of it is there too.

    ninja -C build/release l1_sim l1_driver lio_frontend
    ./ignis shell env PYTHONPATH=python:build/release/python python3 bench/live_latency.py --out FOLDER

A simulated L1 sends its bytes in real time through a pseudo-terminal; l1_driver, lio_frontend and lcm-logger run as
processes of their own in a private network. The logger's stamps, of the arrival of each datagram, are one clock:
latency is from the arrival of an L1_SCAN to that of its LIO_SCAN_STATS, which the front end sends ahead of the pose in
the same call. It includes the wait for the inertial sample that passes the scan's end, up to 4 ms. `work` is what the
front end itself measured. Scans that were not applied do not count.
"""

import argparse
import os
import sys
from pathlib import Path

import numpy as np

from ignis.logs import read_log
from ignis.pipeline import Pipeline, effective_config, enter_private_network

ROOT = Path(__file__).resolve().parent.parent
QUANTILES = (50, 90, 99, 99.9, 100)


def drive(scene: Path, config: Path, seconds: float, folder: Path) -> Path:
    """Runs the processes to the end of the drive; the log that they left."""
    log, tty = folder / "live.lcm", folder / "l1.pty"
    log.unlink(missing_ok=True)
    with Pipeline(folder, effective_config(config)["lcm"]["url"]) as pipeline:
        pipeline.start("lcm-logger", "--quiet", log)
        pipeline.start("lio_frontend", "--config", config)
        simulator = pipeline.start(
            "l1_sim", "--scene", scene, "--config", config, "--pty", tty, "--wait", 20, "--duration", seconds
        )
        pipeline.wait_for_text("l1_sim", "waiting", 10.0)
        pipeline.start("l1_driver", "--config", config, "--port", tty)
        simulator.wait(seconds + 60.0)
        pipeline.stop("l1_driver", "lio_frontend", "lcm-logger")
    return log


def latencies(log: Path) -> tuple[np.ndarray, np.ndarray]:
    """[ms] of each applied scan: bus to bus, and the front end's own work."""
    arrived: dict[int, int] = {}
    total, work = [], []
    for event in read_log(log, {"L1_SCAN", "LIO_SCAN_STATS"}):
        message = event.message
        if event.channel == "L1_SCAN":
            arrived[message.sequence] = event.utime
        elif message.applied and message.scan_sequence in arrived:
            total.append(1e-3 * (event.utime - arrived[message.scan_sequence]))
            work.append(message.time_spent_ms)
    return np.array(total), np.array(work)


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", type=Path, default=ROOT / "config" / "scenes" / "battery_hall.json")
    parser.add_argument("--config", type=Path, default=ROOT / "config" / "ignis8_tuned.json")
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--out", type=Path, required=True, help="folder for the log")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    enter_private_network()
    total, work = latencies(drive(arguments.scene, arguments.config, arguments.seconds, arguments.out))
    if len(total) == 0:
        print("no scan was applied; see the logs in the folder", file=sys.stderr)
        return 1
    print(f"{len(total)} scans, load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print("| ms | " + " | ".join(f"p{quantile:g}" for quantile in QUANTILES) + " |")
    print("|---" * (len(QUANTILES) + 1) + "|")
    for name, values in (("bus to bus", total), ("work", work)):
        print(f"| {name} | " + " | ".join(f"{np.percentile(values, quantile):.2f}" for quantile in QUANTILES) + " |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
