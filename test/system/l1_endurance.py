# SPDX-License-Identifier: Apache-2.0
"""A long run of the real driver on the serial port of the simulated sensor: lost samples, processor time, stamp error.

Not part of the test run; called by hand:

    ./ignis shell python3 test/system/l1_endurance.py --seconds 600

Exits with 1 when a sample was lost or the driver used more than its share of a core.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from ignis.logs import read_log
from ignis.pipeline import Pipeline, binary, enter_private_network
from ignis.sim import read_scene

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall.json"
BUS = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152"
MOST_CPU_PERCENT = 5.0
SETTLED_US = 1_000_000


def long_scene(folder: Path) -> Path:
    """The battery hall with its drive lengthened to an hour: its end lies on its first leg, so it can go round."""
    scene = read_scene(SCENE)
    scene["geometry"] = ""
    way = scene["trajectory"]["waypoints"]
    scene["trajectory"]["waypoints"] = way + way[1:] * 20
    path = folder / "long_scene.json"
    path.write_text(json.dumps(scene))
    return path


def cpu_seconds(pid: int) -> float:
    """User and system time of a process, all of its threads."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def run(scene: Path, seconds: float, folder: Path) -> tuple[Path, str, dict[str, float]]:
    """One run; returns the log, what the sensor said at its end, and percent of a core by process."""
    port, log = folder / "l1.pty", folder / "bus.lcmlog"
    with Pipeline(folder, BUS) as pipeline:
        # Scans would fill the disk: their losses show in L1_STATUS, which counts packets.
        pipeline.start("lcm-logger", "--quiet", "--channel=L1_IMU|L1_STATUS|GROUND_TRUTH|HEALTH", log)
        common = ("--config", CONFIG)
        sensor = pipeline.start("l1_sim", "--scene", scene, *common, "--pty", port, "--wait", 60, "--duration", seconds)
        pipeline.wait_for_text("l1_sim", "waiting", 60.0)
        driver = pipeline.start("l1_driver", *common, "--port", port)
        pipeline.wait_for_text("l1_driver", "reading", 20.0)
        processes = {"l1_driver": driver, "l1_sim": sensor}
        began, used = time.monotonic(), {name: cpu_seconds(each.pid) for name, each in processes.items()}
        deadline = began + seconds - 0.5
        while time.monotonic() < deadline:
            pipeline.check()
            time.sleep(min(1.0, max(deadline - time.monotonic(), 0.0)))
        passed = time.monotonic() - began
        percent = {name: 100.0 * (cpu_seconds(each.pid) - used[name]) / passed for name, each in processes.items()}
        if sensor.wait(60) != 0:
            raise RuntimeError(pipeline.last_words("l1_sim"))
        time.sleep(1.0)
        pipeline.stop("l1_driver", "lcm-logger")
        return log, pipeline.last_words("l1_sim", 10), percent


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0, help="length of the run (default 600)")
    arguments = parser.parse_args()
    if not binary("l1_driver").exists():
        parser.error("l1_driver is not built; run ./ignis build first")
    enter_private_network()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log, words, percent = run(long_scene(folder), arguments.seconds, folder)
        events = list(read_log(log))
    samples = [event.message for event in events if event.channel == "L1_IMU"]
    truth = next(event.message for event in events if event.channel == "GROUND_TRUTH")
    status = [event.message for event in events if event.channel == "L1_STATUS"][-1]
    measured = round(arguments.seconds * 250) + 1
    lost = measured - status.imu_published
    print(words)
    print(
        f"samples: {measured} measured, {status.imu_published} published, {lost} lost; gaps by the counter: "
        f"{status.imu_gaps} samples, {status.scan_gaps} scan packets; {status.crc_errors} checksum errors"
    )
    print(f"scan packets: {status.scans_paired} paired, {status.scans_unpaired} unpaired")
    print(f"recorder: {status.imu_published - len(samples)} published samples missed (no fault of the driver)")
    # The k-th sample was measured 4 ms times k after the first.
    began = truth.utime - 4000 * truth.sequence
    errors = np.abs([sample.utime - began - 4000 * sample.sequence for sample in samples][SETTLED_US // 4000 :])
    print(f"stamp error: median {np.median(errors):.0f} us, largest {errors.max():.0f} us")
    print(f"processor time, percent of one core: driver {percent['l1_driver']:.2f}, sensor {percent['l1_sim']:.2f}")
    any_lost = any((lost, status.imu_gaps, status.scan_gaps, status.scans_unpaired))
    return 1 if any_lost or percent["l1_driver"] > MOST_CPU_PERCENT else 0


if __name__ == "__main__":
    sys.exit(main())
