# SPDX-License-Identifier: Apache-2.0
"""What a process says on its error stream, taken without waiting and kept in part."""

import contextlib
import os
from typing import IO

_KEPT = 8192  # characters


class LastWords:
    """The end of what a process has said. One whose words nobody takes stands still in the end."""

    def __init__(self, stream: IO[str]) -> None:
        self._descriptor = stream.fileno()
        os.set_blocking(self._descriptor, False)
        self.text = ""

    def take(self) -> str:
        """Takes what has been said meanwhile; the end of all of it."""
        with contextlib.suppress(BlockingIOError):
            while words := os.read(self._descriptor, 4096):
                self.text = (self.text + words.decode(errors="replace"))[-_KEPT:]
        return self.text
