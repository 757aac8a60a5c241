# SPDX-License-Identifier: Apache-2.0
"""A ROS 2 bag (sqlite3), through `rosbags`. Points carry `t`, nanoseconds behind the stamp, so it can be imported."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from ignis.exporters.sink import Cloud, Level, Placed, Stamp, Vector

_CLOUD, _IMU = "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/Imu"
_POSE, _TF = "geometry_msgs/msg/PoseStamped", "tf2_msgs/msg/TFMessage"
_MARKER, _LOG = "visualization_msgs/msg/Marker", "rcl_interfaces/msg/Log"
_LINE_STRIP, _LINE_LIST = 4, 5
_LEVELS = {Level.INFO: 20, Level.WARNING: 30, Level.ERROR: 40}


class Ros2Sink:
    """Writes a bag folder; a context manager."""

    def __init__(self, folder: Path) -> None:
        self._store = get_typestore(Stores.ROS2_HUMBLE)
        self._writer = Writer(folder, version=8, storage_plugin=StoragePlugin.SQLITE3)
        self._connections: dict[str, Any] = {}
        self.counts: Counter[str] = Counter()

    def __enter__(self) -> "Ros2Sink":
        self._writer.open()
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def imu(self, stamp: Stamp, gyro: Vector, accel: Vector) -> None:
        unknown = np.zeros(9)
        unknown[0] = -1.0  # The convention for "no orientation here".
        message = self._make(
            _IMU,
            header=self._header(stamp, "body"),
            orientation=self._quaternion(np.array([1.0, 0.0, 0.0, 0.0])),
            orientation_covariance=unknown,
            angular_velocity=self._vector(gyro),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self._vector(accel),
            linear_acceleration_covariance=np.zeros(9),
        )
        self._write("/imu", _IMU, message, stamp)

    def cloud(self, topic: str, stamp: Stamp, cloud: Cloud) -> None:
        columns = [("x", "<f4", 7), ("y", "<f4", 7), ("z", "<f4", 7), ("intensity", "<f4", 7)]
        columns += [("t", "<u4", 6)] if cloud.dt_us is not None else []
        rows = np.empty(len(cloud.points), dtype=[(name, kind) for name, kind, _ in columns])
        rows["x"], rows["y"], rows["z"] = cloud.points.T
        rows["intensity"] = cloud.intensity
        if cloud.dt_us is not None:
            rows["t"] = cloud.dt_us.astype(np.int64) * 1000
        fields = [
            self._make("sensor_msgs/msg/PointField", name=name, offset=4 * index, datatype=code, count=1)
            for index, (name, _, code) in enumerate(columns)
        ]
        data = np.frombuffer(rows.tobytes(), dtype=np.uint8)
        message = self._make(
            _CLOUD,
            header=self._header(stamp, cloud.frame),
            height=1,
            width=len(rows),
            fields=fields,
            is_bigendian=False,
            point_step=rows.itemsize,
            row_step=data.size,
            data=data,
            is_dense=True,
        )
        self._write(topic, _CLOUD, message, stamp)

    def pose(self, topic: str, stamp: Stamp, frame: str, placed: Placed) -> None:
        message = self._make(_POSE, header=self._header(stamp, frame), pose=self._pose(placed))
        self._write(topic, _POSE, message, stamp)

    def transform(self, stamp: Stamp, parent: str, child: str, placed: Placed) -> None:
        turned = self._make(
            "geometry_msgs/msg/Transform",
            translation=self._vector(placed.position),
            rotation=self._quaternion(placed.quaternion),
        )
        one = self._make(
            "geometry_msgs/msg/TransformStamped",
            header=self._header(stamp, parent),
            child_frame_id=child,
            transform=turned,
        )
        self._write("/tf", _TF, self._make(_TF, transforms=[one]), stamp)

    def graph(self, stamp: Stamp, way: Vector, loops: list[tuple[Vector, Vector]]) -> None:
        ends = np.array([end for pair in loops for end in pair]).reshape(-1, 3)
        self._marker(stamp, "keyframes", _LINE_STRIP, way, (0.12, 0.44, 0.71))
        self._marker(stamp, "loops", _LINE_LIST, ends, (0.16, 0.75, 0.36))

    def text(self, stamp: Stamp, level: Level, source: str, message: str) -> None:
        log = self._make(
            _LOG, stamp=self._time(stamp), level=_LEVELS[level], name=source, msg=message, file="", function="", line=0
        )
        self._write("/log", _LOG, log, stamp)

    def _marker(self, stamp: Stamp, name: str, kind: int, points: Vector, colour: tuple[float, float, float]) -> None:
        red, green, blue = colour
        message = self._make(
            _MARKER,
            header=self._header(stamp, "map"),
            ns=name,
            id=0,
            type=kind,
            action=0,
            pose=self._pose(Placed(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))),
            scale=self._vector(np.array([0.05, 0.0, 0.0])),
            color=self._make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=1.0),
            lifetime=self._make("builtin_interfaces/msg/Duration", sec=0, nanosec=0),
            frame_locked=False,
            points=[self._make("geometry_msgs/msg/Point", x=x, y=y, z=z) for x, y, z in points.tolist()],
            colors=[],
            texture_resource="",
            texture=self._make(
                "sensor_msgs/msg/CompressedImage",
                header=self._header(stamp, ""),
                format="",
                data=np.zeros(0, dtype=np.uint8),
            ),
            uv_coordinates=[],
            text="",
            mesh_resource="",
            mesh_file=self._make("visualization_msgs/msg/MeshFile", filename="", data=np.zeros(0, dtype=np.uint8)),
            mesh_use_embedded_materials=False,
        )
        self._write("/graph", _MARKER, message, stamp)

    def _make(self, name: str, /, **values: Any) -> Any:
        return self._store.types[name](**values)

    def _time(self, stamp: Stamp) -> Any:
        seconds, microseconds = divmod(stamp.utime, 1_000_000)
        return self._make("builtin_interfaces/msg/Time", sec=seconds, nanosec=microseconds * 1000)

    def _header(self, stamp: Stamp, frame: str) -> Any:
        return self._make("std_msgs/msg/Header", stamp=self._time(stamp), frame_id=frame)

    def _vector(self, values: Vector) -> Any:
        x, y, z = (float(value) for value in values)
        return self._make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

    def _quaternion(self, wxyz: Vector) -> Any:
        w, x, y, z = (float(value) for value in wxyz)
        return self._make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def _pose(self, placed: Placed) -> Any:
        x, y, z = (float(value) for value in placed.position)
        at = self._make("geometry_msgs/msg/Point", x=x, y=y, z=z)
        return self._make("geometry_msgs/msg/Pose", position=at, orientation=self._quaternion(placed.quaternion))

    def _write(self, topic: str, name: str, message: Any, stamp: Stamp) -> None:
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(topic, name, typestore=self._store)
        self.counts[topic] += 1
        self._writer.write(self._connections[topic], stamp.log_utime * 1000, self._store.serialize_cdr(message, name))
