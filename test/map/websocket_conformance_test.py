# SPDX-License-Identifier: Apache-2.0
"""RFC 6455 against the server, with raw frames: framing, pings, reserved bits, opcodes and fragmentation.

Numbers are the sections of the Autobahn test suite, of which everything is here and in websocket_closing_test.py that
applies to a server that takes short texts. Where Autobahn expects an echo, the answer to a request stands for it.
"""

import json
import sys

import autobahn
import pytest
from websocket_frames import (
    BINARY,
    CLOSE,
    CONTINUATION,
    PING,
    PONG,
    PROTOCOL_ERROR,
    TEXT,
    TOO_BIG,
    UNSUPPORTED,
    VIEW,
    answer,
    expect_close,
    frame,
    is_alive,
    padded,
    send,
)

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


@pytest.mark.parametrize(("groups", "code"), [(autobahn.GROUPS, 0), (autobahn.GROUPS[:-1], 1), ((), 1)])
def test_fault_w3_an_autobahn_run_that_left_cases_out_has_failed(monkeypatch, groups, code):
    good = {"behavior": "OK", "behaviorClose": "OK"}
    monkeypatch.setattr(autobahn, "run_suite", lambda *_: {f"{group}.1.1": good for group in groups})
    monkeypatch.setattr(sys, "argv", ["autobahn.py", "--wstest", "none"])
    assert autobahn.main() == code
