# SPDX-License-Identifier: Apache-2.0
"""`./ignis status`: a live table of all processes and channels, from HEALTH and from the bus itself.

Exit code with --once: 0 all processes are OK; 1 one is missing, or not OK, or they disagree about the configuration.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

from ignis.bus import Listener, default_url
from ignis.doctoring.data import PROCESSES
from ignis.errors import EXIT_FAILURE, run_command
from ignis.hz import rate_table

STATES = {0: "OK", 1: "DEGRADED", 2: "LOST", 3: "FAULT"}
_COLOURS = {"OK": "32", "DEGRADED": "33", "LOST": "31", "FAULT": "31", "GONE": "31", "-": "2"}
_GONE_AFTER_S = 3.0
_FORGOTTEN_AFTER_S = 30.0


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="ignis status", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--once", action="store_true", help="listen a moment, print the table once and end")
    parser.add_argument("--seconds", type=float, default=2.5, help="with --once: how long (default: %(default)s)")
    parser.add_argument("--lcm-url", default=default_url(), help="the bus (default: %(default)s)")
    options = parser.parse_args(arguments)
    return run_command(lambda: _status(options))


def _status(options: argparse.Namespace) -> int:
    listener = Listener(options.lcm_url)
    if options.once:
        listener.listen(options.seconds)
        print(page(listener, colour=sys.stdout.isatty()))
        return 0 if all_well(listener) else EXIT_FAILURE
    try:
        while True:
            listener.listen(1.0)
            print("\033[H\033[2J" + page(listener, colour=True), flush=True)
    except KeyboardInterrupt:
        return 0


def newest_health(listener: Listener) -> list[tuple[float, Any]]:
    """Age [s] and HEALTH of each process, our own in the order of the data; forgotten ones are left out.

    A process that was started anew replaces its predecessor; two that speak at the same time are both shown.
    """
    now = time.monotonic()
    alive = [(now - at, message) for at, message in listener.health.values() if now - at < _FORGOTTEN_AFTER_S]
    speaking = {message.process for age, message in alive if age < _GONE_AFTER_S}
    kept = [(age, m) for age, m in alive if age < _GONE_AFTER_S or m.process not in speaking]
    order = {name: place for place, name in enumerate(PROCESSES)}
    return sorted(kept, key=lambda entry: (order.get(entry[1].process, len(order)), entry[1].process, entry[1].pid))


def disagreements(listener: Listener) -> list[str]:
    """What the living processes do not agree about. Tools, such as the recorder, say neither."""
    alive = [message for age, message in newest_health(listener) if age < _GONE_AFTER_S]
    lines = []
    for what, name in (("config_hash", "configuration"), ("version", "version")):
        said = [message for message in alive if getattr(message, what)]
        if len({getattr(message, what) for message in said}) > 1:
            each = ", ".join(f"{message.process} {getattr(message, what)}" for message in said)
            lines.append(f"ERROR: processes disagree about the {name}: {each}")
    return lines


def all_well(listener: Listener) -> bool:
    """Every process of the pipeline is there and OK, and all agree."""
    alive = {message.process: message for age, message in newest_health(listener) if age < _GONE_AFTER_S}
    return all(name in alive and alive[name].state == 0 for name in PROCESSES) and not disagreements(listener)


def page(listener: Listener, *, colour: bool) -> str:
    """The whole table."""
    lines = [
        f"{'process':<15} {'pid':>7} {'state':<9} {'up':>7} {'CPU %':>11} {'MB':>11} {'latency ms':>13} {'lost':>6} "
        f"{'resets':>6} {'configuration':<17} reason"
    ]
    seen = set()
    for age, message in newest_health(listener):
        seen.add(message.process)
        lines.append(_process_line(age, message, colour=colour))
    lines += [f"{name:<15} {'-':>7} {_coloured('-', colour)}" for name in PROCESSES if name not in seen]
    lines += disagreements(listener)
    return "\n".join([*lines, "", rate_table(listener) if listener.channels else "nothing on the bus"])


def _process_line(age: float, message: Any, *, colour: bool) -> str:
    state = STATES.get(message.state, "?") if age < _GONE_AFTER_S else "GONE"
    reason = message.state_text if state != "GONE" else f"silent for {age:.0f} s; last: {message.state_text}"
    return (
        f"{message.process:<15} {message.pid:>7} {_coloured(state, colour)} {_duration(message.uptime_s):>7} "
        f"{_of(message.cpu_percent, message.cpu_limit_percent):>11} "
        f"{_of(message.memory_mb, message.memory_limit_mb):>11} "
        f"{_of(message.latency_ms, message.latency_limit_ms):>13} {sum(message.lost):>6} {message.resets:>6} "
        f"{message.config_hash:<17} {reason}"
    )


def _of(value: float, limit: float) -> str:
    return f"{value:.0f} of {limit:.0f}" if limit > 0 else f"{value:.0f}"


def _coloured(state: str, colour: bool) -> str:
    return f"\033[{_COLOURS.get(state, '0')}m{state:<9}\033[0m" if colour else f"{state:<9}"


def _duration(seconds: float) -> str:
    whole = int(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02}:{whole % 60:02}"


if __name__ == "__main__":
    sys.exit(main())
