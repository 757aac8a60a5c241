# SPDX-License-Identifier: Apache-2.0
"""RFC 6455 against the server, with raw frames: UTF-8 and closing, and what the server counts and refuses on its own.

Numbers are the sections of the Autobahn test suite; websocket_conformance_test.py has the others.
"""

import json
import struct
import time

import pytest
from websocket_frames import (
    BAD_PAYLOAD,
    BINARY,
    CLOSE,
    CONTINUATION,
    NORMAL,
    PING,
    PONG,
    PROTOCOL_ERROR,
    TOO_BIG,
    UNSUPPORTED,
    VIEW,
    answer,
    close_code,
    close_payload,
    expect_close,
    frame,
    is_alive,
    send,
)

# 6: UTF-8

VALID_TEXTS = {
    "6.2": "Hello-µ@ßöäüàá-UTF-8!!",
    "6.5": "κόσμε",
    "6.9 first of two bytes": "\u0080",
    "6.9 first of three": "\u0800",
    "6.9 first of four": "\U00010000",
    "6.11 last below the surrogates": "\ud7ff",
    "6.11 first above": "\ue000",
    "6.11 replacement": "\ufffd",
    "6.11 last of all": "\U0010ffff",
    "6.22 noncharacter": "\ufffe\uffff\U0001fffe",
}
INVALID_TEXTS = {
    "6.3": b"\xce\xba\xe1\xbd\xb9\xcf\x83\xce\xbc\xce\xb5\xed\xa0\x80\x65\x64\x69\x74\x65\x64",
    "6.8 five bytes": b"\xf8\x88\x80\x80\x80",
    "6.8 six bytes": b"\xfc\x84\x80\x80\x80\x80",
    "6.10 above all": b"\xf7\xbf\xbf\xbf",
    "6.10 just above": b"\xf4\x90\x80\x80",
    "6.12 continuation alone": b"\x80",
    "6.12 continuation last": b"\xbf",
    "6.13 start alone": b"\xc0 \xc1 ",
    "6.14 incomplete": b"\xe1\xbd",
    "6.16 impossible": b"\xfe",
    "6.16 impossible too": b"\xff",
    "6.17 overlong slash in two": b"\xc0\xaf",
    "6.17 overlong slash in three": b"\xe0\x80\xaf",
    "6.17 overlong slash in four": b"\xf0\x80\x80\xaf",
    "6.18 overlong at its largest": b"\xf0\x8f\xbf\xbf",
    "6.19 overlong zero": b"\xc0\x80",
    "6.20 high surrogate": b"\xed\xa0\x80",
    "6.20 low surrogate": b"\xed\xbf\xbf",
    "6.21 a pair of surrogates": b"\xed\xa0\x80\xed\xb0\x80",
}


@pytest.mark.parametrize("text", VALID_TEXTS.values(), ids=VALID_TEXTS.keys())
def test_6_valid_utf8_is_a_text(peer, text):
    data = text.encode("utf-8")
    send(peer, frame(data))
    assert answer(peer)["code"] == "bad_request"
    parts = [frame(data[:1], final=False)]  # also when a character is torn apart
    parts += [frame(data[i : i + 1], CONTINUATION, final=False) for i in range(1, len(data))]
    send(peer, *parts, frame(b"", CONTINUATION))
    assert answer(peer)["code"] == "bad_request"
    assert is_alive(peer)


@pytest.mark.parametrize("data", INVALID_TEXTS.values(), ids=INVALID_TEXTS.keys())
def test_6_invalid_utf8_closes(peer, data):
    send(peer, frame(data))
    expect_close(peer, BAD_PAYLOAD)


def test_6_1_empty_fragments_are_an_empty_text(peer):
    send(peer, frame(b"", final=False), frame(b"", CONTINUATION, final=False), frame(b"", CONTINUATION))
    assert answer(peer)["code"] == "bad_request"


def test_6_4_a_message_that_can_no_longer_be_a_text_closes_before_its_end(peer):
    send(peer, frame(b"\xce\xba\xe1\xbd\xb9\xcf\x83\xce\xbc\xce\xb5", final=False))
    send(peer, frame(b"\xf4\x90\x80\x80", CONTINUATION, final=False))
    expect_close(peer, BAD_PAYLOAD)


# 7: closing


def test_7_1_1_a_close_behind_a_message_is_answered(peer):
    send(peer, frame(VIEW), frame(struct.pack(">H", NORMAL), CLOSE))
    assert close_code(peer) == NORMAL


def test_7_1_2_two_closes_are_one(peer):
    send(peer, frame(struct.pack(">H", NORMAL), CLOSE), frame(struct.pack(">H", NORMAL), CLOSE))
    expect_close(peer, NORMAL)


@pytest.mark.parametrize("after", [frame(b"ping", PING), frame(VIEW)], ids=["7.1.3", "7.1.4"])
def test_7_1_what_comes_behind_a_close_is_ignored(peer, after):
    send(peer, frame(struct.pack(">H", NORMAL), CLOSE), after)
    seen = []
    try:
        while True:
            seen.append(peer.receive_one())
    except (ConnectionError, OSError):
        pass
    assert (CLOSE, struct.pack(">H", NORMAL)) in seen
    assert not any(opcode == PONG for opcode, _ in seen)


