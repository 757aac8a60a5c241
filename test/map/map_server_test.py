# SPDX-License-Identifier: Apache-2.0
"""map_builder's server against real sockets on 127.0.0.1. The bus is in memory: nothing reaches a network."""

import contextlib
import json
import os
import pathlib
import re
import select
import socket
import struct
import subprocess
import time
import zlib

import pytest

from ignis.pipeline import binary
from stream_client import PROTOCOL

EMPTY_FRAME_BYTES = 124


@pytest.fixture(scope="module")
def server(start_shared_server):
    running = start_shared_server("--port", "0")
    yield running
    assert running.stop() == 0


def test_page_and_its_files_come_from_the_table(server):
    status, head, body = server.request("/")
    assert status == 200 and "text/html" in head and b"<canvas" in body
    names = set(re.findall(r'(?:src|href)="\./([\w.-]+)"', body.decode()))
    assert {"view.js", "view.css", "icon.svg"} <= names
    for name in names:
        status, head, content = server.request("/" + name)
        assert status == 200 and len(content) > 100, name
    assert server.request("/view.js")[1].count("text/javascript") == 1


def test_status_is_json(server):
    time.sleep(1.2)
    status, head, body = server.request("/api/status")
    assert status == 200 and "application/json" in head
    assert json.loads(body)["voxels"] == [0, 0, 0]


@pytest.mark.parametrize(
    "target",
    [
        "/../../etc/passwd",
        "/..%2f..%2fetc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/%c0%ae%c0%ae/etc/passwd",
        "//etc/passwd",
        "/etc/passwd",
        "/web/view.js",
        "/index.html/..",
        "/view.js%00.css",
        "/VIEW.JS",
        "/map_builder",
    ],
)
def test_paths_outside_the_table_are_404(server, target):
    status, _, body = server.request(target)
    assert status in (400, 404) and b"root:" not in body


def test_malformed_requests_get_4xx_and_no_crash(server):
    host = b"Host: 127.0.0.1\r\n"
    for data in (
        b"NONSENSE\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + host + b"X: " + b"a" * 20000 + b"\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + host + b"Content-Length: 1\r\nContent-Length: 2\r\n\r\nab",
        b"POST / HTTP/1.1\r\n" + host + b"Content-Length: 5\r\n\r\nhello",
        b"GET /\x00 HTTP/1.1\r\n" + host + b"\r\n",
    ):
        assert 400 <= server.raw(data)[0] < 500, data[:40]
    for method in ("POST", "DELETE", "OPTIONS"):
        assert server.request("/", method=method)[0] == 405
    assert server.request("/")[0] == 200


def test_head_has_no_body(server):
    status, head, body = server.request("/", method="HEAD")
    assert status == 200 and body == b"" and "Content-Length" in head


def test_forged_host_is_refused(server):
    assert server.request("/", host="evil.example")[0] == 403
    assert server.upgrade(host="evil.example")[0] == 403
    assert server.request("/", host=f"localhost:{server.port}")[0] == 200
    assert server.request("/", host="[::1]:8080")[0] == 200


@pytest.mark.parametrize("host", ["[localhost", "[localhost]", "[127.0.0.1]", "[::1", "[::1]evil.example", "[]", "::1"])
def test_a_host_with_brackets_that_hold_no_address_is_refused(server, host):
    assert server.request("/", host=host)[0] == 403


def test_foreign_origin_is_refused_before_the_upgrade(server):
    for origin in ("http://evil.example", "null", f"https://127.0.0.1:{server.port}", "http://127.0.0.1:1"):
        status, web_socket = server.upgrade(origin=origin)
        web_socket.close()
        assert status == 403, origin


