# SPDX-License-Identifier: Apache-2.0
"""`./ignis up`: starts all processes under a supervisor that restarts what dies.

Where systemd is process 1 and the package's units are installed, it starts ignis-lio.target. Elsewhere it runs s6 with
one service folder per process below the state folder; each process says that it is ready on a file descriptor.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from ignis.bus import DEFAULT_URL
from ignis.errors import InputError, run_command
from ignis.mounts import effective_config
from ignis.places import default_config
from ignis.supervision import Supervisor, choose_supervisor, default_state_folder


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="ignis up", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--config", type=Path, default=default_config(), help="configuration (default: %(default)s)")
    parser.add_argument("--port", help="serial port instead of driver.port")
    parser.add_argument(
        "--state", type=Path, default=default_state_folder(), help="folder for s6, logs and the journal"
    )
    parser.add_argument("--view-port", type=int, help="TCP port of the view instead of hmi.port")
    parser.add_argument(
        "--only", nargs="+", metavar="PROCESS", help="start these alone, for a vehicle with several computers"
    )
    parser.add_argument("--seconds", type=float, default=20.0, help="how long to wait until all are ready")
    options = parser.parse_args(arguments)
    return run_command(lambda: _up(options))


def _up(options: argparse.Namespace) -> int:
    config = effective_config(options.config)
    supervisor: Supervisor = choose_supervisor(
        options.state,
        config_file=options.config.resolve(),
        url=os.environ.get("LCM_DEFAULT_URL") or config.get("lcm", {}).get("url", DEFAULT_URL),
        port=options.port,
        view_port=options.view_port,
        only=options.only,
    )
    if supervisor.running():
        raise InputError(f"already up ({supervisor.name}); ./ignis status shows how it is, ./ignis down ends it")
    late = supervisor.start(options.seconds)
    if late:
        print(
            f"ignis: not ready after {options.seconds:g} s: {', '.join(late)}; {supervisor.logs_hint}", file=sys.stderr
        )
        return 1
    print(f"up under {supervisor.name}; {supervisor.logs_hint}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
