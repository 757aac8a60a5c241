# SPDX-License-Identifier: Apache-2.0
"""A process that works on something for long, though nothing of it is frozen."""

import contextlib
import ctypes
import os
from collections.abc import Iterator

PTRACE_DETACH, PTRACE_SEIZE, PTRACE_INTERRUPT = 17, 0x4206, 0x4207


@contextlib.contextmanager
def stopped_main_thread(pid: int) -> Iterator[None]:
    """The thread that handles messages stands still; the others, among them LCM's receiver, go on."""
    libc = ctypes.CDLL(None, use_errno=True)
    libc.ptrace.argtypes = [ctypes.c_long] * 4

    def trace(request: int) -> None:
        assert libc.ptrace(request, pid, 0, 0) == 0, os.strerror(ctypes.get_errno())

    trace(PTRACE_SEIZE)
    trace(PTRACE_INTERRUPT)
    os.waitpid(pid, 0)
    try:
        yield
    finally:
        trace(PTRACE_DETACH)
