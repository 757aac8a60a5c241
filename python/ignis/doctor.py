# SPDX-License-Identifier: Apache-2.0
"""`./ignis doctor`: looks at computer, bus, sensor, mount and live data. Each finding has the command that mends it.

Exit code: 0 nothing to do; 9 warnings only; 10 software, 11 host, 12 bus, 13 sensor, 14 mount, 15 data: the first part,
in this order, that has an error; 2 the configuration or the arguments are wrong.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

from ignis.doctoring.data import Heard, check_data, hear
from ignis.doctoring.finding import Finding, Severity, exit_code
from ignis.doctoring.host import check_host
from ignis.doctoring.mount import check_mount
from ignis.doctoring.network import check_bus, reaches_other_computers
from ignis.doctoring.sensor import check_sensor
from ignis.doctoring.software import check_software
from ignis.doctoring.synchronisation import check_synchronisation, read_kernel_clock
from ignis.errors import InputError, run_command
from ignis.mounts import effective_config
from ignis.places import default_config, program_folder, types_jar

_MARKS = {Severity.OK: "ok", Severity.NOTE: "note", Severity.WARNING: "WARNING", Severity.ERROR: "ERROR"}
_COLOURS = {Severity.OK: "32", Severity.NOTE: "36", Severity.WARNING: "33", Severity.ERROR: "31"}


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="ignis doctor", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--config", type=Path, default=default_config(), help="configuration file (default: %(default)s)"
    )
    parser.add_argument("--port", help="serial port instead of driver.port")
    parser.add_argument(
        "--seconds", type=float, default=4.0, help="how long to listen on the bus (default: %(default)s)"
    )
    parser.add_argument("--folder", type=Path, default=Path.cwd(), help="where recordings go (default: here)")
    parser.add_argument("--json", action="store_true", help="findings as one JSON object")
    options = parser.parse_args(arguments)
    if not 0.5 <= options.seconds <= 600.0:
        parser.error(f"--seconds {options.seconds}: 0.5 to 600")
    return run_command(lambda: _doctor(options))


def _doctor(options: argparse.Namespace) -> int:
    config = effective_config(options.config)
    findings = examine(config, options)
    code = exit_code(findings)
    if options.json:
        print(json.dumps({"exit_code": code, "findings": [finding.as_json() for finding in findings]}, indent=2))
    else:
        print(report(findings, colour=sys.stdout.isatty()))
    return code


def examine(config: dict[str, Any], options: argparse.Namespace) -> list[Finding]:
    """All findings. Listens first: who runs decides who may hold the port."""
    url = os.environ.get("LCM_DEFAULT_URL") or config["lcm"]["url"]
    try:
        heard = hear(url, options.seconds)
    except InputError:
        heard = Heard(seconds=options.seconds)  # the bus's own checks say why
    front_end = program_folder() / "lio_frontend"
    built = front_end.stat().st_mtime if front_end.exists() else 0.0
    return [
        *check_software(program_folder(), types_jar()),
        *check_host(Path("/"), options.folder, built),
        check_synchronisation(*read_kernel_clock(), several_computers=reaches_other_computers(url)),
        *check_bus(config, view_is_ours=heard.runs("map_builder")),
        *check_sensor(
            options.port or config["driver"]["port"], config["driver"]["baud"], driver_runs=heard.runs("l1_driver")
        ),
        *check_mount(config["extrinsics"]),
        *check_data(heard),
    ]


def report(findings: list[Finding], *, colour: bool = False) -> str:
    """The findings for a terminal."""
    lines = []
    for finding in findings:
        mark = f"{_MARKS[finding.severity]:<8}"
        if colour:
            mark = f"\033[{_COLOURS[finding.severity]}m{mark}\033[0m"
        lines.append(f"{mark}{finding.part:<9} {finding.check:<15} {finding.text}")
        if finding.fix and finding.severity != Severity.OK:
            lines.append(f"{'':<34}-> {finding.fix}")
    errors = sum(f.severity == Severity.ERROR for f in findings)
    warnings = sum(f.severity == Severity.WARNING for f in findings)
    return "\n".join([*lines, f"{errors} errors, {warnings} warnings"])


if __name__ == "__main__":
    sys.exit(main())
