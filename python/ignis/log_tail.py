# SPDX-License-Identifier: Apache-2.0
"""Watches a log while it grows: what stands on each channel, and what is missing by the running numbers."""

import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

_SYNC = b"\xed\xa1\xda\x01"
_HEAD = struct.Struct(">4sqqii")
# Behind the fingerprint, all our types begin with int64 utime and int32 sequence.
_SEQUENCE = struct.Struct(">8xqi")
_MAX_CHANNEL = 63
# Several senders share these channels, or number them for somebody else: gaps mean nothing.
_UNNUMBERED = (
    "HEALTH",
    "KEYFRAME_REQUEST",
    "CLOUD_REQUEST",
    "LIO_CLOUD_AGAIN",
    "LIO_COMMAND",
    "GRAPH_COMMAND",
    "IGNIS_CONFIG",
)
# A number this far below the newest means that the sender began anew.
_RESTART_DISTANCE = 1000
_CHUNK = 4 << 20


@dataclass
class ChannelCount:
    """One channel of a log."""

    messages: int = 0
    bytes: int = 0
    missed: int = 0  # by the running number
    first_utime: int = 0  # [us] of recording
    last_utime: int = 0
    newest: int | None = None  # running number

    def rate_hz(self) -> float:
        """Mean rate of the messages."""
        span = (self.last_utime - self.first_utime) * 1e-6
        return (self.messages - 1) / span if span > 0.0 else 0.0

    def observe(self, sequence: int) -> None:
        """Parts of one message, repeats and late arrivals count nothing."""
        if self.newest is None or sequence < self.newest - _RESTART_DISTANCE:
            self.newest = sequence
        elif sequence > self.newest:
            self.missed += sequence - self.newest - 1
            self.newest = sequence


@dataclass
class LogTail:
    """Reads what a logger has written since the last look; a record that is not whole yet is left for the next one."""

    path: Path
    channels: dict[str, ChannelCount] = field(default_factory=dict)
    _file: IO[bytes] | None = None
    _rest: bytes = b""

    def update(self) -> None:
        """Takes in everything new."""
        if self._file is None:
            if not self.path.is_file():
                return
            self._file = self.path.open("rb")
        while chunk := self._file.read(_CHUNK):
            self._take(self._rest + chunk)

    def is_lost(self) -> bool:
        """Whether what was read from is no longer there under its name."""
        return self._file is not None and not self.path.exists()

    def follow(self, path: Path) -> None:
        """Goes on with another file of the same recording."""
        self.close()
        self.path = path

    def close(self) -> None:
        """Gives the file back; the counts stay."""
        if self._file is not None:
            self._file.close()
        self._file, self._rest = None, b""

    @property
    def messages(self) -> int:
        return sum(channel.messages for channel in self.channels.values())

    @property
    def missed(self) -> int:
        return sum(channel.missed for channel in self.channels.values())

    def _take(self, data: bytes) -> None:
        at = 0
        while at + _HEAD.size <= len(data):
            sync, _, utime, name_length, length = _HEAD.unpack_from(data, at)
            if sync != _SYNC or not 0 < name_length <= _MAX_CHANNEL or length < 0:
                following = data.find(_SYNC, at + 1)
                at = following if following >= 0 else len(data)
                continue
            end = at + _HEAD.size + name_length + length
            if end > len(data):
                break
            name = data[at + _HEAD.size : at + _HEAD.size + name_length].decode("ascii", errors="replace")
            self._count(name, utime, data, at + _HEAD.size + name_length, length)
            at = end
        self._rest = data[at:]

    def _count(self, name: str, utime: int, data: bytes, begin: int, length: int) -> None:
        channel = self.channels.setdefault(name, ChannelCount(first_utime=utime))
        channel.messages += 1
        channel.bytes += length
        channel.last_utime = utime
        if name not in _UNNUMBERED and length >= _SEQUENCE.size:
            channel.observe(_SEQUENCE.unpack_from(data, begin)[1])
