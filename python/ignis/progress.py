# SPDX-License-Identifier: Apache-2.0
"""One line of progress: rewritten in place on a terminal, a new line every 20 % in a log."""

import sys
import time

_REFRESH_S = 0.2


class Progress:
    """Shows how much of a long job is done; silent for jobs below a second."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._began = time.monotonic()
        self._shown_at = self._began + 1.0 - _REFRESH_S
        self._shown_percent = 0
        self._on_terminal = sys.stderr.isatty()
        self._open_line = False

    def update(self, fraction: float, detail: str = "") -> None:
        """Tells that `fraction` (0..1) of the job is done."""
        now = time.monotonic()
        percent = int(100 * min(max(fraction, 0.0), 1.0))
        if now - self._shown_at < _REFRESH_S:
            return
        if not self._on_terminal and percent < self._shown_percent + 20:
            return
        self._shown_at, self._shown_percent = now, percent
        text = f"ignis: {self._title}: {percent:3d} %, {now - self._began:.0f} s {detail}"
        if self._on_terminal:
            print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)
            self._open_line = True
        else:
            print(text, file=sys.stderr, flush=True)

    def close(self) -> None:
        """Ends the line on a terminal."""
        if self._open_line:
            print(file=sys.stderr)
            self._open_line = False
