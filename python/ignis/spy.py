# SPDX-License-Identifier: Apache-2.0
"""`./ignis spy`: LCM's own lcm-spy with our message types, the vehicle's bus and enough memory."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from pathlib import Path

import lcm

from ignis.bus import default_url
from ignis.errors import InputError, run_command
from ignis.places import types_jar

# lcm-spy's own 128 MB freeze under a vehicle's traffic.
_HEAP = "-Xmx1g -Xms128m"


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="ignis spy", description="lcm-spy with the right types, bus and memory.")
    parser.add_argument("--lcm-url", default=default_url(), help="the bus (default: %(default)s)")
    options = parser.parse_args(arguments)
    return run_command(lambda: _spy(options))


def _spy(options: argparse.Namespace) -> int:
    jar = types_jar()
    if not jar.is_file():
        raise InputError(f"{jar} is missing; run ./ignis build")
    if shutil.which("java") is None:
        raise InputError(
            "lcm-spy needs Java (sudo apt-get install default-jre); ./ignis echo and ./ignis hz do without"
        )
    if not os.environ.get("DISPLAY"):
        raise InputError("there is no display; ./ignis echo CHANNEL and ./ignis hz work in a terminal")
    classpath = os.pathsep.join(part for part in (str(jar), os.environ.get("CLASSPATH", "")) if part)
    environment = {**os.environ, "CLASSPATH": classpath, "LCM_DEFAULT_URL": options.lcm_url}
    environment.setdefault("LCM_JVM_OPT", _HEAP)
    program = Path(lcm.LCM_BIN_DIR) / "lcm-spy"
    os.execve(program, [str(program), f"--lcm-url={options.lcm_url}"], environment)


if __name__ == "__main__":
    sys.exit(main())
