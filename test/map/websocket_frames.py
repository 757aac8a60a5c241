# SPDX-License-Identifier: Apache-2.0
"""Raw WebSocket frames, right or wrong, and what the server answers to them."""

import json
import struct

import pytest

CONTINUATION, TEXT, BINARY, CLOSE, PING, PONG = 0, 1, 2, 8, 9, 10
VIEW = b'{"view": 30}'
NORMAL, PROTOCOL_ERROR, UNSUPPORTED, BAD_PAYLOAD, TOO_BIG = 1000, 1002, 1003, 1007, 1009


def frame(payload, opcode=TEXT, final=True, reserved=0, masked=True):
    """The bytes of one frame, right or wrong."""
    head = bytes([(0x80 if final else 0) | reserved << 4 | opcode])
    bit = 0x80 if masked else 0
    if len(payload) < 126:
        head += bytes([bit | len(payload)])
    elif len(payload) < 65536:
        head += bytes([bit | 126]) + struct.pack(">H", len(payload))
    else:
        head += bytes([bit | 127]) + struct.pack(">Q", len(payload))
    if not masked:
        return head + payload
    mask = b"\x12\x34\x56\x78"
    return head + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload))


def send(peer, *frames, chop=None):
    data = b"".join(frames)
    if chop is None:
        peer.connection.sendall(data)
        return
    for at in range(0, len(data), chop):
        peer.connection.sendall(data[at : at + chop])


def answer(peer):
    """The next answer to a request: what a view request or a bad one is told."""
    while True:
        opcode, payload = peer.receive()
        if opcode == CLOSE:
            pytest.fail(f"closed with {payload!r}")
        if opcode == TEXT and (message := json.loads(payload))["type"] in ("view", "error"):
            return message


def is_alive(peer):
    send(peer, frame(VIEW))
    return answer(peer) == {"type": "view", "radius": 30.0}


def close_payload(peer):
    return peer.until(lambda opcode, _: opcode == CLOSE)


def close_code(peer):
    return struct.unpack(">H", close_payload(peer)[:2])[0]


def expect_close(peer, code):
    """The server closes with this code and then ends the connection."""
    assert close_code(peer) == code
    with pytest.raises((ConnectionError, OSError)):
        while True:
            peer.receive_one()


def padded(length):
    return VIEW + b" " * (length - len(VIEW))