def test_fault_w8_one_more_origin_that_the_configuration_allows_is_let_in_and_no_other(start_server, tmp_path):
    config = tmp_path / "config.json"
    config.write_text('{"hmi": {"allowed_origin": "https://fleet.example:8443"}}')
    running = start_server("--port", "0", "--config", str(config))
    behind_a_proxy = "fleet.example:8443"
    for origin, host, expected in (
        ("https://fleet.example:8443", None, 101),
        ("https://fleet.example:8443", behind_a_proxy, 101),
        (f"http://127.0.0.1:{running.port}", None, 101),
        ("https://fleet.example", None, 403),
        ("http://fleet.example:8443", None, 403),
        ("https://evil.example:8443", None, 403),
        ("https://evil.example:8443", behind_a_proxy, 403),
        ("https://fleet.example:8443", "evil.example:8443", 403),
    ):
        status, web_socket = running.upgrade(origin=origin, host=host)
        web_socket.close()
        assert status == expected, (origin, host)
    assert running.stop() == 0


def test_wrong_path_or_protocol_is_refused(server):
    assert server.upgrade(target="/ws/other")[0] == 404
    assert server.upgrade(protocol=None)[0] == 400
    assert server.upgrade(protocol="ignis.lio_map.v1")[0] == 400
    assert server.request("/ws/lio_map")[0] == 426


def test_upgrade_gives_a_first_frame_at_once(server):
    status, web_socket = server.upgrade(origin=f"http://127.0.0.1:{server.port}", protocol="other, " + PROTOCOL)
    assert status == 101 and f"Sec-WebSocket-Protocol: {PROTOCOL}" in web_socket.head
    hello = json.loads(web_socket.receive()[1])
    assert hello["type"] == "hello" and hello["version"] == 2
    assert hello["cell_m"] == [0.125, 0.25, 0.5] and hello["window_m"] == [10, 30, 100]
    announced = web_socket.text("frame")
    opcode, frame = web_socket.receive()
    assert opcode == 2 and len(frame) == EMPTY_FRAME_BYTES
    assert announced["kind"] == "snapshot" and announced["sequence"] == 1
    assert announced["counts"] == [0, 0, 0] and announced["checksum"] == "0" * 16
    assert struct.unpack_from("<7f", frame) == (0, 0, 0, 1, 0, 0, 0)
    assert [struct.unpack_from("<fI", frame, 28 + 16 * k) for k in range(3)] == [(0.125, 0), (0.25, 0), (0.5, 0)]
    assert web_socket.text("hud")["map"]["voxels"] == [0, 0, 0]
    web_socket.close()


def test_fault_w4_compression_that_a_client_offers_is_not_taken_up(server):
    status, web_socket = server.upgrade("Sec-WebSocket-Extensions: permessage-deflate; client_max_window_bits")
    assert status == 101 and "sec-websocket-extensions" not in web_socket.head.lower()
    web_socket.send(zlib.compress(b" " * 10_000_000), rsv1=True)
    assert web_socket.close_code() == 1002, "the bit that marks compressed messages means nothing here"
    web_socket.close()


def test_view_request_is_clamped_and_told(server):
    _, web_socket = server.upgrade()
    for asked, served in ((25.5, 25.5), (1e9, 150.0), (-3, 1.0)):
        web_socket.send(json.dumps({"view": asked}).encode())
        assert web_socket.text("view")["radius"] == served
    web_socket.close()


def test_bad_requests_are_answered_and_end_after_twenty(server):
    _, web_socket = server.upgrade()
    web_socket.send(b'{"view": NaN}')
    assert web_socket.text("error")["code"] == "bad_request"
    for _ in range(20):
        web_socket.send(b"[" * 1000)
    assert web_socket.close_code() == 1008
    web_socket.close()


def test_too_large_message_closes_1009(server):
    _, web_socket = server.upgrade()
    web_socket.send(b" " * 100, length=64 * 1024 * 1024)
    assert web_socket.close_code() == 1009
    web_socket.close()
    _, web_socket = server.upgrade()
    for _ in range(5):
        web_socket.send(b"x" * 16384, opcode=1 if _ == 0 else 0, final=False)
    assert web_socket.close_code() == 1009
    web_socket.close()


