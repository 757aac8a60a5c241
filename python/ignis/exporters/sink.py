# SPDX-License-Identifier: Apache-2.0
"""What a feed tells a sink. Axes are ROS's, stamps are microseconds of the measurement."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


class Level(IntEnum):
    """How serious a text is; the numbers are those of foxglove.Log."""

    INFO = 2
    WARNING = 3
    ERROR = 4


@dataclass(frozen=True)
class Stamp:
    """When something was measured and when it was recorded [us]."""

    utime: int
    log_utime: int


@dataclass(frozen=True)
class Placed:
    """One pose, source to target coordinates."""

    position: Vector  # (3,) [m]
    quaternion: Vector  # w x y z


ORIGIN = Placed(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))


@dataclass(frozen=True)
class Cloud:
    """Points of one frame."""

    frame: str
    points: NDArray[np.float32]  # (N, 3) [m]
    intensity: NDArray[np.float32]  # 0..255
    dt_us: NDArray[np.int32] | None = None  # of each point behind the stamp
    placed: Placed = ORIGIN  # coordinates of the points in `frame`


class Sink(Protocol):
    """Writes one format. A sink leaves out what its format has no place for."""

    def imu(self, stamp: Stamp, gyro: Vector, accel: Vector) -> None: ...

    def cloud(self, topic: str, stamp: Stamp, cloud: Cloud) -> None: ...

    def pose(self, topic: str, stamp: Stamp, frame: str, placed: Placed) -> None: ...

    def transform(self, stamp: Stamp, parent: str, child: str, placed: Placed) -> None: ...

    def graph(self, stamp: Stamp, way: Vector, loops: list[tuple[Vector, Vector]]) -> None:
        """Keyframes (N, 3) in order and accepted loops as pairs of positions, in map. Replaces what was told before."""

    def text(self, stamp: Stamp, level: Level, source: str, message: str) -> None: ...
