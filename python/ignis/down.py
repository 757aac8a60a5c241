# SPDX-License-Identifier: Apache-2.0
"""`./ignis down`: stops what `./ignis up` started. Each process ends by itself and keeps what it has."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ignis.errors import run_command
from ignis.supervision import choose_supervisor, default_state_folder


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="ignis down", description="Stops what ./ignis up started.")
    parser.add_argument("--state", type=Path, default=default_state_folder(), help="the folder given to ./ignis up")
    options = parser.parse_args(arguments)
    return run_command(lambda: _down(options))


def _down(options: argparse.Namespace) -> int:
    supervisor = choose_supervisor(options.state)
    if not supervisor.running():
        print("nothing is up")
        return 0
    supervisor.stop()
    print("down")
    return 0


if __name__ == "__main__":
    sys.exit(main())
