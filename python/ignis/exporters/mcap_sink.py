# SPDX-License-Identifier: Apache-2.0
"""MCAP with Foxglove's schemas in Protobuf: opens in the usual viewers."""

from collections import Counter
from typing import IO, Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap_protobuf.writer import Writer

from ignis.exporters.sink import Cloud, Level, Placed, Stamp, Vector

_LOOP_COLOUR = (0.16, 0.75, 0.36, 1.0)
_WAY_COLOUR = (0.12, 0.44, 0.71, 1.0)


class McapSink:
    """Writes into an open binary stream; finish() completes the file."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._writer = Writer(stream)
        self.counts: Counter[str] = Counter()

    def finish(self) -> None:
        """Writes index and footer."""
        self._writer.finish()

    def imu(self, stamp: Stamp, gyro: Vector, accel: Vector) -> None:
        """Foxglove has no schema for inertial samples."""

    def cloud(self, topic: str, stamp: Stamp, cloud: Cloud) -> None:
        columns = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4")]
        columns += [("dt_us", "<i4")] if cloud.dt_us is not None else []
        rows = np.empty(len(cloud.points), dtype=columns)
        rows["x"], rows["y"], rows["z"] = cloud.points.T
        rows["intensity"] = cloud.intensity
        if cloud.dt_us is not None:
            rows["dt_us"] = cloud.dt_us
        message = PointCloud(frame_id=cloud.frame, point_stride=rows.itemsize, data=rows.tobytes())
        for index, (name, kind) in enumerate(columns):
            numeric = PackedElementField.INT32 if kind == "<i4" else PackedElementField.FLOAT32
            message.fields.add(name=name, offset=4 * index, type=numeric)
        _set_time(message.timestamp, stamp.utime)
        _set_pose(message.pose, cloud.placed)
        self._write(topic, message, stamp)

    def pose(self, topic: str, stamp: Stamp, frame: str, placed: Placed) -> None:
        message = PoseInFrame(frame_id=frame)
        _set_time(message.timestamp, stamp.utime)
        _set_pose(message.pose, placed)
        self._write(topic, message, stamp)

    def transform(self, stamp: Stamp, parent: str, child: str, placed: Placed) -> None:
        one = FrameTransform(parent_frame_id=parent, child_frame_id=child)
        _set_time(one.timestamp, stamp.utime)
        _set_vector(one.translation, placed.position)
        _set_quaternion(one.rotation, placed.quaternion)
        self._write("/tf", FrameTransforms(transforms=[one]), stamp)

    def graph(self, stamp: Stamp, way: Vector, loops: list[tuple[Vector, Vector]]) -> None:
        update = SceneUpdate()
        ends = np.array([end for pair in loops for end in pair]).reshape(-1, 3)
        for name, kind, points, colour in (
            ("keyframes", LinePrimitive.LINE_STRIP, way, _WAY_COLOUR),
            ("loops", LinePrimitive.LINE_LIST, ends, _LOOP_COLOUR),
        ):
            entity: SceneEntity = update.entities.add(id=name, frame_id="map")
            _set_time(entity.timestamp, stamp.utime)
            line = entity.lines.add(type=kind, thickness=3.0, scale_invariant=True)
            line.pose.orientation.w = 1.0
            line.color.r, line.color.g, line.color.b, line.color.a = colour
            for point in points:
                _set_vector(line.points.add(), point)
        self._write("/graph", update, stamp)

    def text(self, stamp: Stamp, level: Level, source: str, message: str) -> None:
        log = Log(level=int(level), name=source, message=message)  # type: ignore[arg-type]
        _set_time(log.timestamp, stamp.utime)
        self._write("/log", log, stamp)

    def _write(self, topic: str, message: Any, stamp: Stamp) -> None:
        self.counts[topic] += 1
        self._writer.write_message(topic, message, stamp.log_utime * 1000, stamp.utime * 1000)


def _set_time(time: Any, utime: int) -> None:
    time.seconds, microseconds = divmod(utime, 1_000_000)
    time.nanos = microseconds * 1000


def _set_vector(to: Any, values: Vector) -> None:
    to.x, to.y, to.z = (float(value) for value in values)


def _set_quaternion(to: Any, wxyz: Vector) -> None:
    to.w, to.x, to.y, to.z = (float(value) for value in wxyz)


def _set_pose(to: Any, placed: Placed) -> None:
    _set_vector(to.position, placed.position)
    _set_quaternion(to.orientation, placed.quaternion)
