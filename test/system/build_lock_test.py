# SPDX-License-Identifier: Apache-2.0
"""Two `./ignis` that want to build at once, as when one terminal tests while another evaluates."""

import fcntl
import os
import subprocess
from pathlib import Path

CHECKOUT = Path(os.environ["IGNIS_CHECKOUT"])
BUILD = Path(os.environ["IGNIS_BUILD"])


def test_a_second_build_waits_for_the_first_and_says_so() -> None:
    with (BUILD / ".building").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        second = subprocess.Popen(
            [CHECKOUT / "ignis", "build", "applications"], stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        try:
            assert "Waiting for the other build" in second.stderr.readline()
            assert second.poll() is None
            fcntl.flock(lock, fcntl.LOCK_UN)
            assert second.wait(timeout=60) == 0
        finally:
            second.kill()
            second.wait()
