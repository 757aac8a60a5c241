# SPDX-License-Identifier: Apache-2.0
"""Point-cloud messages of ROS (PointCloud2, Livox CustomMsg) to arrays."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ignis.errors import InputError
from ignis.importers.point_times import time_field

# Datatype codes of sensor_msgs/PointField.
_SCALARS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
_INTENSITY_NAMES = ("intensity", "reflectivity", "intensities", "i", "reflectance")


@dataclass(frozen=True)
class RawCloud:
    """One cloud, in sensor axes, times as found."""

    header_ns: int
    points: np.ndarray  # (N, 3) [m]
    intensity: np.ndarray  # as found
    time_name: str  # empty: the cloud has no per-point times
    times: np.ndarray  # as found; zeros without


def stamp_ns(stamp: Any) -> int:
    """A ROS time of either version in nanoseconds."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def from_point_cloud2(message: Any, topic: str, no_deskew: bool = False) -> RawCloud:
    """Reads x, y, z, an intensity and a time from a PointCloud2. Without per-point time it is refused, unless the user
    wants no deskewing; then times are not looked at."""
    order = ">" if message.is_bigendian else "<"
    layout = {f.name: (order + _SCALARS[f.datatype], f.offset) for f in message.fields if f.datatype in _SCALARS}
    missing = [name for name in "xyz" if name not in layout]
    if missing:
        raise InputError(f"the clouds of {topic} have no field {', '.join(missing)}; they have {', '.join(layout)}")
    time_name = "" if no_deskew else time_field(list(layout))
    if time_name is None:
        raise InputError(
            f"the clouds of {topic} have no per-point time (fields: {', '.join(layout)}); record with a driver setting "
            "that adds one, deskewing is impossible without it (--no-deskew imports them all the same)"
        )
    record = np.dtype(
        {
            "names": list(layout),
            "formats": [kind for kind, _ in layout.values()],
            "offsets": [offset for _, offset in layout.values()],
            "itemsize": message.point_step,
        }
    )
    width = message.width * message.point_step
    rows = np.frombuffer(bytes(message.data), dtype=np.uint8)
    if message.height > 1 and message.row_step != width:
        rows = rows.reshape(message.height, message.row_step)[:, :width].reshape(-1)
    cloud = np.frombuffer(rows.tobytes(), dtype=record, count=message.width * message.height)
    intensity_name = next((name for name in _INTENSITY_NAMES if name in layout), None)
    return RawCloud(
        stamp_ns(message.header.stamp),
        np.stack([cloud[name] for name in "xyz"], axis=1).astype(float),
        cloud[intensity_name].astype(float) if intensity_name else np.zeros(len(cloud)),
        time_name,
        np.ascontiguousarray(cloud[time_name]) if time_name else np.zeros(len(cloud), dtype=np.int64),
    )


def from_livox(message: Any, no_deskew: bool = False) -> RawCloud:
    """Reads a Livox CustomMsg: offset_time counts nanoseconds from timebase."""
    rows = np.array([(p.x, p.y, p.z, p.reflectivity, p.offset_time) for p in message.points], dtype=float)
    rows = rows.reshape(-1, 5)
    # Some drivers leave timebase on the sensor's own clock: the header's stamp is what the inertial data share.
    times = np.zeros(len(rows), dtype=np.int64) if no_deskew else rows[:, 4].astype(np.int64)
    name = "" if no_deskew else "offset_time"
    return RawCloud(stamp_ns(message.header.stamp), rows[:, :3], rows[:, 3], name, times)
