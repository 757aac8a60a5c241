# SPDX-License-Identifier: Apache-2.0
"""RFC 6455 against the server, with raw frames. Numbers are the sections of the Autobahn test suite, of which
everything is here that applies to a server that takes short texts: framing, pings, reserved bits, opcodes,
fragmentation, UTF-8 and closing. Where Autobahn expects an echo, the answer to a request stands for it.
"""

import json
import struct
import time

import pytest

CONTINUATION, TEXT, BINARY, CLOSE, PING, PONG = 0, 1, 2, 8, 9, 10
VIEW = b'{"view": 30}'
NORMAL, PROTOCOL_ERROR, UNSUPPORTED, BAD_PAYLOAD, TOO_BIG = 1000, 1002, 1003, 1007, 1009


@pytest.fixture(scope="module")
def server(start_server):
    running = start_server("--port", "0")
    yield running
    assert running.stop() == 0


@pytest.fixture
def peer(server):
    status, web_socket = server.upgrade()
    assert status == 101
    yield web_socket
    web_socket.close()


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


# 1: framing


@pytest.mark.parametrize("length", [12, 64, 125, 126, 127, 128, 200])
def test_1_1_texts_of_every_length_encoding(peer, length):
    send(peer, frame(padded(length)))
    assert answer(peer)["type"] == "view"


@pytest.mark.parametrize("length", [0, 201, 65535, 65536])
def test_1_1_texts_that_are_no_request_are_answered(peer, length):
    send(peer, frame(b" " * length))
    assert answer(peer)["code"] == "bad_request"
    assert is_alive(peer)


@pytest.mark.parametrize("chop", [1, 997])
def test_1_1_8_texts_that_arrive_in_pieces(peer, chop):
    send(peer, frame(padded(200)), chop=chop)
    assert answer(peer)["type"] == "view"


def test_1_1_a_text_above_the_limit_closes(peer):
    send(peer, frame(b" " * 65537))
    expect_close(peer, TOO_BIG)


@pytest.mark.parametrize("length", [0, 125, 65535])
def test_1_2_binary_messages_are_not_for_this_server(peer, length):
    send(peer, frame(b"\xfe" * length, BINARY))
    expect_close(peer, UNSUPPORTED)


# 2: pings and pongs


@pytest.mark.parametrize(
    "payload",
    [b"", b"Hello, world!", b"\x00\xff\xfe\xfd\xfc\xfb\x00\xff", b"\xfe" * 125],
    ids=["2.1", "2.2", "2.3", "2.4"],
)
@pytest.mark.parametrize("chop", [None, 1], ids=["whole", "2.6"])
def test_2_pings_are_answered_with_their_payload(peer, payload, chop):
    send(peer, frame(payload, PING), chop=chop)
    assert peer.until(lambda opcode, _: opcode == PONG) == payload


def test_2_5_a_ping_above_125_bytes_closes(peer):
    send(peer, frame(b"\xfe" * 126, PING))
    expect_close(peer, PROTOCOL_ERROR)


@pytest.mark.parametrize("payload", [b"", b"unsolicited"], ids=["2.7", "2.8"])
def test_2_unsolicited_pongs_are_ignored(peer, payload):
    send(peer, frame(payload, PONG), frame(b"ping", PING))
    assert peer.until(lambda opcode, _: opcode == PONG) == b"ping"  # 2.9
    assert is_alive(peer)


@pytest.mark.parametrize("chop", [None, 1], ids=["2.10", "2.11"])
def test_2_ten_pings_are_answered_in_order(peer, chop):
    payloads = [f"payload-{i}".encode() for i in range(10)]
    send(peer, *[frame(payload, PING) for payload in payloads], chop=chop)
    pongs = [peer.until(lambda opcode, _: opcode == PONG)]
    while pongs[-1] != payloads[-1]:
        pongs.append(peer.until(lambda opcode, _: opcode == PONG))
    # RFC 6455 5.5.3: of pings that came meanwhile only the newest must be answered.
    assert [payload for payload in payloads if payload in pongs] == pongs


# 3: reserved bits, 4: opcodes


@pytest.mark.parametrize("reserved", range(1, 8))
@pytest.mark.parametrize("opcode", [TEXT, PING, CLOSE])
def test_3_reserved_bits_close(peer, reserved, opcode):
    send(peer, frame(b"", opcode, reserved=reserved))
    expect_close(peer, PROTOCOL_ERROR)


def test_3_2_what_came_before_a_reserved_bit_is_answered(peer):
    send(peer, frame(VIEW), frame(VIEW, reserved=2), frame(b"", PING))
    assert answer(peer)["type"] == "view"
    expect_close(peer, PROTOCOL_ERROR)


@pytest.mark.parametrize("opcode", [3, 4, 5, 6, 7, 11, 12, 13, 14, 15])
@pytest.mark.parametrize("payload", [b"", b"reserved opcode"])
def test_4_reserved_opcodes_close(peer, opcode, payload):
    send(peer, frame(payload, opcode))
    expect_close(peer, PROTOCOL_ERROR)


def test_unmasked_frames_close(peer):
    send(peer, frame(VIEW, masked=False))
    expect_close(peer, PROTOCOL_ERROR)


