# SPDX-License-Identifier: Apache-2.0
"""A recording in progress: LCM's own logger, kept going over a full disk and its own death."""

import argparse
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
from datetime import datetime
from pathlib import Path

from ignis_lcm.ignis import health_t

from ignis.bus import open_bus
from ignis.errors import InputError
from ignis.growing_pause import GrowingPause
from ignis.last_words import LastWords
from ignis.log_config import CONFIG_CHANNEL, encoded
from ignis.log_tail import LogTail
from ignis.mounts import effective_config
from ignis.pipeline import program

_STOP_S = 10.0
_STOP_LOOK_S = 0.05
_LEAST_LIFE_S = 2.0  # of a logger that is worth starting again
_HEALTH_PERIOD_S = 1.0
_ROOM_AGAIN = 1.2  # of --keep-free-mb
_FLUSH_MS = 50  # that a killed logger may cost; LCM's default is 100
_REFUSED = "lcm_eventlog_write_event: "  # the logger says so and goes on with the next message
_DEFAULT_CONFIG = Path("config") / "ignis8_tuned.json"


def refusal_by(folder: Path) -> str:
    """Why nothing can be written into a folder; empty when it can. Leaves nothing behind."""
    try:
        with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
            file.write(b"?")
            os.fsync(file.fileno())
    except OSError as error:
        return os.strerror(error.errno or 0)
    return ""


def default_name(now: datetime) -> Path:
    """A name that no file has: a clock that is set back, or without a clock chip, gives the same instant twice."""
    name = first = Path(f"ignis-{now:%Y%m%d-%H%M%S}.lcmlog")
    part = 2
    while list(name.parent.glob(f"{name.name}*")):
        name = _numbered(first, part)
        part += 1
    return name


def _numbered(first: Path, part: int) -> Path:
    return first.with_name(f"{first.stem}-{part}{first.suffix}")