def test_invalid_text_closes_1007(server):
    _, web_socket = server.upgrade()
    web_socket.send(b"\xff\xfe\xfd")
    assert web_socket.close_code() == 1007
    web_socket.close()


def test_a_client_that_vanishes_or_never_finishes_its_handshake_harms_nobody(server):
    _, gone = server.upgrade()
    gone.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    gone.close()
    with server.connect() as slow:
        slow.sendall(b"GET / HT")
        began = time.monotonic()
        assert slow.recv(100) == b""
        assert 4.0 < time.monotonic() - began < 7.0
    assert server.request("/")[0] == 200


def test_a_client_that_answers_no_ping_is_closed_and_one_that_does_stays(server):
    (_, silent), (_, lively) = server.upgrade(), server.upgrade()
    began = time.monotonic()
    while time.monotonic() < began + 15:
        if silent.connection in select.select([silent.connection, lively.connection], [], [], 1.0)[0]:
            try:
                silent.receive_one()
            except ConnectionError:
                break
        else:
            lively.receive()
    assert 8 < time.monotonic() - began < 14
    assert lively.text("hud")
    lively.close()


def test_fault_w1_a_client_that_reads_nothing_is_closed_though_it_sends_pongs(server):
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.connect(("127.0.0.1", server.port))
    _, silent = server.upgrade(connection=connection)
    began = time.monotonic()
    with contextlib.suppress(ConnectionError):
        while time.monotonic() < began + 30:
            silent.send(b"", opcode=10)
            time.sleep(0.1)
    assert 10 < time.monotonic() - began < 25
    silent.close()


def test_a_binary_message_closes_1003(server):
    _, web_socket = server.upgrade()
    web_socket.send(b'{"view": 20}', opcode=2)
    assert web_socket.close_code() == 1003
    web_socket.close()


def test_client_cap_gives_503_and_a_place_becomes_free(start_server, tmp_path):
    config = tmp_path / "config.json"
    config.write_text('{"hmi": {"max_clients": 2}}')
    running = start_server("--port", "0", "--config", str(config))
    viewers = [running.upgrade() for _ in range(2)]
    assert [status for status, _ in viewers] == [101, 101]
    assert running.upgrade()[0] == 503
    viewers[0][1].close()
    deadline = time.monotonic() + 5
    while (status := running.upgrade()[0]) == 503 and time.monotonic() < deadline:
        time.sleep(0.05)
    assert status == 101
    assert running.stop() == 0


def test_inherited_socket_works(start_server):
    listening = socket.create_server(("127.0.0.1", 0))
    port = listening.getsockname()[1]

    def as_descriptor_3():
        os.dup2(listening.fileno(), 3, inheritable=True)

    running = start_server(environment={"LISTEN_FDS": "1"}, before=as_descriptor_3, pass_fds=(3,))
    listening.close()
    assert running.port == port
    assert running.request("/")[0] == 200
    assert running.stop() == 0


def run_to_end(*arguments, **environment):
    return subprocess.run(
        [binary("map_builder"), "--lcm-url", "memq://", *arguments],
        capture_output=True,
        text=True,
        timeout=20,
        env={**os.environ, **environment},
    )


def test_occupied_port_is_one_sentence_and_a_failure():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        result = run_to_end("--port", str(taken.getsockname()[1]))
    assert result.returncode == 1
    assert "in use" in result.stderr and result.stderr.count("\n") == 1


def test_a_passed_descriptor_that_is_no_listening_socket_is_refused():
    result = run_to_end(LISTEN_FDS="1")
    assert result.returncode == 2 and "descriptor 3" in result.stderr and result.stderr.count("\n") == 1


def test_the_map_is_saved_when_stopped(start_server, tmp_path):
    running = start_server("--port", "0", "--out", str(tmp_path / "results"))
    assert running.stop() == 0
    names = sorted(path.name for path in pathlib.Path(tmp_path / "results").iterdir())
    assert names == ["map.pcd", "map.ply"]
