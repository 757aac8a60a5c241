# SPDX-License-Identifier: Apache-2.0
"""Servers for the tests of this folder."""

from collections.abc import Callable, Iterator

import pytest

from stream_server import Server, WebSocket


def servers() -> Iterator[Callable[..., Server]]:
    """Starts servers, and ends those that are left running: nobody else can start one on the same bus."""
    started: list[Server] = []

    def start(*arguments, **options) -> Server:
        started.append(Server(*arguments, **options))
        return started[-1]

    yield start
    for each in started:
        each.kill()


@pytest.fixture
def start_server() -> Iterator[Callable[..., Server]]:
    """Starts servers that end with the test, however it ends."""
    yield from servers()


@pytest.fixture(scope="module")
def start_shared_server() -> Iterator[Callable[..., Server]]:
    """Starts servers without a bus, that a whole file shares."""
    yield from servers()


@pytest.fixture(scope="module")
def stream_server(start_shared_server: Callable[..., Server]) -> Iterator[Server]:
    """A server for those that look at the stream's protocol."""
    running = start_shared_server("--port", "0")
    yield running
    assert running.stop() == 0


@pytest.fixture
def peer(stream_server: Server) -> Iterator[WebSocket]:
    """A WebSocket just opened."""
    status, web_socket = stream_server.upgrade()
    assert status == 101
    yield web_socket
    web_socket.close()
