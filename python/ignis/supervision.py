# SPDX-License-Identifier: Apache-2.0
"""Two supervisors with one face: systemd with the package's units, and s6 where systemd is not process 1."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from ignis.errors import InputError
from ignis.places import program_folder

# In the order of the data's end: receivers are ready before senders speak.
PROCESSES = ("map_builder", "graph_backend", "lio_frontend", "l1_driver")
TARGET = "ignis-lio.target"
_READY_FD = 3
_LOG_BYTES = 1_000_000
_LOG_FILES = 5
# A process that ends again and again is started later and later. The first three times cost a drive nothing; s6 itself
# waits a second when a process has lived for less. A stop ends the pause too: a sleep that lived on would hold the
# logger's pipe open, and s6 waits for its loggers. A shell that has not become the sleep yet would lose SIGTERM.
PAUSE = r"""deaths=0
now=$(date +%s)
for stamp in $(s6-svdt . | cut -c2-17); do
  # TAI64: seconds since 1970 plus 2^62 plus 10.
  age=$((now - (0x$stamp - 0x400000000000000a)))
  # Further ahead than leap seconds: the clock was set back since.
  [ $age -le -60 ] || [ $age -ge 60 ] || deaths=$((deaths + 1))
done
case $deaths in 0 | 1 | 2 | 3) pause=0 ;; 4) pause=2 ;; 5) pause=5 ;; *) pause=10 ;; esac
if [ $pause -gt 0 ]; then
  echo "ended $deaths times within a minute, at last with $(s6-svdt . | tail -n 1 | cut -c27-); next start in $pause s"
  trap 'kill -KILL $!; exit' TERM
  sleep $pause &
  wait $!
  trap - TERM
fi"""


class Supervisor(Protocol):
    """What `up` and `down` need."""

    name: str
    logs_hint: str

    def running(self) -> bool:
        """Whether it supervises our processes now."""

    def start(self, seconds: float) -> list[str]:
        """Starts all; those not ready in time, with what is known about why."""

    def stop(self) -> None:
        """Stops all and waits for them."""


def default_state_folder() -> Path:
    """Where s6, logs, the journals of back end and map and the front end's checkpoint live."""
    base = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(os.environ.get("IGNIS_STATE") or f"{base}/ignis")


def systemd_serves(root: Path = Path("/")) -> bool:
    """Whether systemd is process 1 and the package's units are there."""
    units = (root / "usr/lib/systemd/system" / TARGET, root / "etc/systemd/system" / TARGET)
    return (root / "run/systemd/system").is_dir() and any(unit.exists() for unit in units)


def choose_supervisor(
    state: Path,
    *,
    config_file: Path | None = None,
    url: str = "",
    port: str | None = None,
    view_port: int | None = None,
    only: Sequence[str] | None = None,
) -> Supervisor:
    """systemd where it serves, else s6."""
    if systemd_serves():
        return SystemdSupervisor()
    unknown = sorted(set(only or ()) - set(PROCESSES))
    if unknown:
        raise InputError(f"unknown process {', '.join(unknown)}; there are {', '.join(PROCESSES)}")
    if shutil.which("s6-svscan") is None:
        raise InputError("systemd is not process 1 here and s6 is missing: sudo apt-get install s6")
    commands: dict[str, list[str]] = {}
    if config_file is not None:
        for name in only or PROCESSES:
            commands[name] = [str(program_folder() / name), "--config", str(config_file)]
        if port and "l1_driver" in commands:
            commands["l1_driver"] += ["--port", port]
        if view_port is not None and "map_builder" in commands:
            commands["map_builder"] += ["--port", str(view_port)]
        if "graph_backend" in commands:
            commands["graph_backend"] += ["--journal", str(state / "journal")]
        if "map_builder" in commands:
            commands["map_builder"] += ["--journal", str(state / "map")]
        if "lio_frontend" in commands:
            commands["lio_frontend"] += ["--checkpoint", str(state / "checkpoint")]
    return S6Supervisor(state, commands, {"LCM_DEFAULT_URL": url} if url else {})


