# SPDX-License-Identifier: Apache-2.0
"""Shared by all Python tests: where the checkout, the build and the recordings are, and a network of our own."""

import os
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[1]
os.environ.setdefault("IGNIS_CHECKOUT", str(CHECKOUT))
# Started in the background of a script, Ctrl-C is ignored, and every process that a test starts would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def private_network() -> None:
    """From here on this process and its children live in a network namespace of their own."""
    from ignis.pipeline import enter_private_network

    enter_private_network()


@pytest.fixture
def run_binary() -> Callable[..., subprocess.CompletedProcess]:
    """Runs one of the built executables to its end."""
    from ignis.pipeline import binary

    def run(name: str, *arguments: object, seconds: float = 30.0, **environment: str) -> subprocess.CompletedProcess:
        return subprocess.run(
            [binary(name), *map(str, arguments)],
            capture_output=True,
            text=True,
            timeout=seconds,
            env={**os.environ, **environment},
        )

    return run
