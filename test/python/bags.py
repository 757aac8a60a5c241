# SPDX-License-Identifier: Apache-2.0
"""Bags made on the fly: a wall ahead, to the left and above, seen at rest, in each of the container formats."""

import contextlib
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START_NS = 1_700_000_000_000_000_000
CLOUD = "sensor_msgs/msg/PointCloud2"
IMU = "sensor_msgs/msg/Imu"
POINTS = np.array([[5.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 3.0], [6.0, 1.0, 1.0]])
OFFSETS_NS = np.array([0, 30_000_000, 60_000_000, 90_000_000], dtype=np.uint32)
FORMATS = ("ros1", "ros2", "mcap")


class Messages:
    """Builds messages of one ROS version."""

    def __init__(self, ros1: bool) -> None:
        self.ros1 = ros1
        self.store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)

    def make(self, type_name: str, /, **values: Any) -> Any:
        return self.store.types[type_name](**values)

    def header(self, ns: int) -> Any:
        stamp = self.make("builtin_interfaces/msg/Time", sec=ns // 10**9, nanosec=ns % 10**9)
        extra = {"seq": 0} if self.ros1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id="lidar", **extra)

    def cloud(self, ns: int, time_name: str | None = "t", brightest: float = 40.0) -> Any:
        kinds = [("x", "<f4", 7), ("y", "<f4", 7), ("z", "<f4", 7), ("intensity", "<f4", 7)]
        kinds += [(time_name, "<u4", 6)] if time_name else []
        rows = np.zeros(len(POINTS), dtype=[(name, kind) for name, kind, _ in kinds])
        rows["x"], rows["y"], rows["z"] = POINTS.T
        rows["intensity"] = np.array([0.25, 0.5, 0.75, 1.0]) * brightest
        if time_name:
            rows[time_name] = OFFSETS_NS
        fields = [
            self.make("sensor_msgs/msg/PointField", name=name, offset=4 * index, datatype=code, count=1)
            for index, (name, _, code) in enumerate(kinds)
        ]
        data = np.frombuffer(rows.tobytes(), dtype=np.uint8)
        return self.make(
            CLOUD,
            header=self.header(ns),
            height=1,
            width=len(rows),
            fields=fields,
            is_bigendian=False,
            point_step=rows.itemsize,
            row_step=data.size,
            data=data,
            is_dense=True,
        )

    def imu(self, ns: int, gravity: float = 9.81) -> Any:
        def vector(x: float, y: float, z: float) -> Any:
            return self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

        return self.make(
            IMU,
            header=self.header(ns),
            orientation=self.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
            orientation_covariance=np.zeros(9),
            angular_velocity=vector(0.1, 0.2, 0.3),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=vector(0.0, 0.0, gravity),
            linear_acceleration_covariance=np.zeros(9),
        )

    def raw(self, message: Any, name: str) -> bytes:
        serialize = self.store.serialize_ros1 if self.ros1 else self.store.serialize_cdr
        return bytes(serialize(message, name))


def write_bag(folder: Path, form: str, topics: dict[str, str], **options: Any) -> Path:
    """Writes 5 clouds at 10 Hz and 50 inertial samples at 100 Hz per topic; `topics` maps names to types."""
    messages = Messages(form == "ros1")
    path = folder / ("bag.bag" if form == "ros1" else f"bag_{form}")
    plugin = StoragePlugin.MCAP if form == "mcap" else StoragePlugin.SQLITE3
    writer = Writer1(path) if form == "ros1" else Writer2(path, version=9, storage_plugin=plugin)
    cloud_options = {name: options[name] for name in ("time_name", "brightest") if name in options}
    with writer:
        entries = []
        for topic, name in topics.items():
            connection = writer.add_connection(topic, name, typestore=messages.store)
            count, step = (5, 100_000_000) if name == CLOUD else (50, 10_000_000)
            for index in range(count):
                ns = START_NS + index * step
                body = messages.cloud(ns, **cloud_options) if name == CLOUD else None
                body = body or messages.imu(ns, options.get("gravity", 9.81))
                entries.append((ns, connection, messages.raw(body, name)))
        for ns, connection, raw in sorted(entries, key=lambda entry: entry[0]):
            writer.write(connection, ns, raw)
    return path


_LIVOX_POINT = "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line\n"
_LIVOX_CLOUD = """std_msgs/Header header
uint64 timebase
uint32 point_num
uint8 lidar_id
uint8[3] rsvd
{package}/CustomPoint[] points
"""


def write_livox_bag(folder: Path, form: str, package: str) -> Path:
    """The same scene from a Livox driver, an sqlite3 bag without its definitions, as before ROS 2 Iron."""
    messages = Messages(ros1=False)
    point, cloud = f"{package}/msg/CustomPoint", f"{package}/msg/CustomMsg"
    messages.store.register(get_types_from_msg(_LIVOX_POINT, point))
    messages.store.register(get_types_from_msg(_LIVOX_CLOUD.format(package=package), cloud))
    plugin = StoragePlugin.MCAP if form == "mcap" else StoragePlugin.SQLITE3
    path = folder / f"livox_{form}"
    with Writer2(path, version=8, storage_plugin=plugin) as writer:
        clouds = writer.add_connection("/livox/lidar", cloud, typestore=messages.store)
        samples = writer.add_connection("/livox/imu", IMU, typestore=messages.store)
        entries = []
        for index in range(5):
            ns = START_NS + index * 100_000_000
            points = [
                messages.make(point, offset_time=int(t), x=x, y=y, z=z, reflectivity=9, tag=0, line=0)
                for (x, y, z), t in zip(POINTS.tolist(), OFFSETS_NS, strict=True)
            ]
            values = {"timebase": 7, "point_num": len(points), "lidar_id": 0, "points": points}
            message = messages.make(cloud, header=messages.header(ns), rsvd=np.zeros(3, dtype=np.uint8), **values)
            entries.append((ns, clouds, messages.raw(message, cloud)))
        entries += [
            (ns, samples, messages.raw(messages.imu(ns), IMU)) for ns in range(START_NS, START_NS + 500_000_000, 10**7)
        ]
        for ns, connection, raw in sorted(entries, key=lambda entry: entry[0]):
            writer.write(connection, ns, raw)
    if form == "ros2":
        (file,) = path.glob("*.db3")
        with contextlib.closing(sqlite3.connect(file)) as database, database:
            database.execute("DELETE FROM message_definitions")
    return path
