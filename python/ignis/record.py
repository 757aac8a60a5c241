# SPDX-License-Identifier: Apache-2.0
"""`./ignis record`: everything on the bus into a log, until Ctrl-C.

LCM's own logger writes; this command gives it the right bus, puts the configuration into the log (channel
IGNIS_CONFIG, at the start and every ten seconds), shows what arrives and how much disk is left, and warns when messages
are missing by their running numbers.
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from datetime import datetime
from pathlib import Path

import lcm

from ignis.errors import EXIT_BAD_INPUT, EXIT_FAILURE, InputError, run_command
from ignis.log_config import CONFIG_CHANNEL, encoded
from ignis.log_tail import LogTail
from ignis.mounts import effective_config
from ignis.pipeline import program

EXIT_MISSED = 3
_CONFIG_PERIOD_S = 10.0
_QUIET_AFTER_S = 3.0
_LOOK_PERIOD_S = 0.5
_LINE_PERIOD_S = 10.0
_STOP_S = 10.0
_DEFAULT_CONFIG = Path("config") / "ignis8_tuned.json"


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./ignis record", description=__doc__.split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, help="log to write (default: ignis-DATE-TIME.lcmlog)")
    parser.add_argument(
        "--config", type=Path, help="the configuration that the processes run with; it goes into the log"
    )
    parser.add_argument("--lcm-url", help="bus (default: LCM_DEFAULT_URL, then lcm.url of the configuration)")
    parser.add_argument("--channels", default=".*", metavar="REGEX", help="channels to record (default: all)")
    parser.add_argument("--split-mb", type=float, metavar="N", help="begin a new file FILE.01, FILE.02, ... every N MB")
    parser.add_argument("--keep-free-mb", type=float, default=500.0, help="end cleanly when the disk has less (500)")
    parser.add_argument("--seconds", type=float, help="end after so long instead of at Ctrl-C")
    parser.add_argument("--force", action="store_true", help="overwrite an existing log")
    return parser.parse_args(arguments)


class Recording:
    """One run of the logger and what is known about it."""

    def __init__(self, options: argparse.Namespace) -> None:
        checkout = Path(os.environ.get("IGNIS_CHECKOUT", "."))
        self._options = options
        self.config = effective_config(options.config or checkout / _DEFAULT_CONFIG)
        default_url = os.environ.get("LCM_DEFAULT_URL") or self.config.get("lcm", {}).get("url", "")
        self.url: str = options.lcm_url or default_url
        self.output: Path = options.output or Path(f"ignis-{datetime.now():%Y%m%d-%H%M%S}.lcmlog")
        self._refuse_what_cannot_work()
        self.tail = LogTail(self.file(0))
        self._number = 0
        self._bus = self._open_bus()
        self.logger = subprocess.Popen(
            self._command(), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            start_new_session=True,
        )  # fmt: skip

    def _refuse_what_cannot_work(self) -> None:
        options = self._options
        try:
            re.compile(options.channels)
        except re.error as error:
            raise InputError(f"--channels {options.channels}: not a regular expression: {error}") from None
        if options.split_mb is not None and not 1.0 <= options.split_mb <= 1e6:
            raise InputError(f"--split-mb {options.split_mb:g}: allowed is 1 to 1000000 (the logger counts whole MB)")
        if not self.output.parent.is_dir():
            raise InputError(f"the folder {self.output.parent} does not exist; make it first")
        existing = [path for path in (self.output, self.file(0)) if path.exists()]
        if existing and not options.force:
            raise InputError(f"{existing[0]} exists; choose another name with -o, or --force to overwrite it")
        if self.output.is_dir():
            raise InputError(f"{self.output} is a folder; give the name of a file to write")
        if existing and options.split_mb is not None:
            raise InputError(f"{existing[0]} exists, and split recordings never overwrite; choose another name with -o")
        if self.free_mb() < options.keep_free_mb:
            raise InputError(f"only {self.free_mb():.0f} MB are free; --keep-free-mb is {options.keep_free_mb:.0f}")

    def _open_bus(self) -> lcm.LCM:
        try:
            return lcm.LCM(self.url)
        except RuntimeError:
            raise InputError(
                f"cannot open the message bus {self.url}. If multicast has no route, run: sudo ip link set lo up "
                "multicast on && sudo ip route add 224.0.0.0/4 dev lo"
            ) from None

    def _command(self) -> list[str]:
        options = self._options
        quota = f"--disk-quota={max(options.keep_free_mb / 2.0, 1.0):.0f}M"
        command = [str(program("lcm-logger")), "--quiet", "--lcm-url", self.url, "--channel", options.channels, quota]
        if CONFIG_CHANNEL not in options.channels and options.channels != ".*":
            command[command.index(options.channels)] = f"({options.channels})|{CONFIG_CHANNEL}"
        if options.split_mb is not None:
            # The long form, --increment, swallows the next argument (LCM 1.5.3).
            command += ["-i", f"--split-mb={options.split_mb:g}"]
        elif options.force:
            command.append("--force")
        return [*command, str(self.output)]

    def file(self, number: int) -> Path:
        """The files of a recording that is split are numbered by the logger."""
        return (
            self.output if self._options.split_mb is None else self.output.with_name(f"{self.output.name}.{number:02d}")
        )

    def free_mb(self) -> float:
        return shutil.disk_usage(self.output.resolve().parent).free / 1e6

    def publish_config(self) -> None:
        self._bus.publish(CONFIG_CHANNEL, encoded(self.config))

    def look(self) -> None:
        """Reads what has come, over the border of a split file too."""
        self.tail.update()
        while self._options.split_mb is not None and self.file(self._number + 1).exists():
            self.tail.update()
            self._number += 1
            self.tail.follow(self.file(self._number))
            self.tail.update()
            self.publish_config()  # Each file can be replayed alone.

    def files(self) -> list[Path]:
        return [self.file(number) for number in range(self._number + 1) if self.file(number).exists()]

    def stop(self) -> None:
        """Lets the logger write its last records."""
        if self.logger.poll() is None:
            self.logger.send_signal(signal.SIGINT)
            try:
                self.logger.wait(_STOP_S)
            except subprocess.TimeoutExpired:
                self.logger.kill()
                self.logger.wait()
        self.look()
        self.tail.close()


def record(options: argparse.Namespace) -> int:
    """Records until Ctrl-C, --seconds, or until the disk is nearly full."""
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
        if recording.logger.poll() is not None:
            said = (recording.logger.stderr.read() if recording.logger.stderr else "").strip().splitlines()
            raise InputError(
                f"lcm-logger ended with code {recording.logger.returncode}: {(said or ['no message'])[-1]}"
            )
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
        if recording.free_mb() < options.keep_free_mb:
            return f"the disk has less than {options.keep_free_mb:.0f} MB left"
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
    if tail.missed:
        print(
            f"ignis: {tail.missed} messages are missing by their running numbers; a replay equals the live run up to "
            "the first gap, which it names (larger socket buffers help: sysctl net.core.rmem_max=8388608)",
            file=sys.stderr,
        )
        return EXIT_MISSED
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    options = _parse(sys.argv[1:] if arguments is None else arguments)
    if options.seconds is not None and not 0.0 < options.seconds < 1e7:
        print(f"ignis: --seconds {options.seconds:g}: allowed is more than 0", file=sys.stderr)
        return EXIT_BAD_INPUT
    return run_command(lambda: record(options))


if __name__ == "__main__":
    sys.exit(main())
