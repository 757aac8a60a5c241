# SPDX-License-Identifier: Apache-2.0
"""Servers for the tests of this folder."""

import pytest

from stream_server import Server


@pytest.fixture(scope="session")
def start_server():
    """Starts servers; those that a test leaves running are ended with the session."""
    started = []

    def start(*arguments, **options):
        started.append(Server(*arguments, **options))
        return started[-1]

    yield start
    for each in started:
        if each.process.poll() is None:
            each.process.kill()
            each.process.wait()


@pytest.fixture(scope="module")
def stream_server(start_server):
    """A server without a bus, for those that look at the stream's protocol."""
    running = start_server("--port", "0")
    yield running
    assert running.stop() == 0


@pytest.fixture
def peer(stream_server):
    """A WebSocket just opened."""
    status, web_socket = stream_server.upgrade()
    assert status == 101
    yield web_socket
    web_socket.close()