# 5: fragmentation


@pytest.mark.parametrize("opcode", [PING, PONG], ids=["5.1", "5.2"])
def test_5_fragmented_control_frames_close(peer, opcode):
    send(peer, frame(b"part", opcode, final=False), frame(b"rest", CONTINUATION))
    expect_close(peer, PROTOCOL_ERROR)


@pytest.mark.parametrize("chop", [None, 1], ids=["5.3", "5.5"])
def test_5_a_text_in_two_fragments(peer, chop):
    send(peer, frame(VIEW[:5], final=False), frame(VIEW[5:], CONTINUATION), chop=chop)
    assert answer(peer)["radius"] == 30


@pytest.mark.parametrize("chop", [None, 1], ids=["5.6", "5.8"])
def test_5_a_ping_between_the_fragments(peer, chop):
    send(peer, frame(VIEW[:5], final=False), frame(b"ping", PING), frame(VIEW[5:], CONTINUATION), chop=chop)
    seen = []
    while len(seen) < 2:
        opcode, payload = peer.receive()
        if opcode == PONG or (opcode == TEXT and json.loads(payload)["type"] == "view"):
            seen.append(opcode)
    assert seen == [PONG, TEXT]


def test_5_empty_fragments_are_fragments(peer):
    send(peer, frame(b"", final=False), frame(VIEW, CONTINUATION, final=False), frame(b"", CONTINUATION))
    assert answer(peer)["radius"] == 30


def test_5_a_text_of_single_bytes(peer):
    parts = [frame(VIEW[:1], final=False)]
    parts += [frame(VIEW[i : i + 1], CONTINUATION, final=i + 1 == len(VIEW)) for i in range(1, len(VIEW))]
    send(peer, *parts)
    assert answer(peer)["radius"] == 30


@pytest.mark.parametrize("final", [True, False], ids=["5.9", "5.10"])
def test_5_a_continuation_of_nothing_closes(peer, final):
    send(peer, frame(b"non-continuation payload", CONTINUATION, final=final), frame(VIEW))
    expect_close(peer, PROTOCOL_ERROR)


def test_5_15_a_continuation_behind_the_end_closes(peer):
    send(peer, frame(VIEW[:5], final=False), frame(VIEW[5:], CONTINUATION), frame(b"more", CONTINUATION, final=False))
    assert answer(peer)["radius"] == 30
    expect_close(peer, PROTOCOL_ERROR)


def test_5_18_a_new_message_within_a_message_closes(peer):
    send(peer, frame(b"fragment1", final=False), frame(b"fragment2"))
    expect_close(peer, PROTOCOL_ERROR)


def test_5_19_pings_between_many_fragments_are_answered_at_once(peer):
    send(peer, frame(VIEW[:2], final=False), frame(VIEW[2:4], CONTINUATION, final=False), frame(b"p1", PING))
    assert peer.until(lambda opcode, _: opcode == PONG) == b"p1"
    send(peer, frame(VIEW[4:6], CONTINUATION, final=False), frame(b"p2", PING), frame(VIEW[6:], CONTINUATION))
    assert peer.until(lambda opcode, _: opcode == PONG) == b"p2"
    assert answer(peer)["radius"] == 30


def test_9_a_fragmented_message_above_the_limit_closes(peer):
    send(peer, frame(b" " * 40000, final=False), frame(b" " * 40000, CONTINUATION))
    expect_close(peer, TOO_BIG)


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


def test_refusals_are_counted(server):
    time.sleep(1.5)  # the status is made once a second
    before = status_counts(server)
    for data, code in (
        (frame(VIEW, reserved=4), PROTOCOL_ERROR),
        (frame(b"\xff"), BAD_PAYLOAD),
        (frame(b"x", BINARY), UNSUPPORTED),
        (frame(b" " * 70000), TOO_BIG),
    ):
        _, web_socket = server.upgrade()
        send(web_socket, data)
        expect_close(web_socket, code)
    _, web_socket = server.upgrade()
    send(web_socket, frame(b"{}"))
    assert answer(web_socket)["type"] == "error"
    web_socket.close()
    time.sleep(1.5)
    after = status_counts(server)
    kinds = ("protocol_errors", "invalid_texts", "binary_messages", "oversized", "bad_requests")
    assert [after[kind] - before[kind] for kind in kinds] == [1, 1, 1, 1, 1]


def status_counts(server):
    return json.loads(server.request("/api/status")[2])["stream"]["refused"]


def test_a_flood_of_requests_ends(server):
    _, web_socket = server.upgrade()
    send(web_socket, *[frame(VIEW)] * 200)
    assert close_code(web_socket) == 1008
    web_socket.close()


def test_a_flood_of_pings_ends(server):
    _, web_socket = server.upgrade()
    send(web_socket, *[frame(b"", PING)] * 200)
    assert close_code(web_socket) == 1008
    web_socket.close()


def test_an_independent_client_understands_the_stream(server):
    from websockets.sync.client import connect

    from stream_client import PROTOCOL, ViewState

    state, kinds = ViewState(), []
    with connect(
        f"ws://127.0.0.1:{server.port}/ws/lio_map", subprotocols=[PROTOCOL], origin=f"http://127.0.0.1:{server.port}"
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