class SystemdSupervisor:
    """The package's units. Their configuration is /etc/ignis-lio/config.json."""

    name = "systemd"
    logs_hint = "logs: journalctl -u 'ignis-*'"

    def running(self) -> bool:
        """Whether the target is active."""
        return subprocess.run(["systemctl", "is-active", "--quiet", TARGET], check=False).returncode == 0

    def start(self, seconds: float) -> list[str]:
        """Starts the target; systemctl waits for READY of each unit."""
        done = subprocess.run(["systemctl", "start", TARGET], check=False, timeout=seconds + 60)
        return [] if done.returncode == 0 else [TARGET]

    def stop(self) -> None:
        """Stops the target and with it the units that are part of it."""
        subprocess.run(["systemctl", "stop", TARGET], check=True)


class S6Supervisor:
    """s6-svscan over service folders that are written anew at each start."""

    name = "s6"

    def __init__(self, state: Path, commands: dict[str, list[str]], environment: dict[str, str]) -> None:
        self.state = state
        self.scan = state / "services"
        self.commands = commands
        self.environment = environment
        self.logs_hint = f"logs: {state / 'log'}/NAME/current"

    def running(self) -> bool:
        """Whether an s6-svscan works on our folder. Asked without a command: one behind that to end undoes it."""
        try:
            # Without a reader the pipe cannot be opened for writing.
            os.close(os.open(self.scan / ".s6-svscan" / "control", os.O_WRONLY | os.O_NONBLOCK))
        except OSError:
            return False
        return True

    def start(self, seconds: float) -> list[str]:
        """Writes the service folders, starts s6-svscan and waits until each process has said that it is ready."""
        shutil.rmtree(self.scan, ignore_errors=True)
        for name, command in self.commands.items():
            self._write_service(name, command)
        with open(self.state / "s6.log", "ab") as log:
            subprocess.Popen(
                ["s6-svscan", str(self.scan)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env={**os.environ, **self.environment},
                start_new_session=True,
            )
        deadline = time.monotonic() + seconds
        late = [name for name in self.commands if not self._wait_ready(name, deadline - time.monotonic())]
        return [f"{name}{self._why_late(name)}" for name in late]

    def stop(self) -> None:
        """Stops the services in the order of the data, then s6 itself."""
        names = [name for name in reversed(PROCESSES) if (self.scan / name).is_dir()]
        for name in names:
            subprocess.run(["s6-svc", "-wD", "-T", "15000", "-d", str(self.scan / name)], check=False)
        subprocess.run(["s6-svscanctl", "-t", str(self.scan)], check=False)
        deadline = time.monotonic() + 15.0
        while self.running() and time.monotonic() < deadline:
            time.sleep(0.05)

    def _wait_ready(self, name: str, seconds: float) -> bool:
        """Whether the service is up and ready in time."""
        deadline = time.monotonic() + max(seconds, 0.0)
        while True:
            shown = subprocess.run(
                ["s6-svstat", "-o", "up,ready", str(self.scan / name)], capture_output=True, text=True, check=False
            )
            if shown.stdout.split() == ["true", "true"]:
                return True
            if time.monotonic() > deadline:
                return False
            time.sleep(0.1)

    def _why_late(self, name: str) -> str:
        """How often the process has ended, and its last words; empty when it still runs."""
        shown = subprocess.run(["s6-svdt", str(self.scan / name)], capture_output=True, text=True, check=False)
        deaths = [line.split(" ", 1)[1] for line in shown.stdout.splitlines()]
        if not deaths:
            return ""
        log = self.state / "log" / name / "current"
        lines = log.read_text(errors="replace").splitlines() if log.exists() else []
        # What the supervisor adds to the log is known already.
        said = [line.partition("  ")[2] for line in lines if " times within a minute" not in line]
        return f" (ended {len(deaths)} times, at last with {deaths[-1]}: {said[-1] if said else 'without a word'})"

    def _write_service(self, name: str, command: list[str]) -> None:
        folder = self.scan / name
        (folder / "log").mkdir(parents=True)
        (self.state / "log" / name).mkdir(parents=True, exist_ok=True)
        (self.state / "journal").mkdir(exist_ok=True)
        words = shlex.join(command)
        (folder / "notification-fd").write_text(f"{_READY_FD}\n")
        _write_script(folder / "run", f"exec 2>&1\n{PAUSE}\nIGNIS_READY_FD={_READY_FD} exec {words}")
        log = shlex.quote(str(self.state / "log" / name))
        _write_script(folder / "log" / "run", f"exec s6-log -b T n{_LOG_FILES} s{_LOG_BYTES} {log}")


def _write_script(path: Path, body: str) -> None:
    path.write_text(f"#!/bin/sh\n{body}\n")
    path.chmod(0o755)