class Recording:
    """What is recorded into one file after another, and what is known about it.

    A new file begins when the logger was killed, when the file was removed, when a disk that was nearly full has room
    again, when one that refused to be written to takes data again, and when a folder that was gone is back: what was
    written is left as it is. A disk that refuses again and again is tried ever later. While the disk is too full or
    refuses, or the folder is gone, HEALTH says FAULT; a logger that was killed is succeeded at once, a successor that
    ended at once after two seconds. HEALTH says OK once a successor has lived that long.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        checkout = Path(os.environ.get("IGNIS_CHECKOUT", "."))
        self._options = options
        self.config = effective_config(options.config or checkout / _DEFAULT_CONFIG)
        default_url = os.environ.get("LCM_DEFAULT_URL") or self.config.get("lcm", {}).get("url", "")
        self.url: str = options.lcm_url or default_url
        name = options.output or default_name(datetime.now())
        self.output: Path = name.absolute()  # of a working folder that is removed nothing else would lead back
        self.folder = self.output.resolve().parent
        self._refuse_what_cannot_work()
        self.tail = LogTail(self.file(0))
        self.paused = False
        self.interruptions: list[str] = []
        self._first = self.output
        self._finished: list[Path] = []
        self._pause = GrowingPause()  # of a disk that refuses
        self._full = False
        self._number = 0
        self._health_sequence = 0
        self._told: tuple[int, str] | None = None
        self._told_at = 0.0
        self._bus = open_bus(self.url)
        self._start_logger()

    def _start_logger(self) -> None:
        self._started = time.monotonic()
        self._refused = False  # the disk did not take what the logger wrote
        self.logger = subprocess.Popen(
            self._command(), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            start_new_session=True,
        )  # fmt: skip
        assert self.logger.stderr is not None
        self._words = LastWords(self.logger.stderr)

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
        if refusal := refusal_by(self.folder):
            raise InputError(f"cannot write into {self.folder}: {refusal} ({self.free_mb():.0f} MB are free there)")
        if self.free_mb() < options.keep_free_mb:
            room = f"only {self.free_mb():.0f} MB are free in {self.folder}"
            raise InputError(f"{room}; --keep-free-mb is {options.keep_free_mb:.0f}")

    def _command(self) -> list[str]:
        options = self._options
        quota = f"--disk-quota={max(options.keep_free_mb / 2.0, 1.0):.0f}M"
        command = [str(program("lcm-logger")), "--quiet", "--lcm-url", self.url, "--channel", options.channels, quota]
        command.append(f"--flush-interval={_FLUSH_MS}")
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
        """What the disk has left; 0 while the folder is gone."""
        try:
            return shutil.disk_usage(self.folder).free / 1e6
        except OSError:  # gone, or the card was pulled
            return 0.0

    def publish_config(self) -> None:
        self._bus.publish(CONFIG_CHANNEL, encoded(self.config))

    def look(self) -> None:
        """Reads what has come, over the border of a split file too."""
        if self.paused:
            return
        self.tail.update()
        while self._options.split_mb is not None and self.file(self._number + 1).exists():
            self.tail.update()
            self._number += 1
            self.tail.follow(self.file(self._number))
            self.tail.update()
            self.publish_config()  # Each file can be replayed alone.

    def files(self) -> list[Path]:
        """All that hold a part of the recording, in their order."""
        current = [self.file(number) for number in range(self._number + 1)]
        return [path for path in [*self._finished, *current] if path.exists()]

    def keep_going(self) -> str | None:
        """Pauses while the disk is nearly full or the folder is gone; starts a logger anew that ended or lost its file.

        Returns what happened, for people; nothing as long as all is as it was.
        """
        obstacle = self._obstacle()
        if self.paused:
            if obstacle is not None:
                self._tell(health_t.FAULT, f"recording paused: {obstacle}")
                return None
            self._begin_next_file()
            self.paused = False
            self._tell_that_it_goes_on()
            return f"the disk takes data again; recording goes on in {self.file(0)}"
        if obstacle is not None:
            self._tell(health_t.FAULT, f"recording paused: {obstacle}")
            self._end_logger()
            # Whoever makes room by removing the file must get it.
            self.tail.close()
            self.paused = True
            self.interruptions.append(obstacle)
            return f"{obstacle}: paused until that has changed"
        self.look()  # a split recording may have gone on, and its last part have been taken away
        if self.tail.is_lost():
            self._end_logger()
            return self._interrupted(f"{self.tail.path} was removed")
        if (code := self.logger.poll()) is None:
            self._tell_of_the_successor()
            return None
        if self.interruptions and time.monotonic() - self._started < _LEAST_LIFE_S:
            # A successor that ended at once is followed too, but not in a rush.
            self._tell(health_t.FAULT, f"recording stands still: lcm-logger ended at once with code {code}")
            return None
        return self._succeed_logger()

    def _obstacle(self) -> str | None:
        """Why nothing can be recorded now; a disk that was too full needs some room to spare."""
        keep = self._options.keep_free_mb
        if not self.folder.is_dir():
            return f"the folder {self.folder} is gone"
        if not self.paused:
            self._note_refusal()
        self._full = self.free_mb() < keep * (_ROOM_AGAIN if self._full else 1.0)
        if self._full:
            return f"the disk has less than {keep:.0f} MB left"
        if self._refused and (refusal := self._refusal()):
            return f"the disk of {self.folder} takes no data: {refusal}"
        return None

    def _note_refusal(self) -> None:
        refused = _REFUSED in self._words.take()
        if refused and not self._refused:
            self._pause.failed_after(time.monotonic() - self._started)
        self._refused = self._refused or refused

    def _refusal(self) -> str:
        """Why the disk took nothing of what the logger wrote; empty when a new one is worth a try."""
        if self.paused and time.monotonic() - self._started >= self._pause.seconds:
            return refusal_by(self.folder)
        return self._words.text.rpartition(_REFUSED)[2].partition("\n")[0] or "no reason was given"

    def _succeed_logger(self) -> str:
        """The logger has ended on its own. When it was the first one and ended at once, it cannot work at all."""
        code = self.logger.returncode
        said = self._words.take().strip().splitlines()
        if not self.interruptions and time.monotonic() - self._started < _LEAST_LIFE_S:
            raise InputError(f"lcm-logger ended with code {code}: {(said or ['no message'])[-1]}")
        return self._interrupted(f"lcm-logger ended with code {code}")

    def _interrupted(self, why: str) -> str:
        self.interruptions.append(why)
        self._begin_next_file()
        return f"{why}; recording goes on in {self.file(0)}"

    def _begin_next_file(self) -> None:
        """FILE-2.lcmlog, FILE-3.lcmlog, ...: the next one that does not exist."""
        self.look()
        self._finished = self.files()
        self._number, part = 0, 2
        while True:
            self.output = _numbered(self._first, part)
            if not self.output.exists() and not self.file(0).exists():
                break
            part += 1
        self.tail.follow(self.file(0))
        self._start_logger()

    def _tell_of_the_successor(self) -> None:
        """One that ends at once again is no recovery: HEALTH would go to and fro between OK and FAULT."""
        if self.interruptions and time.monotonic() - self._started >= _LEAST_LIFE_S:
            self._tell_that_it_goes_on()
        elif self._told is not None:
            self._tell(*self._told)

    def _tell_that_it_goes_on(self) -> None:
        self._tell(health_t.OK, f"recording goes on in {self.file(0).name}")

    def _tell(self, state: int, text: str) -> None:
        """What the status page shows of the recording; in good times nothing, since it would be recorded as well.

        Once there was something to say it is said every second: who has spoken and is silent counts as gone.
        """
        now = time.monotonic()
        if (state, text) == self._told and now - self._told_at < _HEALTH_PERIOD_S:
            return
        self._told, self._told_at = (state, text), now
        message = health_t()
        message.process, message.pid, message.state, message.state_text = "ignis_record", os.getpid(), state, text
        message.sequence = self._health_sequence
        self._health_sequence += 1
        self._bus.publish("HEALTH", message.encode())

    def stop(self) -> None:
        """Lets the logger write its last records."""
        if not self.paused:
            self._end_logger()
        self.tail.close()

    def _end_logger(self) -> None:
        if self.logger.poll() is None:
            self.logger.send_signal(signal.SIGINT)
            end = time.monotonic() + _STOP_S
            while self.logger.poll() is None and time.monotonic() < end:
                self._words.take()
                if self._told is not None:
                    self._tell(*self._told)
                time.sleep(_STOP_LOOK_S)
            self.logger.kill()
            self.logger.wait()
        self.look()
