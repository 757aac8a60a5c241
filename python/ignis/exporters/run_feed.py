# SPDX-License-Identifier: Apache-2.0
"""The results of a replay into a sink: both trajectories, reasons, the graph, the map, and the scans of its log."""

import heapq
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ignis.clouds import read_ply
from ignis.exporters.axes import poses_to_ros, trajectory_to_ros, vectors_to_ros
from ignis.exporters.log_feed import cloud_of
from ignis.exporters.sink import Cloud, Level, Placed, Sink, Stamp
from ignis.logs import PartAssembler, joined_arrays, read_log
from ignis.poses import Trajectory
from ignis.run_folder import Run

Telling = Callable[[Sink, Stamp], None]
Action = tuple[int, Telling]


def feed_run(run: Run, sink: Sink) -> None:
    """In the order of the stamps; graph and map are what they are at the end, and stand there."""
    sources = [
        _poses(trajectory_to_ros(run.eskf), "/lio/pose", "odom"),
        _transforms(run),
        _poses(trajectory_to_ros(run.smoothed), "/smoothed/pose", "map"),
        _reasons(run),
    ]
    if run.truth is not None:
        sources.append(_poses(trajectory_to_ros(run.truth), "/ground_truth/pose", "world"))
    if run.log is not None:
        sources.append(_scans(run.log, int(run.eskf.utime[-1])))
    for utime, action in heapq.merge(*sources, key=lambda item: item[0]):
        action(sink, Stamp(utime, utime))
    end = Stamp(int(run.eskf.utime[-1]), int(run.eskf.utime[-1]))
    _graph(run, sink, end)
    _loops(run, sink, end)
    if (run.folder / "map.ply").is_file():
        points, intensity = read_ply(run.folder / "map.ply")
        in_ros = vectors_to_ros(points).astype(np.float32)
        sink.cloud("/map", end, Cloud("map", in_ros, intensity.astype(np.float32)))


def _pose(topic: str, frame: str, at: Placed) -> Telling:
    return lambda sink, stamp: sink.pose(topic, stamp, frame, at)


def _transform(parent: str, child: str, at: Placed) -> Telling:
    return lambda sink, stamp: sink.transform(stamp, parent, child, at)


def _text(level: Level, source: str, text: str) -> Telling:
    return lambda sink, stamp: sink.text(stamp, level, source, text)


def _cloud(topic: str, cloud: Cloud) -> Telling:
    return lambda sink, stamp: sink.cloud(topic, stamp, cloud)


def _poses(trajectory: Trajectory, topic: str, frame: str) -> Iterator[Action]:
    poses = trajectory.poses
    for utime, position, quaternion in zip(trajectory.utime.tolist(), poses.position, poses.quaternion, strict=True):
        yield utime, _pose(topic, frame, Placed(position, quaternion))


def _transforms(run: Run) -> Iterator[Action]:
    """odom to body, and the correction of every instant: T_map_odom = T_map_body * inverse(T_odom_body)."""
    odom = poses_to_ros(run.eskf.poses)
    correction = poses_to_ros(run.smoothed.poses) @ odom.inverse()
    for index, utime in enumerate(run.eskf.utime.tolist()):
        yield utime, _transform("odom", "body", Placed(odom.position[index], odom.quaternion[index]))
        yield utime, _transform("map", "odom", Placed(correction.position[index], correction.quaternion[index]))


def _reasons(run: Run) -> Iterator[Action]:
    before = ""
    for utime, applied, reason in zip(
        run.scans["utime"].tolist(), run.scans["applied"].tolist(), run.scans["reason"].tolist(), strict=True
    ):
        text = "scans are applied" if applied else f"scan not applied: {reason}"
        if text != before:
            yield utime, _text(Level.INFO if applied else Level.WARNING, "lio_frontend", text)
        before = text


def _scans(log: Path, until: int) -> Iterator[Action]:
    """At their end, where the pose of their instant stands; not deskewed."""
    parts = PartAssembler()
    for _, _, message in read_log(log, ("L1_SCAN",)):
        end = message.utime + message.duration_us
        if (whole := parts.add(message)) and end <= until:
            arrays = {name: values for name, values in joined_arrays(whole).items() if name != "dt_us"}
            yield end, _cloud("/l1/scan", cloud_of(arrays, "body"))


def _way(run: Run) -> NDArray[np.float64]:
    """[m] Keyframes in order. Where some are missing from the graph, as on a long drive, a line through the others
    would cut corners: the smoothed way then."""
    is_whole = all(b == a + 1 for a, b in run.graph.odometry)
    return (run.graph.poses if is_whole else run.smoothed.poses).position


def _graph(run: Run, sink: Sink, stamp: Stamp) -> None:
    def position(vertex: int) -> Any:
        return vectors_to_ros(run.graph.position_of(vertex))

    way = vectors_to_ros(_way(run))
    sink.graph(stamp, np.asarray(way, dtype=np.float64), [(position(a), position(b)) for a, b in run.graph.loops])


def _loops(run: Run, sink: Sink, stamp: Stamp) -> None:
    rows = zip(run.loops["from_id"].tolist(), run.loops["to_id"].tolist(), run.loops["reason"].tolist(), strict=True)
    for start, end, reason in rows:
        if start >= 0:
            sink.text(stamp, Level.INFO, "graph_backend", f"loop {start} to {end}: {reason}")
