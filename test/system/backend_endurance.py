# SPDX-License-Identifier: Apache-2.0
"""The back end killed at many instants, and with many datagrams lost: keyframes, graph and trajectory afterwards.

Not part of the test run; called by hand:

    ./ignis shell python3 test/system/backend_endurance.py --kills 50

Exits with 1 when a run did not end with the graph of the undisturbed one.
"""

import argparse
import os
import random
import re
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(os.environ["IGNIS_CHECKOUT"]) / "test" / "python"))

from ignis.pipeline import enter_private_network
from keyframe_source import BackendRun, Outcome, record_keyframes

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
INTERVAL = 0.25  # [s] between keyframes
KILLS_PER_RUN = 10
LOSSES = (0.01, 0.1, 0.3)
SAME_TRAJECTORY = 1e-3  # [m]


def resume_seconds(outcome: Outcome) -> float:
    """Longest time that a new process needed for its journal [s]."""
    times = [float(found) for text in outcome.resumes for found in re.findall(r" in ([0-9.]+) s", text)]
    return max(times, default=0.0)


def report(name: str, outcome: Outcome, undisturbed: Outcome) -> bool:
    """Prints a line of the table; whether the run ended with the same graph."""
    distance = outcome.distance(undisturbed)
    is_same = distance < SAME_TRAJECTORY and outcome.revision == undisturbed.revision
    print(
        f"{name:<16} {len(outcome.poses):>4} of {len(undisturbed.poses)} keyframes, revision {outcome.revision},"
        f" {len(outcome.loops)} loops heard, largest distance {1e3 * distance:.4f} mm, {outcome.kills} kills,"
        f" resumed in {resume_seconds(outcome):.2f} s at most, {outcome.dropped} of {outcome.sent} datagrams lost"
        f"{'' if is_same else '   DIFFERS'}",
        flush=True,
    )
    return is_same


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=50, help="instants at which the back end is killed (default 50)")
    parser.add_argument("--scene", type=Path, default=CHECKOUT / "config" / "scenes" / "battery_hall_quick.json")
    parser.add_argument("--seconds", type=float, default=60.0, help="length of the drive (default 60)")
    arguments = parser.parse_args()
    enter_private_network()
    same = True
    with tempfile.TemporaryDirectory() as folder_name:
        folder = Path(folder_name)
        keyframes = record_keyframes(folder / "recording", arguments.scene, CONFIG, arguments.seconds)
        undisturbed = BackendRun(folder / "undisturbed", CONFIG, keyframes, 0.0, 0).drive(INTERVAL)
        report("undisturbed", undisturbed, undisturbed)
        for number in range((arguments.kills + KILLS_PER_RUN - 1) // KILLS_PER_RUN):
            rng = random.Random(number)
            count = min(KILLS_PER_RUN, arguments.kills - number * KILLS_PER_RUN)
            kills = [rng.uniform(0.5, len(keyframes) * INTERVAL + 1.0) for _ in range(count)]
            outcome = BackendRun(folder / f"kills{number}", CONFIG, keyframes, 0.0, number).drive(INTERVAL, kills)
            same &= report(f"{count} kills, seed {number}", outcome, undisturbed)
        for loss in LOSSES:
            outcome = BackendRun(folder / f"loss{loss}", CONFIG, keyframes, loss, 5).drive(INTERVAL)
            same &= report(f"{100 * loss:.0f} % lost", outcome, undisturbed)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
