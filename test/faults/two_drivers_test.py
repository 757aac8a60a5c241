# SPDX-License-Identifier: Apache-2.0
"""Row B7 between two computers: each has a driver, both on one bus (TTL 1). Nobody keeps silent about it."""

import json
import subprocess
import sys
import time
from pathlib import Path

from vehicle_two_computers_test import CONFIG, SCENE, URL, Computer, join

LISTEN_S = 8.0
FAULT = 3
HEAR = f"""
import json, time, lcm
from ignis_lcm.ignis import health_t
bus = lcm.LCM("{URL}")
newest = {{}}
def note(_, data):
    health = health_t.decode(data)
    newest[f"{{health.process}} {{health.pid}}"] = [health.state, health.state_text]
bus.subscribe("HEALTH", note)
end = time.monotonic() + {LISTEN_S}
while time.monotonic() < end:
    bus.handle_timeout(100)
print(json.dumps(newest))
"""


def start_driver(computer: Computer) -> subprocess.Popen:
    tty = computer.folder / "l1.pty"
    simulator = computer.start("l1_sim", "--scene", SCENE, "--config", CONFIG, "--pty", tty, "--wait", 30)
    while not tty.is_symlink():
        assert simulator.poll() is None
        time.sleep(0.05)
    return computer.start("l1_driver", "--config", CONFIG, "--lcm-url", URL, "--port", tty)


def hear(computer: Computer) -> dict[str, tuple[int, str]]:
    """The newest state of each process on the bus, by name and process id."""
    heard = computer.run(sys.executable, "-c", HEAR)
    assert heard.returncode == 0, heard.stderr[-500:]
    return {name: (state, text) for name, (state, text) in json.loads(heard.stdout).items()}


def test_fault_b7_a_second_driver_on_another_computer_is_a_fault_that_every_process_names(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("near", "far")]
    for folder in folders:
        folder.mkdir()
    near, far = (Computer(folder) for folder in folders)
    try:
        join(near, far)
        near.start("lio_frontend", "--config", CONFIG, "--lcm-url", URL)
        first = start_driver(near)
        alone = hear(near)
        second = start_driver(far)
        both = hear(near)
        second.terminate()
        second.wait(20)
        time.sleep(3.5)
        again = hear(near)
    finally:
        near.close()
        far.close()
    print(alone, both, again, sep="\n")
    front_end = next(name for name in both if name.startswith("lio_frontend"))
    drivers = sorted(name for name in both if name.startswith("l1_driver"))
    assert len(drivers) == 2
    assert "l1_driver is on the bus" not in alone[front_end][1]
    for name in drivers:
        state, text = both[name]
        assert state == FAULT and "a second l1_driver is on the bus" in text
    state, text = both[front_end]
    assert state == FAULT and "two instances of l1_driver are on the bus" in text
    assert "l1_driver" not in again[front_end][1]
    assert first.returncode is None or first.returncode == 0
