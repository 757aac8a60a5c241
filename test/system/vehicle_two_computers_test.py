# SPDX-License-Identifier: Apache-2.0
"""Two computers: two network namespaces joined by veth, TTL 1.

Driver and front end on one, back end and map on the other, which loses a tenth of the datagrams and hangs behind a rate
limit. The graph must hold every keyframe all the same.
"""

import os
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ignis import results
from ignis.pipeline import binary, program

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
CONFIG = CHECKOUT / "config" / "ignis8_tuned.json"
SCENE = CHECKOUT / "config" / "scenes" / "battery_hall_quick.json"
URL = "udpm://239.255.76.67:7667?ttl=1&recv_buf_size=2097152"
LOSS_PERCENT = 10
RATE = "20mbit"


class Computer:
    """A network namespace that lives as long as a sleeping process in it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.holder = subprocess.Popen(["unshare", "-n", "sleep", "600"])
        self.processes: list[subprocess.Popen] = []
        while os.readlink(f"/proc/{self.holder.pid}/ns/net") == os.readlink("/proc/self/ns/net"):
            time.sleep(0.01)

    def run(self, *words: object) -> subprocess.CompletedProcess:
        """Runs a command in it to its end."""
        return subprocess.run(self.line(*words), capture_output=True, text=True, check=False)

    def start(self, name: str, *arguments: object) -> subprocess.Popen:
        """Starts a process in it."""
        with open(self.folder / f"{name}.log", "wb") as log:
            process = subprocess.Popen(
                self.line(program(name), *arguments),
                stdout=log,
                stderr=log,
                env={**os.environ, "LCM_DEFAULT_URL": URL},
                start_new_session=True,
            )
        self.processes.append(process)
        return process

    def end(self) -> None:
        """Stops all that was started here, the newest first."""
        for process in reversed(self.processes):
            if process.poll() is None:
                process.terminate()
        for process in self.processes:
            process.wait(20)
        self.processes.clear()

    def close(self) -> None:
        """Gives the namespace back."""
        self.end()
        self.holder.kill()
        self.holder.wait()

    def line(self, *words: object) -> list[str]:
        """A command line that runs in it."""
        return ["nsenter", "-t", str(self.holder.pid), "-n", *map(str, words)]


def join(near: Computer, far: Computer) -> None:
    """A cable between the two: va on the near one, vb on the far one, multicast through it."""
    must(near.run("ip", "link", "add", "va", "type", "veth", "peer", "name", "vb", "netns", far.holder.pid))
    for computer, link, address in ((near, "va", "10.77.0.1/24"), (far, "vb", "10.77.0.2/24")):
        must(computer.run("ip", "link", "set", "lo", "up"))
        must(computer.run("ip", "address", "add", address, "dev", link))
        must(computer.run("ip", "link", "set", link, "up"))
        must(computer.run("ip", "route", "add", "224.0.0.0/4", "dev", link))


def must(done: subprocess.CompletedProcess) -> None:
    assert done.returncode == 0, f"{done.args}: {done.stderr}"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Any]]:
    """One drive over the lossy link; what the first computer recorded."""
    folder = tmp_path_factory.mktemp("two")
    near, far = Computer(folder), Computer(folder)
    try:
        join(near, far)
        rate = near.run(
            "tc", "qdisc", "add", "dev", "va", "root", "tbf", "rate", RATE, "burst", "128kb", "latency", "200ms"
        )
        drop = f'iif "vb" ip daddr 239.255.76.67 numgen random mod 100 < {LOSS_PERCENT} counter drop'
        rules = f"table ip t {{ chain c {{ type filter hook input priority 0; {drop}; }}; }}"
        must(far.run("nft", rules))
        yield drive(near, far, folder) | {"rate_limited": rate.returncode == 0}
    finally:
        near.close()
        far.close()


def drive(near: Computer, far: Computer, folder: Path) -> dict[str, Any]:
    tty = folder / "l1.pty"
    config = ("--config", CONFIG)
    near.start("lcm-logger", "--quiet", folder / "near.lcmlog")
    far.start("map_builder", *config, "--port", 0)
    far.start("graph_backend", *config)
    near.start("lio_frontend", *config)
    simulator = near.start("l1_sim", "--scene", SCENE, *config, "--pty", tty, "--wait", 30)
    while not tty.is_symlink():
        assert simulator.poll() is None
        time.sleep(0.05)
    near.start("l1_driver", *config, "--port", tty)
    assert simulator.wait(240) == 0
    time.sleep(6.0)
    dropped = far.run("nft", "list", "table", "ip", "t").stdout
    near.end()
    far.end()
    return {"dropped": dropped, "summary": results.write_results(folder / "near.lcmlog", folder)}


def test_graph_holds_every_keyframe_although_datagrams_were_lost(run: dict[str, Any]) -> None:
    summary = run["summary"]
    lost = {
        name: {c: n["lost"] for c, n in channels.items() if n["lost"]}
        for name, channels in summary["receivers"].items()
    }
    packets = int(run["dropped"].partition("packets ")[2].split()[0])
    print(
        f"dropped {packets} packets; rate limited: {run['rate_limited']}; lost {lost}; "
        f"keyframes {summary['keyframes']}, in the graph {summary['keyframes_in_graph']}; loops {summary['loops']}"
    )
    assert packets > 100, "the link lost nothing"
    assert sum(lost["graph_backend"].values()) > 0, "the back end noticed no loss"
    assert summary["keyframes_in_graph"] == summary["keyframes"] > 10


def test_health_of_both_computers_is_on_the_bus(run: dict[str, Any]) -> None:
    assert set(run["summary"]["health"]) >= {"l1_driver", "lio_frontend", "graph_backend", "map_builder"}


def test_ttl_zero_stays_at_home(tmp_path: Path) -> None:
    assert binary("lio_frontend").exists()
    near, far = Computer(tmp_path), Computer(tmp_path)
    try:
        join(near, far)
        home = ("python3", "-m", "ignis.hz", "--seconds", "3", "--lcm-url")
        for ttl, reaches in ((0, False), (1, True)):
            url = URL.replace("ttl=1", f"ttl={ttl}")
            talker = subprocess.Popen(
                near.line(binary("map_builder"), "--config", CONFIG, "--port", 0, "--lcm-url", url),
                stdout=subprocess.DEVNULL,
            )
            shown = far.run(*home, url)
            talker.terminate()
            talker.wait(20)
            assert (shown.returncode == 0) == reaches, (ttl, shown.stdout, shown.stderr)
    finally:
        near.close()
        far.close()
