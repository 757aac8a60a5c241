# SPDX-License-Identifier: Apache-2.0
"""Starts the executables as separate processes in a network namespace of their own, and ends them again."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

import lcm

STOP_SECONDS = 10.0


class ProcessDied(RuntimeError):
    """A process ended although it should still run. The message names it, its exit code and its last words."""


def enter_private_network() -> None:
    """Moves this process into a new network namespace whose loopback carries multicast.

    Children inherit it, so nothing that they publish can reach a live robot. Sockets opened before keep theirs.
    """
    if os.geteuid() == 0:
        os.unshare(os.CLONE_NEWNET)
    else:
        uid, gid = os.getuid(), os.getgid()
        os.unshare(os.CLONE_NEWUSER | os.CLONE_NEWNET)
        Path("/proc/self/setgroups").write_text("deny")
        Path("/proc/self/uid_map").write_text(f"0 {uid} 1")
        Path("/proc/self/gid_map").write_text(f"0 {gid} 1")
    subprocess.run(["ip", "link", "set", "lo", "up", "multicast", "on"], check=True)
    subprocess.run(["ip", "route", "add", "224.0.0.0/4", "dev", "lo"], check=True)


def binary(name: str) -> Path:
    """Path of one of the built executables."""
    return Path(os.environ["IGNIS_BUILD"]) / "bin" / name


def effective_config(config: Path) -> dict:
    """The configuration as the executables see it; raises CalledProcessError when they refuse it."""
    command: list[str | Path] = [binary("lio_frontend"), "--config", config, "--print-config"]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def program(name: str) -> Path:
    """An executable of the build, or one of LCM's own tools.

    LCM's wheel puts Python scripts of the same names on the PATH, which kill the tool when they are interrupted: a
    logger would lose the end of its log.
    """
    if binary(name).exists():
        return binary(name)
    tool = Path(lcm.LCM_BIN_DIR) / name
    return tool if tool.exists() else Path(name)


class Pipeline:
    """Processes of one run; their output goes to `directory/logs/NAME.log`. A context manager: leaving it ends all."""

    def __init__(self, directory: Path, lcm_url: str) -> None:
        self.logs = directory / "logs"
        self.logs.mkdir(parents=True, exist_ok=True)
        self.environment = {**os.environ, "LCM_DEFAULT_URL": lcm_url}
        self.processes: dict[str, subprocess.Popen] = {}

    def __enter__(self) -> Pipeline:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop(*reversed(self.processes))

    def start(self, name: str, *arguments: object, listen_fd: int | None = None) -> subprocess.Popen:
        """Starts an executable of the build or a tool on the PATH. `listen_fd` is handed over by socket activation."""
        command = [str(program(name)), *map(str, arguments)]
        environment = dict(self.environment)
        if listen_fd is not None:
            # systemd's protocol wants the socket at number 3; the shell moves it there.
            environment["LISTEN_FDS"] = "1"
            command = ["/bin/bash", "-c", f'exec "$@" 3<&{listen_fd}', "_", *command]
        with open(self.logs / f"{name}.log", "wb") as log:
            self.processes[name] = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=environment,
                pass_fds=() if listen_fd is None else (listen_fd,),
                # Ctrl-C goes to us alone; we end the others in order, so that nothing computed is lost.
                start_new_session=True,
            )
        return self.processes[name]

    def last_words(self, name: str, lines: int = 5) -> str:
        """The end of what a process printed."""
        return "\n".join((self.logs / f"{name}.log").read_text(errors="replace").splitlines()[-lines:])

    def check(self, *expected_to_end: str) -> None:
        """Raises ProcessDied when a process other than the named ones is gone."""
        for name, process in self.processes.items():
            code = process.poll()
            if code is not None and name not in expected_to_end:
                raise ProcessDied(f"{name} ended with code {code}: {self.last_words(name)}")

    def stop(self, *names: str) -> None:
        """Asks each process to end and waits for it; kills what does not end in time.

        A second Ctrl-C must not leave processes behind, so it waits until all have ended.
        """
        previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            self._stop(names)
        finally:
            signal.signal(signal.SIGINT, previous)

    def _stop(self, names: Sequence[str]) -> None:
        for name in names:
            process = self.processes.pop(name, None)
            if process is None or process.poll() is not None:
                continue
            process.send_signal(signal.SIGINT)
            try:
                process.wait(STOP_SECONDS)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def wait_for_text(self, name: str, text: str, seconds: float) -> None:
        """Waits until a process has printed `text`."""
        deadline = time.monotonic() + seconds
        while text not in (self.logs / f"{name}.log").read_text(errors="replace"):
            self.check()
            if time.monotonic() > deadline:
                raise TimeoutError(f"{name} did not print {text!r} within {seconds:.0f} s: {self.last_words(name)}")
            time.sleep(0.05)
