# SPDX-License-Identifier: Apache-2.0
"""What the pipeline costs in a real-time drive, and how fast each process is back after kill -9.

Prints the tables of docs/vehicle.md. Run it with:
    ./ignis shell python3 test/system/vehicle_cost.py
"""

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

from vehicle_run import OUTPUTS, VICTIMS, Vehicle, simulated_vehicle

from ignis.pipeline import enter_private_network


def cpu_seconds(pid: int) -> float:
    """User and system time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_mib(pid: int) -> float:
    """Resident memory now."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    raise RuntimeError(f"process {pid} is gone")


def print_cost(vehicle: Vehicle, seconds: float) -> None:
    """CPU over so many seconds, and memory at their end."""
    pids = {name: vehicle.health(name).pid for name in VICTIMS}
    before = {name: cpu_seconds(pid) for name, pid in pids.items()}
    began = time.monotonic()
    vehicle.listener.listen(seconds)
    measured = time.monotonic() - began
    cpu = {name: 100.0 * (cpu_seconds(pid) - before[name]) / measured for name, pid in pids.items()}
    memory = {name: resident_mib(pid) for name, pid in pids.items()}
    print(f"{measured:.0f} s of driving, load of the machine {os.getloadavg()[0]:.1f}\n")
    print("| process | CPU, % of one core | resident, MiB |\n|---|---|---|")
    for name in VICTIMS:
        print(f"| `{name}` | {cpu[name]:.1f} | {memory[name]:.0f} |")
    print(f"| all | {sum(cpu.values()):.1f} | {sum(memory.values()):.0f} |\n")


def print_kills(vehicle: Vehicle) -> None:
    """Kills each process in turn."""
    print("| process | output flows again after, s |\n|---|---|")
    for name in VICTIMS:
        print(f"| `{name}` | {vehicle.kill(name, OUTPUTS[name]):.2f} |", flush=True)
        vehicle.listener.listen(3.0)


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=30.0, help="of driving over which CPU is measured")
    options = parser.parse_args()
    enter_private_network()
    with tempfile.TemporaryDirectory() as folder, simulated_vehicle(Path(folder)) as vehicle:
        print_cost(vehicle, options.seconds)
        print_kills(vehicle)
    return 0


if __name__ == "__main__":
    sys.exit(main())
