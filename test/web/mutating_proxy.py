# SPDX-License-Identifier: Apache-2.0
"""A proxy between the page and its server that damages the server's WebSocket frames, by a seeded generator."""

from __future__ import annotations

import contextlib
import random
import socket
import struct
import threading
from collections.abc import Callable

BINARY, TEXT = 2, 1
# A frame's payload and whether it is a text; what is to be sent instead. None: nothing.
Damage = Callable[[bytes, bool, random.Random], bytes | None]


def none(payload: bytes, _is_text: bool, _generator: random.Random) -> bytes:
    """Passes all on."""
    return payload


def altered_voxels(payload: bytes, is_text: bool, generator: random.Random) -> bytes:
    """Flips bits in every other binary frame."""
    return payload if is_text or generator.random() < 0.5 else _flipped(payload, 8, generator)


def altered_texts(payload: bytes, is_text: bool, generator: random.Random) -> bytes:
    """Replaces letters and digits of texts, which stay valid UTF-8 and often valid JSON."""
    if not is_text or generator.random() < 0.3:
        return payload
    changed = bytearray(payload)
    for _ in range(1 + len(changed) // 100):
        changed[generator.randrange(len(changed))] = generator.randrange(0x20, 0x7F)
    return bytes(changed)


def truncated(payload: bytes, is_text: bool, generator: random.Random) -> bytes:
    """Sends the beginning of some messages as if it were all."""
    return payload if generator.random() < 0.5 else payload[: generator.randrange(len(payload) + 1)]


def swallowed(payload: bytes, is_text: bool, generator: random.Random) -> bytes | None:
    """Every other binary frame is missing: a gap of revisions."""
    return None if not is_text and generator.random() < 0.5 else payload


def _flipped(payload: bytes, bits: int, generator: random.Random) -> bytes:
    changed = bytearray(payload)
    for _ in range(bits if changed else 0):
        changed[generator.randrange(len(changed))] ^= 1 << generator.randrange(8)
    return bytes(changed)


class MutatingProxy:
    """Listens on a port of its own. A context manager. `damage` may be changed at any time."""

    def __init__(self, server_port: int, seed: int) -> None:
        self.damage: Damage = none
        self.damaged = 0
        self.half_frames = 0  # so many times the connection ends within a frame
        self._random = random.Random(seed)
        self._server_port = server_port
        self._sockets: list[socket.socket] = []
        self._listener: socket.socket | None = None
        self.port = self.open()

    def __enter__(self) -> MutatingProxy:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def open(self, port: int = 0) -> int:
        """Begins to listen; the port."""
        listener = socket.create_server(("127.0.0.1", port))
        self._listener = listener
        threading.Thread(target=self._accept, args=(listener,), daemon=True).start()
        return int(listener.getsockname()[1])

    def close(self) -> None:
        """As if the server were gone: nobody listens, and every connection ends."""
        if self._listener is not None:
            self._listener.shutdown(socket.SHUT_RDWR)
            self._listener.close()
        self._listener = None
        for each in self._sockets:
            _end(each)
        self._sockets.clear()

    def _accept(self, listener: socket.socket) -> None:
        while True:
            try:
                page, _ = listener.accept()
                server = socket.create_connection(("127.0.0.1", self._server_port))
            except OSError:
                return
            self._sockets += [page, server]
            threading.Thread(target=self._to_server, args=(page, server), daemon=True).start()
            threading.Thread(target=self._to_page, args=(server, page), daemon=True).start()

    def _to_server(self, page: socket.socket, server: socket.socket) -> None:
        mine, its = f"127.0.0.1:{self.port}".encode(), f"127.0.0.1:{self._server_port}".encode()
        try:
            while data := page.recv(65536):
                # The server must see its own name in Host and Origin.
                server.sendall(data.replace(mine, its) if data.startswith(b"GET ") else data)
        except OSError:
            pass
        _end(server)

    def _to_page(self, server: socket.socket, page: socket.socket) -> None:
        stream = server.makefile("rb")
        try:
            head = b""
            while not head.endswith(b"\r\n\r\n") and (line := stream.readline()):
                head += line
            page.sendall(head)
            if b" 101 " in head.split(b"\r\n", 1)[0]:
                self._pass_frames(stream, page)
            while data := stream.read1(65536):
                page.sendall(data)
        except (OSError, ValueError, struct.error):
            pass
        _end(page)

    def _pass_frames(self, stream, page: socket.socket) -> None:
        while head := stream.read(2):
            length = head[1] & 127
            if length > 125:
                length = struct.unpack(">H" if length == 126 else ">Q", stream.read(2 if length == 126 else 8))[0]
            payload = stream.read(length)
            opcode = head[0] & 15
            if opcode not in (TEXT, BINARY):
                page.sendall(_frame(head[0], payload))
                continue
            if self.half_frames > 0 and opcode == BINARY:
                self.half_frames -= 1
                page.sendall(_frame(head[0], payload)[: 2 + len(payload) // 2])
                raise OSError("ended within a frame")
            changed = self.damage(payload, opcode == TEXT, self._random)
            self.damaged += changed != payload
            if changed is not None:
                page.sendall(_frame(head[0], changed))


def _frame(first: int, payload: bytes) -> bytes:
    length = len(payload)
    if length < 126:
        return bytes([first, length]) + payload
    if length < 65536:
        return bytes([first, 126]) + struct.pack(">H", length) + payload
    return bytes([first, 127]) + struct.pack(">Q", length) + payload


def _end(one: socket.socket) -> None:
    with contextlib.suppress(OSError):
        one.shutdown(socket.SHUT_RDWR)
    one.close()
