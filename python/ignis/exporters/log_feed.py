# SPDX-License-Identifier: Apache-2.0
"""A log, message by message, into a sink: sensor data and what the live processes said."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ignis.exporters.axes import poses_to_ros, vectors_to_ros
from ignis.exporters.sink import Cloud, Level, Placed, Sink, Stamp
from ignis.logs import PartAssembler, joined_arrays, read_log
from ignis.poses import Poses
from ignis.progress import Progress

_IN_GRAPH = ("STAGE_ON_TRIAL", "STAGE_KEPT")


def feed_log(path: Path, sink: Sink) -> None:
    """Everything that the sink has a place for, in the order of recording."""
    feed = _LogFeed(sink)
    progress = Progress(f"exporting {path.name}")
    for count, (log_utime, channel, message) in enumerate(read_log(path)):
        feed.take(channel, message, Stamp(message.utime, log_utime))
        if count % 1000 == 0:
            progress.update(0.0, f"{count} messages")
    progress.close()


def placed(position: Any, quaternion: Any) -> Placed:
    """One pose in our axes to one in those of ROS."""
    poses = poses_to_ros(Poses(np.array([position], dtype=float), np.array([quaternion], dtype=float)))
    return Placed(poses.position[0], poses.quaternion[0])


def cloud_of(arrays: dict[str, NDArray[Any]], frame: str, at: Placed | None = None) -> Cloud:
    """Points of a scan_t or cloud_t whose parts are joined."""
    points = vectors_to_ros(np.stack([arrays[axis] for axis in "xyz"], axis=-1).astype(np.float32))
    times = arrays["dt_us"].astype(np.int32) if "dt_us" in arrays else None
    intensity = arrays["intensity"].astype(np.float32)
    cloud = Cloud(frame, points.astype(np.float32), intensity, times)
    return cloud if at is None else Cloud(frame, cloud.points, cloud.intensity, times, at)


class _LogFeed:
    """Remembers what later messages refer to: parts, keyframe positions, loops, the last words of each process."""

    def __init__(self, sink: Sink) -> None:
        self._sink = sink
        self._parts = {"L1_SCAN": PartAssembler(), "LIO_CLOUD": PartAssembler()}
        self._keyframes: dict[tuple[int, int], NDArray[np.float64]] = {}
        self._loops: set[tuple[int, int, int]] = set()
        self._said: dict[str, str] = {}

    def take(self, channel: str, message: Any, stamp: Stamp) -> None:
        handler = getattr(self, f"_on_{channel.lower()}", None)
        if handler is not None:
            handler(message, stamp)

    def _on_l1_imu(self, message: Any, stamp: Stamp) -> None:
        self._sink.imu(stamp, vectors_to_ros(np.array(message.gyro)), vectors_to_ros(np.array(message.accel)))

    def _on_l1_scan(self, message: Any, stamp: Stamp) -> None:
        if parts := self._parts["L1_SCAN"].add(message):
            self._sink.cloud("/l1/scan", stamp, cloud_of(joined_arrays(parts), "body"))

    def _on_lio_cloud(self, message: Any, stamp: Stamp) -> None:
        if parts := self._parts["LIO_CLOUD"].add(message):
            at = placed(message.position, message.quaternion)
            self._sink.cloud("/lio/cloud", stamp, cloud_of(joined_arrays(parts), "odom", at))

    def _on_lio_state(self, message: Any, stamp: Stamp) -> None:
        if not message.covariance_valid:  # At scan rate; the others lie between two of these.
            return
        at = placed(message.position, message.quaternion)
        self._sink.pose("/lio/pose", stamp, "odom", at)
        self._sink.transform(stamp, "odom", "body", at)

    def _on_smoothed_state(self, message: Any, stamp: Stamp) -> None:
        self._sink.pose("/smoothed/pose", stamp, "map", placed(message.position, message.quaternion))

    def _on_ground_truth(self, message: Any, stamp: Stamp) -> None:
        self._sink.pose("/ground_truth/pose", stamp, "world", placed(message.position, message.quaternion))

    def _on_smoothed_keyframes(self, message: Any, stamp: Stamp) -> None:
        at = placed(message.map_odom_position, message.map_odom_quaternion)
        self._sink.transform(stamp, "map", "odom", at)
        positions = vectors_to_ros(np.stack([message.px, message.py, message.pz], axis=-1).reshape(-1, 3))
        for number, position in zip(message.ids, positions, strict=True):
            self._keyframes[message.session, number] = np.asarray(position, dtype=np.float64)
        self._draw(stamp, message.session)

    def _on_loop_result(self, message: Any, stamp: Stamp) -> None:
        key = (message.session, message.from_id, message.to_id)
        stages = {getattr(type(message), name) for name in _IN_GRAPH}
        if message.stage in stages:
            self._loops.add(key)
        elif message.stage == type(message).STAGE_WITHDRAWN:
            self._loops.discard(key)
        if message.from_id >= 0:
            text = f"loop {message.from_id} to {message.to_id}: {message.reason_text}"
            self._sink.text(stamp, Level.INFO, "graph_backend", text)
            self._draw(stamp, message.session)

    def _on_lio_scan_stats(self, message: Any, stamp: Stamp) -> None:
        text = "scans are applied" if message.applied else f"scan not applied: {message.reason_text}"
        self._say(stamp, Level.INFO if message.applied else Level.WARNING, "lio_frontend", "scans", text)

    def _on_health(self, message: Any, stamp: Stamp) -> None:
        level = {0: Level.INFO, 1: Level.WARNING}.get(message.state, Level.ERROR)
        self._say(stamp, level, message.process, "health", message.state_text)

    def _on_l1_status(self, message: Any, stamp: Stamp) -> None:
        level = Level.INFO if message.state == type(message).RUNNING else Level.WARNING
        self._say(stamp, level, "l1_driver", "status", message.state_text)

    def _say(self, stamp: Stamp, level: Level, source: str, topic: str, text: str) -> None:
        """Only what is new: the same reason twenty times a second hides the others."""
        if self._said.get(f"{source}/{topic}") != text:
            self._said[f"{source}/{topic}"] = text
            self._sink.text(stamp, level, source, text)

    def _draw(self, stamp: Stamp, session: int) -> None:
        mine = sorted(key for key in self._keyframes if key[0] == session)
        way = np.array([self._keyframes[key] for key in mine]).reshape(-1, 3)
        ends = [((s, a), (s, b)) for s, a, b in sorted(self._loops) if s == session]
        known = [(a, b) for a, b in ends if a in self._keyframes and b in self._keyframes]
        self._sink.graph(stamp, way, [(self._keyframes[a], self._keyframes[b]) for a, b in known])
