# SPDX-License-Identifier: Apache-2.0
"""`./ignis echo CHANNEL`: prints messages, for machines without a display."""

from __future__ import annotations

import argparse
import json
import re
import sys
import time
from typing import Any

from ignis.bus import Listener, default_url
from ignis.errors import EXIT_FAILURE, InputError, run_command

_SHOWN = 8  # elements of an array


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="ignis echo", description="Prints the messages of a channel.")
    parser.add_argument("channel", help="name, or a regular expression over whole names")
    parser.add_argument("-n", "--count", type=int, default=0, help="end after so many messages (default: never)")
    parser.add_argument("--seconds", type=float, default=0.0, help="end after so many seconds (default: never)")
    parser.add_argument("--full", action="store_true", help=f"arrays in full, not only the first {_SHOWN} elements")
    parser.add_argument("--json", action="store_true", help="one JSON object a line")
    parser.add_argument("--lcm-url", default=default_url(), help="the bus (default: %(default)s)")
    options = parser.parse_args(arguments)
    try:
        re.compile(options.channel)
    except re.error as error:
        parser.error(f"channel {options.channel!r} is no regular expression: {error}")
    return run_command(lambda: _echo(options))


def _echo(options: argparse.Namespace) -> int:
    shown = 0

    def show(channel: str, message: Any) -> None:
        nonlocal shown
        if options.count and shown >= options.count:
            return
        shown += 1
        fields = as_dict(message, full=options.full)
        if options.json:
            print(json.dumps({"channel": channel, **fields}), flush=True)
        else:
            print(f"{channel} {type(message).__name__}\n{as_text(fields)}", flush=True)

    listener = Listener(options.lcm_url, options.channel, show)
    deadline = time.monotonic() + options.seconds if options.seconds else float("inf")
    try:
        while (not options.count or shown < options.count) and time.monotonic() < deadline:
            listener.listen(min(0.2, max(deadline - time.monotonic(), 0.01)))
    except KeyboardInterrupt:
        return 0
    if shown:
        return 0
    if undecodable := sum(count.undecodable for count in listener.channels.values()):
        raise InputError(f"{undecodable} messages on {options.channel} are of a type or version that is not ours")
    print(f"ignis: nothing on {options.channel}; ./ignis hz lists the channels", file=sys.stderr)
    return EXIT_FAILURE


def as_dict(message: Any, *, full: bool) -> dict[str, Any]:
    """Fields of a message; long arrays are cut unless `full`."""
    fields: dict[str, Any] = {}
    for name in message.__slots__:
        value = getattr(message, name)
        if isinstance(value, bytes):
            value = list(value)
        if isinstance(value, (list, tuple)):
            value = list(value)
            if not full and len(value) > _SHOWN:
                value = [*value[:_SHOWN], f"... {len(value)} in all"]
        fields[name] = value
    return fields


def as_text(fields: dict[str, Any]) -> str:
    """One field a line."""
    return "\n".join(f"  {name:<22} {_value(value)}" for name, value in fields.items())


def _value(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    return str(value)


if __name__ == "__main__":
    sys.exit(main())
