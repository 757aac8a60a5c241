# SPDX-License-Identifier: Apache-2.0
"""map_builder as a child process, and a client that sees raw WebSocket frames."""

import base64
import contextlib
import json
import os
import re
import signal
import socket
import struct
import subprocess

from ignis.pipeline import binary
from stream_client import PROTOCOL


class Server:
    def __init__(self, *arguments, url="memq://", environment=None, pass_fds=(), before=None):
        command = [binary("map_builder"), "--lcm-url", url, *arguments]
        self.process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, **(environment or {})},
            pass_fds=pass_fds,
            preexec_fn=before,
        )
        line = self.process.stdout.readline()
        found = re.search(r"http://([\d.]+):(\d+)/", line)
        if not found:
            self.process.kill()
            raise AssertionError(f"no address in {line!r}: {self.process.communicate()[1]}")
        self.port = int(found[2])

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(timeout=10)
        self.process.stdout.close()
        self.process.stderr.close()
        return code

    def kill(self):
        """Unless it has ended."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.port), timeout=10)

    def request(self, target, *headers, method="GET", host=None):
        lines = [
            f"{method} {target} HTTP/1.1",
            f"Host: {host or f'127.0.0.1:{self.port}'}",
            "Connection: close",
            *headers,
        ]
        return self.raw("\r\n".join(lines).encode("latin-1") + b"\r\n\r\n")

    def raw(self, data):
        with self.connect() as connection:
            connection.sendall(data)
            reply = b""
            try:
                while part := connection.recv(65536):
                    reply += part
            except ConnectionResetError:
                pass
        head, _, body = reply.partition(b"\r\n\r\n")
        return int(head.split()[1]) if head else 0, head.decode("latin-1"), body

    def upgrade(self, *extra, origin=None, protocol=PROTOCOL, target="/ws/lio_map", host=None, connection=None):
        connection = connection or self.connect()
        lines = [
            f"GET {target} HTTP/1.1",
            f"Host: {host or f'127.0.0.1:{self.port}'}",
            "Upgrade: websocket",
            "Connection: Upgrade",
            "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: " + base64.b64encode(b"0123456789abcdef").decode(),
            *extra,
        ]
        if protocol:
            lines.append(f"Sec-WebSocket-Protocol: {protocol}")
        if origin:
            lines.append(f"Origin: {origin}")
        connection.sendall("\r\n".join(lines).encode() + b"\r\n\r\n")
        head = b""
        while b"\r\n\r\n" not in head:
            part = connection.recv(1)
            if not part:
                break
            head += part
        return int(head.split()[1]), WebSocket(connection, head.decode())


class WebSocket:
    """Just enough of RFC 6455 to see raw frames."""

    def __init__(self, connection, head):
        self.connection, self.head = connection, head

    def send(self, payload, opcode=1, final=True, length=None, rsv1=False):
        length = len(payload) if length is None else length
        head = bytes([(0x80 if final else 0) | (0x40 if rsv1 else 0) | opcode])
        if length < 126:
            head += bytes([0x80 | length])
        elif length < 65536:
            head += bytes([0x80 | 126]) + struct.pack(">H", length)
        else:
            head += bytes([0x80 | 127]) + struct.pack(">Q", length)
        self.connection.sendall(head + b"\0\0\0\0" + payload)

    def exactly(self, count):
        data = b""
        while len(data) < count:
            part = self.connection.recv(count - len(data))
            if not part:
                raise ConnectionError("closed")
            data += part
        return data

    def receive_one(self):
        first, second = self.exactly(2)
        length = second & 127
        if length == 126:
            length = struct.unpack(">H", self.exactly(2))[0]
        elif length == 127:
            length = struct.unpack(">Q", self.exactly(8))[0]
        assert first & 0x80, "the server sends whole frames"
        return first & 15, self.exactly(length)

    def receive(self):
        """The next frame; pings are answered on the way, or the server would take us for dead."""
        while True:
            opcode, payload = self.receive_one()
            if opcode != 9:
                return opcode, payload
            # The server may have gone already, and why stands behind the ping.
            with contextlib.suppress(OSError):
                self.send(payload, opcode=10)

    def until(self, wanted):
        while True:
            opcode, payload = self.receive()
            if wanted(opcode, payload):
                return payload

    def text(self, kind):
        return json.loads(self.until(lambda op, data: op == 1 and json.loads(data)["type"] == kind))

    def close_code(self):
        return struct.unpack(">H", self.until(lambda op, _: op == 8)[:2])[0]

    def close(self):
        self.connection.close()
