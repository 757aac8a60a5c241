# SPDX-License-Identifier: Apache-2.0
"""A log as NumPy arrays, channel by channel: what analyses and notebooks start from.

log = ignis.read_log("drive.lcmlog")
log["L1_IMU"]["accel"]            # (N, 3) float64 [m/s^2]
log["L1_IMU"].utime               # (N,) int64 [us] of the measurement
log["L1_SCAN"].ragged["x"][7]     # (points,) of the scan 7, parts put together
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ignis.log_config import CONFIG_CHANNEL, recorded_config
from ignis.logs import PART_ARRAYS, LogDamage, PartAssembler, joined_arrays
from ignis.logs import read_log as read_messages

_DTYPES: dict[str, Any] = {
    "int8_t": np.int8, "int16_t": np.int16, "int32_t": np.int32, "int64_t": np.int64, "byte": np.uint8,
    "float": np.float32, "double": np.float64, "boolean": np.bool_, "string": np.str_,
}  # fmt: skip
# Fields that hold one of the constants of their type.
_ENUMERATIONS = ("reason", "state", "command")


@dataclass(frozen=True)
class ChannelArrays(Mapping[str, NDArray[Any]]):
    """All messages of a channel: a column per field, the first axis is the message.

    Fields of fixed length are columns of shape (N,) or (N, k); text is a column of strings. Fields whose length differs
    from message to message are lists of arrays in `ragged`. Meaning, units and frames stand in lcmtypes/TYPE.lcm.
    """

    message_type: type[Any]
    log_utime: NDArray[np.int64]  # [us] of recording
    columns: dict[str, NDArray[Any]]
    ragged: dict[str, list[NDArray[Any]]]

    @property
    def type_name(self) -> str:
        """As in lcmtypes/, for example imu_t."""
        return self.message_type.__name__

    @property
    def utime(self) -> NDArray[np.int64]:
        """[us] of the measurements."""
        return self.columns["utime"]

    @property
    def seconds(self) -> NDArray[np.float64]:
        """Since the channel's first measurement."""
        return np.asarray((self.utime - self.utime[:1]) * 1e-6)

    @property
    def count(self) -> int:
        """Messages."""
        return len(self.log_utime)

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name in self.columns:
            return self.columns[name]
        known = ", ".join([*self.columns, *(f"ragged[{key!r}]" for key in self.ragged)])
        raise KeyError(f"{self.type_name} has no column {name!r}; it has {known}")

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)

    def is_constant(self, name: str) -> NDArray[np.bool_]:
        """Which messages have the reason, state or command of that name, for example is_constant("NO_IMU")."""
        column = "stage" if name.startswith("STAGE_") else next(k for k in _ENUMERATIONS if k in self.columns)
        return np.asarray(self.columns[column] == getattr(self.message_type, name))


@dataclass(frozen=True)
class LogArrays(Mapping[str, ChannelArrays]):
    """A whole log."""

    path: Path
    channels: dict[str, ChannelArrays]
    config: dict[str, Any] | None  # recorded in the log
    damage: LogDamage = field(default_factory=LogDamage)  # what could not be read

    def __getitem__(self, name: str) -> ChannelArrays:
        if name in self.channels:
            return self.channels[name]
        raise KeyError(f"{self.path} has no messages of ours on {name!r}; it has {', '.join(self.channels) or 'none'}")

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def __len__(self) -> int:
        return len(self.channels)


class _Collector:
    """Messages of one channel, on their way to columns."""

    def __init__(self) -> None:
        self.log_utime: list[int] = []
        self.messages: list[Any] = []
        self.joined: list[dict[str, NDArray[Any]]] = []
        self._parts = PartAssembler()

    def add(self, log_utime: int, message: Any) -> None:
        if type(message).__name__ in PART_ARRAYS:
            parts = self._parts.add(message)
            if parts is None:
                return
            self.joined.append(joined_arrays(parts))
        self.log_utime.append(log_utime)
        self.messages.append(message)

    def arrays(self) -> ChannelArrays:
        columns: dict[str, NDArray[Any]] = {}
        ragged: dict[str, list[NDArray[Any]]] = {}
        kind = type(self.messages[0])
        for name, sizes, typename in zip(kind.__slots__, kind.__dimensions__, kind.__typenames__, strict=True):
            dtype = _DTYPES[typename]
            if self.joined and name in self.joined[0]:
                ragged[name] = [arrays[name].astype(dtype) for arrays in self.joined]
            elif sizes is not None and any(isinstance(size, str) for size in sizes):
                ragged[name] = [_array(getattr(message, name), dtype) for message in self.messages]
            else:
                columns[name] = np.array([getattr(message, name) for message in self.messages], dtype=dtype)
        if self.joined:
            columns["num_points"] = np.array([len(arrays["x"]) for arrays in self.joined], dtype=np.int32)
        return ChannelArrays(kind, np.array(self.log_utime, dtype=np.int64), columns, ragged)


def _array(value: Any, dtype: Any) -> NDArray[Any]:
    return np.frombuffer(value, dtype=np.uint8) if isinstance(value, bytes) else np.asarray(value, dtype=dtype)


def read_log(path: Path | str, channels: Collection[str] | None = None) -> LogArrays:
    """Reads the named channels of a log, or all. Channels with types that are not ours are left out and counted in
    `damage.undecodable`; an LCM channel with two types keeps the first."""
    path = Path(path)
    damage = LogDamage()
    collectors: dict[str, _Collector] = {}
    for log_utime, channel, message in read_messages(path, channels, damage):
        collector = collectors.setdefault(channel, _Collector())
        if collector.messages and type(message) is not type(collector.messages[0]):
            damage.undecodable += 1
            continue
        collector.add(log_utime, message)
    found = {name: collector.arrays() for name, collector in sorted(collectors.items()) if collector.messages}
    wanted_config = channels is None or CONFIG_CHANNEL in channels
    return LogArrays(path, found, recorded_config(path) if wanted_config else None, damage)
