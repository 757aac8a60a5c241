# SPDX-License-Identifier: Apache-2.0
"""A process whose main thread stands still, for a while or most of the time: what it computes takes so much longer,
while its other threads, among them LCM's receiver, go on."""

import contextlib
import ctypes
import os
import threading
import time
from collections.abc import Iterator

PTRACE_DETACH, PTRACE_SEIZE, PTRACE_INTERRUPT = 17, 0x4206, 0x4207


@contextlib.contextmanager
def stopped_main_thread(pid: int) -> Iterator[None]:
    """Stopped until the end. Nobody may ask meanwhile whether the process lives: the answer would be taken for ours."""
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


@contextlib.contextmanager
def slowed_main_thread(pid: int, work_s: float, pause_s: float) -> Iterator[None]:
    """Works for `work_s`, then stands still for `pause_s`, and so on until the end."""
    is_over = threading.Event()

    def slow_down() -> None:
        while not is_over.is_set():
            with stopped_main_thread(pid):
                is_over.wait(pause_s)
            time.sleep(work_s)

    thread = threading.Thread(target=slow_down)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join()
