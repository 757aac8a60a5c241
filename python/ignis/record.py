# SPDX-License-Identifier: Apache-2.0
"""`./ignis record`: everything on the bus into a log, until Ctrl-C.

LCM's own logger writes; this command gives it the right bus, puts the configuration into the log (channel
IGNIS_CONFIG, at the start and every ten seconds), shows what arrives and how much disk is left, and warns when messages
are missing by their running numbers. When the logger dies, its file is removed, or the disk is nearly full or the
folder gone for a while, the recording goes on in FILE-2.lcmlog, FILE-3.lcmlog and so on.
"""

import argparse
import signal
import sys
import time
from pathlib import Path

from ignis.errors import EXIT_BAD_INPUT, EXIT_FAILURE, run_command
from ignis.log_config import CONFIG_CHANNEL
from ignis.recording import Recording

EXIT_MISSED = 3
_CONFIG_PERIOD_S = 10.0
_QUIET_AFTER_S = 3.0
_LOOK_PERIOD_S = 0.5
_LINE_PERIOD_S = 10.0


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./ignis record", description=__doc__.split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, help="log to write (default: ignis-DATE-TIME.lcmlog)")
    parser.add_argument(
        "--config", type=Path, help="the configuration that the processes run with; it goes into the log"
    )
    parser.add_argument("--lcm-url", help="bus (default: LCM_DEFAULT_URL, then lcm.url of the configuration)")
    parser.add_argument("--channels", default=".*", metavar="REGEX", help="channels to record (default: all)")
    parser.add_argument("--split-mb", type=float, metavar="N", help="begin a new file FILE.01, FILE.02, ... every N MB")
    parser.add_argument("--keep-free-mb", type=float, default=500.0, help="pause while the disk has less (500)")
    parser.add_argument("--seconds", type=float, help="end after so long instead of at Ctrl-C")
    parser.add_argument("--force", action="store_true", help="overwrite an existing log")
    return parser.parse_args(arguments)


def record(options: argparse.Namespace) -> int:
    """Records until Ctrl-C or --seconds."""
    recording = Recording(options)
    print(
        f"recording {recording.url} into {recording.file(0)}; {recording.free_mb() / 1e3:.1f} GB free; Ctrl-C ends it"
    )
    sys.stdout.flush()
    why = "interrupted"
    try:
        why = _watch(recording, options)
    except KeyboardInterrupt:
        pass
    finally:
        previous = signal.signal(signal.SIGINT, signal.SIG_IGN)  # A second Ctrl-C must not cost the end of the log.
        recording.stop()
        signal.signal(signal.SIGINT, previous)
    return _report(recording, why)


def _watch(recording: Recording, options: argparse.Namespace) -> str:
    began = time.monotonic()
    next_config, next_line, told_missed, told_quiet = began, began + _LOOK_PERIOD_S, 0, False
    terminal = sys.stderr.isatty()
    while options.seconds is None or time.monotonic() - began < options.seconds:
        if (news := recording.keep_going()) is not None:
            print(f"\nWARNING: {news}", file=sys.stderr, flush=True)
            next_config = time.monotonic() + _LOOK_PERIOD_S  # each file can be replayed alone
        now = time.monotonic()
        if now >= next_config and recording.tail.path.exists():
            recording.publish_config()
            next_config = now + (_CONFIG_PERIOD_S if CONFIG_CHANNEL in recording.tail.channels else _LOOK_PERIOD_S)
        recording.look()
        others = recording.tail.messages - _configs(recording)
        if others == 0 and not told_quiet and now - began > _QUIET_AFTER_S:
            told_quiet = True
            print(f"\nWARNING: nothing received on {recording.url}; is anything running on this bus?", file=sys.stderr)
        if recording.tail.missed > told_missed:
            told_missed = recording.tail.missed
            worst = max(recording.tail.channels.items(), key=lambda item: item[1].missed)
            print(f"\nWARNING: {told_missed} messages missed so far, most on {worst[0]}", file=sys.stderr)
        if now >= next_line:
            next_line = now + (1.0 if terminal else _LINE_PERIOD_S)
            print(_line(recording, now - began, terminal), end="" if terminal else "\n", file=sys.stderr, flush=True)
        time.sleep(_LOOK_PERIOD_S)
    return "the time is up"


def _configs(recording: Recording) -> int:
    count = recording.tail.channels.get(CONFIG_CHANNEL)
    return count.messages if count else 0


def _line(recording: Recording, seconds: float, terminal: bool) -> str:
    size = sum(path.stat().st_size for path in recording.files())
    rate = size / max(seconds, 1e-3)
    left = recording.free_mb() * 1e6 / rate / 3600.0 if rate > 0.0 else float("inf")
    text = (
        f"{seconds:.0f} s, {recording.tail.messages} messages on {len(recording.tail.channels)} channels, "
        f"{size / 1e6:.1f} MB ({rate / 1e6:.2f} MB/s), {recording.free_mb() / 1e3:.1f} GB free"
        f"{f' = {left:.0f} h' if left < 1000 else ''}, missed {recording.tail.missed}"
    )
    return f"\r\033[K{text}" if terminal else text


def _report(recording: Recording, why: str) -> int:
    tail = recording.tail
    print(f"\nended: {why}")
    print(f"  {'channel':24}{'messages':>10}{'Hz':>9}{'MB':>9}{'missed':>9}")
    for name, channel in sorted(tail.channels.items()):
        print(f"  {name:24}{channel.messages:10}{channel.rate_hz():9.1f}{channel.bytes / 1e6:9.2f}{channel.missed:9}")
    files = recording.files()
    size = sum(path.stat().st_size for path in files)
    print(f"wrote {', '.join(str(path) for path in files) or 'nothing'} ({size / 1e6:.1f} MB)")
    if tail.messages == _configs(recording):
        print("ignis: no message was received but our own configuration", file=sys.stderr)
        return EXIT_FAILURE
    if CONFIG_CHANNEL not in tail.channels:
        print("ignis: the configuration did not reach the log; give --config to the replay", file=sys.stderr)
    if recording.interruptions:
        print(f"ignis: the recording was interrupted: {'; '.join(recording.interruptions)}", file=sys.stderr)
    if tail.missed:
        print(
            f"ignis: {tail.missed} messages are missing by their running numbers; a replay equals the live run up to "
            "the first gap, which it names (larger socket buffers help: sysctl net.core.rmem_max=8388608)",
            file=sys.stderr,
        )
    return EXIT_MISSED if tail.missed or recording.interruptions else 0


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    options = _parse(sys.argv[1:] if arguments is None else arguments)
    if options.seconds is not None and not 0.0 < options.seconds < 1e7:
        print(f"ignis: --seconds {options.seconds:g}: allowed is more than 0", file=sys.stderr)
        return EXIT_BAD_INPUT
    return run_command(lambda: record(options))


if __name__ == "__main__":
    sys.exit(main())
