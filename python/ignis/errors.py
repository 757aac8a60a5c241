# SPDX-License-Identifier: Apache-2.0
"""How commands fail: one clear sentence on stderr and an exit code, never a traceback for what a user can cause."""

import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from typing import Any

EXIT_FAILURE = 1
EXIT_BAD_INPUT = 2
EXIT_DAMAGED = 3  # of a program that finished, though some of its input was damaged or lost
EXIT_INTERRUPTED = 130


class InputError(Exception):
    """A file, argument or configuration is wrong; the text says what to do about it."""


def run_command(body: Callable[[], int | None]) -> int:
    """Runs a command's body and turns what went wrong into a message and an exit code."""
    # SIGTERM unwinds like Ctrl-C, so that temporary files are removed in both cases.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return body() or 0
    except InputError as error:
        print(f"ignis: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print("ignis: interrupted; no unfinished file was kept", file=sys.stderr)
        return EXIT_INTERRUPTED
    except OSError as error:
        print(f"ignis: {error.filename or 'input or output'}: {error.strerror or error}", file=sys.stderr)
        return EXIT_FAILURE


def run_quietly(command: Sequence[Any], allowed: Sequence[int] = (0,)) -> None:
    """Runs a program whose output matters only when it fails; then its last line becomes the message."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode not in allowed:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise InputError(f"{command[0]} ended with code {done.returncode}: {last}")