def test_7_1_5_a_close_within_a_message(peer):
    send(
        peer,
        frame(b"fragment1", final=False),
        frame(struct.pack(">H", NORMAL), CLOSE),
        frame(b"fragment2", CONTINUATION),
    )
    assert close_code(peer) == NORMAL


def test_7_3_1_a_close_without_a_code(peer):
    send(peer, frame(b"", CLOSE))
    assert close_payload(peer) in (b"", struct.pack(">H", NORMAL))


def test_7_3_2_a_close_of_one_byte(peer):
    send(peer, frame(b"a", CLOSE))
    expect_close(peer, PROTOCOL_ERROR)


@pytest.mark.parametrize("reason", [b"", b"Hello World!", b"*" * 123], ids=["7.3.3", "7.3.4", "7.3.5"])
def test_7_3_a_close_with_a_reason(peer, reason):
    send(peer, frame(struct.pack(">H", NORMAL) + reason, CLOSE))
    expect_close(peer, NORMAL)


def test_7_3_6_a_close_above_125_bytes(peer):
    send(peer, frame(struct.pack(">H", NORMAL) + b"*" * 124, CLOSE))
    expect_close(peer, PROTOCOL_ERROR)


def test_7_5_1_a_reason_that_is_not_utf8(peer):
    send(peer, frame(struct.pack(">H", NORMAL) + b"\xce\xba\xe1\xbd\xb9\xed\xa0\x80", CLOSE))
    assert close_code(peer) in (BAD_PAYLOAD, PROTOCOL_ERROR)


@pytest.mark.parametrize("code", [1000, 1001, 1002, 1003, 1007, 1008, 1009, 1010, 1011, 3000, 3999, 4000, 4999])
def test_7_7_valid_codes_are_answered(peer, code):
    send(peer, frame(struct.pack(">H", code), CLOSE))
    expect_close(peer, code)


@pytest.mark.parametrize("code", [0, 999, 1004, 1005, 1006, 1016, 1100, 2000, 2999])
def test_7_9_invalid_codes_are_violations(peer, code):
    send(peer, frame(struct.pack(">H", code), CLOSE))
    expect_close(peer, PROTOCOL_ERROR)


# What is ours: everything above was counted.


def test_refusals_are_counted(stream_server):
    time.sleep(1.5)  # the status is made once a second
    before = status_counts(stream_server)
    for data, code in (
        (frame(VIEW, reserved=4), PROTOCOL_ERROR),
        (frame(b"\xff"), BAD_PAYLOAD),
        (frame(b"x", BINARY), UNSUPPORTED),
        (frame(b" " * 70000), TOO_BIG),
    ):
        _, web_socket = stream_server.upgrade()
        send(web_socket, data)
        expect_close(web_socket, code)
    _, web_socket = stream_server.upgrade()
    send(web_socket, frame(b"{}"))
    assert answer(web_socket)["type"] == "error"
    web_socket.close()
    time.sleep(1.5)
    after = status_counts(stream_server)
    kinds = ("protocol_errors", "invalid_texts", "binary_messages", "oversized", "bad_requests")
    assert [after[kind] - before[kind] for kind in kinds] == [1, 1, 1, 1, 1]


def status_counts(server):
    return json.loads(server.request("/api/status")[2])["stream"]["refused"]


def test_a_flood_of_requests_ends(stream_server):
    _, web_socket = stream_server.upgrade()
    send(web_socket, *[frame(VIEW)] * 200)
    assert close_code(web_socket) == 1008
    web_socket.close()


def test_a_flood_of_pings_ends(stream_server):
    _, web_socket = stream_server.upgrade()
    send(web_socket, *[frame(b"", PING)] * 200)
    assert close_code(web_socket) == 1008
    web_socket.close()


def test_an_independent_client_understands_the_stream(stream_server):
    from websockets.sync.client import connect

    from stream_client import PROTOCOL, ViewState

    state, kinds = ViewState(), []
    with connect(
        f"ws://127.0.0.1:{stream_server.port}/ws/lio_map",
        subprotocols=[PROTOCOL],
        origin=f"http://127.0.0.1:{stream_server.port}",
    ) as client:
        assert client.subprotocol == PROTOCOL
        client.send(json.dumps({"view": 40}))
        while "view" not in kinds or state.sequence < 1:
            message = json.loads(client.recv(timeout=5))
            kinds.append(message["type"])
            if message["type"] == "frame":
                state.apply(message, client.recv(timeout=5))
        client.send(json.dumps({"resync": True}))
        while state.sequence < 2:
            message = json.loads(client.recv(timeout=5))
            if message["type"] == "frame":
                assert message["kind"] == "snapshot"
                state.apply(message, client.recv(timeout=5))
    assert kinds[0] == "hello"
    assert client.protocol.close_code == NORMAL
