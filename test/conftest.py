# SPDX-License-Identifier: Apache-2.0
"""Shared by all Python tests: where the checkout, the build and the recordings are, and a network of our own."""

import gc
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[1]
os.environ.setdefault("IGNIS_CHECKOUT", str(CHECKOUT))
# Started in the background of a script, Ctrl-C is ignored, and every process that a test starts would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files that enter a private network come last: there is no way back to the packages that others install."""
    entering = {item.path for item in items if "private_network" in getattr(item, "fixturenames", ())}
    items.sort(key=lambda item: item.path in entering)


@pytest.fixture(scope="session")
def private_network() -> None:
    """From here on this process and its children live in a network namespace of their own."""
    from ignis.pipeline import enter_private_network

    enter_private_network()


@pytest.fixture(autouse=True, scope="module")
def no_listener_left() -> Iterator[None]:
    """A bus that a file opened reads on in a thread of its own until Python collects it."""
    yield
    gc.collect()


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
