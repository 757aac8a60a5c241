# SPDX-License-Identifier: Apache-2.0
"""Row W2: a thousand connections at once, and handshakes at one byte a second, from one client."""

import asyncio
import contextlib
import resource
import time
from dataclasses import dataclass

import pytest

from stream_client import PROTOCOL

CROWD = 1000
PLACES = 32  # hmi.max_clients as shipped
SPARE = 16  # connections beside the viewers; slow ones have no other
HANDSHAKE_S = 5.0
AT_ONCE_S = 4.0  # on a busy machine; nobody may wait until a slow handshake runs out
KEY = "MDEyMzQ1Njc4OWFiY2RlZg=="


@dataclass
class Visit:
    """What came of one connection."""

    status: int
    seconds: float
    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter


def upgrade_request(port):
    lines = [
        "GET /ws/lio_map HTTP/1.1",
        f"Host: 127.0.0.1:{port}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Version: 13",
        f"Sec-WebSocket-Key: {KEY}",
        f"Sec-WebSocket-Protocol: {PROTOCOL}",
    ]
    return "\r\n".join(lines).encode() + b"\r\n\r\n"


async def visit(port):
    began = time.monotonic()
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(upgrade_request(port))
    head = await reader.readuntil(b"\r\n\r\n")
    return Visit(int(head.split()[1]), time.monotonic() - began, reader, writer)


async def dawdle(port):
    """The same at one byte a second; how long the server puts up with it."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    began = time.monotonic()
    for byte in upgrade_request(port):
        with contextlib.suppress(ConnectionError):
            writer.write(bytes([byte]))
        with contextlib.suppress(TimeoutError):
            answer = await asyncio.wait_for(reader.read(1), 1.0)
            assert answer == b"", "no answer to half a request"
            break
    writer.close()
    return time.monotonic() - began


async def status_of_number_33(port):
    """Once the server has noticed that a place is free."""
    deadline = time.monotonic() + 5.0
    while (status := (await visit(port)).status) == 503 and time.monotonic() < deadline:
        await asyncio.sleep(0.05)
    return status


async def crowd(port):
    slow = [asyncio.create_task(dawdle(port)) for _ in range(SPARE)]
    await asyncio.sleep(0.3)
    began = time.monotonic()
    visits = await asyncio.gather(*(visit(port) for _ in range(CROWD)))
    seconds = time.monotonic() - began
    served = [each for each in visits if each.status == 101]
    hellos = await asyncio.gather(*(each.reader.readuntil(b'"type":"hello"') for each in served))
    patience = await asyncio.gather(*slow)
    full = (await visit(port)).status
    served[0].writer.close()
    return visits, len(hellos), seconds, patience, full, await status_of_number_33(port)


@pytest.fixture
def many_descriptors():
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(before[0], min(4 * CROWD, before[1])), before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, before)


def test_fault_w2_of_a_thousand_connections_32_are_served_and_the_others_refused_at_once(
    start_server, many_descriptors
):
    running = start_server("--port", "0")
    visits, hellos, seconds, patience, full, next_one = asyncio.run(crowd(running.port))
    refused = [each.seconds for each in visits if each.status == 503]
    print(f"{len(refused)} of {CROWD} refused, all answered in {seconds:.2f} s; slow ones: {patience[0]:.1f} s")
    assert hellos == PLACES and len(refused) == CROWD - PLACES
    assert max(refused) < AT_ONCE_S
    assert all(HANDSHAKE_S - 0.5 < each < HANDSHAKE_S + 3.0 for each in patience)
    assert full == 503 and next_one == 101
    assert running.request("/")[0] == 200
    assert running.stop() == 0
