# SPDX-License-Identifier: Apache-2.0
"""`./ignis hz`: which channels there are, how often they speak, how much they carry and what was lost."""

from __future__ import annotations

import argparse
import sys
import time

from ignis.bus import Listener, default_url
from ignis.errors import EXIT_FAILURE, run_command


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="ignis hz", description="Rates of all channels.")
    parser.add_argument("--channel", default=".*", help="regular expression over whole names (default: all)")
    parser.add_argument("--seconds", type=float, default=5.0, help="how long to listen (default: %(default)s)")
    parser.add_argument("--lcm-url", default=default_url(), help="the bus (default: %(default)s)")
    options = parser.parse_args(arguments)
    return run_command(lambda: _hz(options))


def _hz(options: argparse.Namespace) -> int:
    listener = Listener(options.lcm_url, options.channel)
    listener.listen(options.seconds)
    if not listener.channels:
        print(f"ignis: nothing on {options.lcm_url} within {options.seconds:g} s", file=sys.stderr)
        return EXIT_FAILURE
    print(rate_table(listener))
    return 0


def rate_table(listener: Listener) -> str:
    """One line a channel."""
    now, listened = time.monotonic(), listener.listened_s
    lines = [f"{'channel':<20} {'type':<22} {'Hz':>7} {'kB/s':>8} {'lost':>6} {'age s':>6}"]
    for name, count in sorted(listener.channels.items()):
        rate, bandwidth = count.rate(now, listened)
        kind = count.kind if count.undecodable == 0 else f"{count.kind}, {count.undecodable} foreign"
        lines.append(
            f"{name:<20} {kind:<22} {rate:>7.1f} {bandwidth / 1000:>8.1f} {count.lost:>6} {now - count.last_at:>6.1f}"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
