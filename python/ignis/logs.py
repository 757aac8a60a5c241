# SPDX-License-Identifier: Apache-2.0
"""LCM logs: reading that survives damage, typed messages, parts put together, writing.

A record is big-endian: sync word, number (i64), time (i64, us), channel length, data length (i32 each), channel, data.
LCM's own reader takes the first damaged record for the end; this one looks for the next record and counts the bytes it
had to skip.
"""

import functools
import importlib
import mmap
import pkgutil
import struct
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import IO, Any, NamedTuple, Self

import numpy as np

from ignis.errors import InputError

_SYNC = b"\xed\xa1\xda\x01"
_HEAD = struct.Struct(">4sqqii")
_MAX_CHANNEL = 63

# Records of these channels are no LCM messages: JSON text, and what LCM sends itself when it starts.
RAW_CHANNELS = ("IGNIS_CONFIG", "LCM_SELF_TEST")

PART_ARRAYS = {
    "scan_t": ("x", "y", "z", "intensity", "dt_us"),
    "cloud_t": ("x", "y", "z", "intensity"),
}


class LogEvent(NamedTuple):
    """One raw record."""

    utime: int  # [us] stamp of the record
    channel: str
    data: bytes


class TypedEvent(NamedTuple):
    """One decoded record."""

    utime: int  # [us] stamp of the record
    channel: str
    message: Any


class LogDamage:
    """What a reader had to leave out."""

    def __init__(self) -> None:
        self.skipped_bytes = 0
        self.undecodable = 0

    def __bool__(self) -> bool:
        return self.skipped_bytes > 0 or self.undecodable > 0


def read_events(path: Path, damage: LogDamage | None = None) -> Iterator[LogEvent]:
    """Yields every whole record in file order."""
    damage = damage if damage is not None else LogDamage()
    try:
        file = path.open("rb")
    except OSError as error:
        raise InputError(f"cannot read the log {path}: {error.strerror}") from None
    with file:
        if path.stat().st_size == 0:
            raise InputError(f"the log {path} is empty")
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as view:
            if view.find(_SYNC, 0, 1 << 20) < 0:
                raise InputError(f"{path} is not an LCM log")
            yield from _records(view, damage)


def _records(view: mmap.mmap, damage: LogDamage) -> Iterator[LogEvent]:
    at, size = 0, len(view)
    while at < size:
        event, end = _record_at(view, at)
        if event is None:
            following = view.find(_SYNC, at + 1)
            end = following if following >= 0 else size
            damage.skipped_bytes += end - at
        else:
            yield event
        at = end


def _record_at(view: mmap.mmap, at: int) -> tuple[LogEvent | None, int]:
    """The record that begins at `at` and the offset behind it, or None when there is no whole one."""
    body = at + _HEAD.size
    if body > len(view):
        return None, at
    sync, _, utime, channel_length, data_length = _HEAD.unpack_from(view, at)
    if sync != _SYNC or not 0 < channel_length <= _MAX_CHANNEL or data_length < 0:
        return None, at
    end = body + channel_length + data_length
    if end > len(view):
        return None, at
    # A damaged length would swallow its neighbours: no record follows it, but one begins inside.
    if end < len(view) and view[end : end + 4] != _SYNC and view.find(_SYNC, body, end) >= 0:
        return None, at
    channel = view[body : body + channel_length].decode("ascii", errors="replace")
    return LogEvent(utime, channel, view[body + channel_length : end]), end


@functools.cache
def _types_by_fingerprint() -> dict[bytes, Any]:
    try:
        package = importlib.import_module("ignis_lcm.ignis")
    except ModuleNotFoundError:
        raise InputError("the generated message types are missing; run ./ignis build first") from None
    types = {}
    for info in pkgutil.iter_modules(package.__path__):
        message_type = getattr(importlib.import_module(f"ignis_lcm.ignis.{info.name}"), info.name)
        types[message_type._get_packed_fingerprint()] = message_type
    return types


def read_log(
    path: Path, channels: Collection[str] | None = None, damage: LogDamage | None = None
) -> Iterator[TypedEvent]:
    """Yields decoded messages of the given channels (all when None). Unknown types are counted and skipped."""
    damage = damage if damage is not None else LogDamage()
    types = _types_by_fingerprint()
    for event in read_events(path, damage):
        if event.channel in RAW_CHANNELS or (channels is not None and event.channel not in channels):
            continue
        message_type = types.get(event.data[:8])
        try:
            if message_type is None:
                raise ValueError("unknown type")
            message = message_type.decode(event.data)
        except (ValueError, struct.error, UnicodeDecodeError):
            damage.undecodable += 1
            continue
        yield TypedEvent(event.utime, event.channel, message)


class PartAssembler:
    """Puts messages that travel in numbered parts together again; one instance per channel."""

    def __init__(self) -> None:
        self._key: tuple[int, int] | None = None
        self._parts: dict[int, Any] = {}
        self.incomplete = 0

    def add(self, message: Any) -> list[Any] | None:
        """Returns all parts in order once the last missing one has come, else None."""
        key = (message.utime, message.sequence)
        if key != self._key:
            self.incomplete += bool(self._parts)
            self._key, self._parts = key, {}
        self._parts[message.part] = message
        if len(self._parts) < message.part_count:
            return None
        parts = [self._parts[number] for number in sorted(self._parts)]
        self._key, self._parts = None, {}
        return parts


def joined_arrays(parts: list[Any]) -> dict[str, np.ndarray]:
    """The arrays of all parts of a scan_t or cloud_t, one behind the other."""
    names = PART_ARRAYS[type(parts[0]).__name__]
    return {name: np.concatenate([np.asarray(getattr(part, name)) for part in parts]) for name in names}


class LogWriter:
    """Writes records one behind the other."""

    def __init__(self, path: Path) -> None:
        self._file: IO[bytes] = path.open("wb")
        self.events = 0

    @classmethod
    def to_stream(cls, stream: IO[bytes]) -> Self:
        """Writes into an open stream, which stays open."""
        writer = cls.__new__(cls)
        writer._file, writer.events = stream, 0
        return writer

    def write(self, utime: int, channel: str, data: bytes) -> None:
        name = channel.encode("ascii")
        self._file.write(_HEAD.pack(_SYNC, self.events, utime, len(name), len(data)))
        self._file.write(name)
        self._file.write(data)
        self.events += 1

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
