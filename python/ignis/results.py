# SPDX-License-Identifier: Apache-2.0
"""From the log of a live run to a results folder: trajectories, tables and a summary.

Trajectories have one row per scan. A scan's smoothed pose is its odometry pose under the correction of its keyframe,
C_i = T_map_keyframe * inverse(T_odom_keyframe), interpolated to the next keyframe's; before the first and after the
last keyframe the nearest correction holds. lio_replay follows the same rule.
"""

import csv
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ignis.errors import InputError
from ignis.files import replacing
from ignis.logs import LogDamage, read_log
from ignis.poses import Poses, Trajectory, between, make_trajectory, write_tum

_CHANNELS = (
    "LIO_SCAN_STATS",
    "LIO_KEYFRAME",
    "SMOOTHED_KEYFRAMES",
    "LOOP_RESULT",
    "GROUND_TRUTH",
    "HEALTH",
    "MAP_STATUS",
)
# Outcomes whose message carries no usable pose.
_POSELESS = ("NOT_INITIALISED", "BAD_STAMP", "SESSION_ENDED", "BEHIND")
# Fields of the tables that are arrays in the message.
_SCAN_ARRAYS = ("observability", "position", "quaternion")
_LOOP_ARRAYS = ("relative_position", "relative_quaternion")

Row = tuple[int, Any, Any]  # utime, position, quaternion
KeyframeId = tuple[int, int]  # session, id


@dataclass
class RunContent:
    """What a recorded run says, message by message."""

    scan_stats: list[Any] = field(default_factory=list)
    loops: list[Any] = field(default_factory=list)
    odom_keyframes: dict[KeyframeId, Row] = field(default_factory=dict)
    map_keyframes: dict[KeyframeId, tuple[Any, Any]] = field(default_factory=dict)
    truth: list[Row] = field(default_factory=list)
    health: dict[str, Any] = field(default_factory=dict)  # newest of each process
    map_status: Any = None
    damage: LogDamage = field(default_factory=LogDamage)


def read_run(log: Path) -> RunContent:
    """Reads a log recorded during a live run (or written by a replay)."""
    content = RunContent()
    for _, channel, message in read_log(log, _CHANNELS, content.damage):
        _take(content, channel, message)
    return content


def _take(content: RunContent, channel: str, message: Any) -> None:
    if channel == "LIO_SCAN_STATS":
        content.scan_stats.append(message)
    elif channel == "LOOP_RESULT":
        content.loops.append(message)
    elif channel == "GROUND_TRUTH":
        content.truth.append((message.utime, message.position, message.quaternion))
    elif channel == "HEALTH":
        content.health[message.process] = message
    elif channel == "MAP_STATUS":
        content.map_status = message
    elif channel == "LIO_KEYFRAME":
        row = (message.utime, message.position, message.quaternion)
        content.odom_keyframes[message.session, message.id] = row
    elif channel == "SMOOTHED_KEYFRAMES":
        for index, keyframe in enumerate(message.ids):
            position = (message.px[index], message.py[index], message.pz[index])
            quaternion = (message.qw[index], message.qx[index], message.qy[index], message.qz[index])
            content.map_keyframes[message.session, keyframe] = (position, quaternion)


def smoothed(odometry: Trajectory, keyframe_utime: np.ndarray, odom: Poses, corrected: Poses) -> Trajectory:
    """Applies the corrections of keyframes (sorted by stamp) to an odometry trajectory."""
    corrections = corrected @ odom.inverse()
    return Trajectory(odometry.utime, between(corrections, keyframe_utime, odometry.utime) @ odometry.poses)


def eskf_trajectory(content: RunContent) -> Trajectory:
    """The front end's pose after each scan, in odom."""
    usable = [m for m in content.scan_stats if constant_name(m, m.reason) not in _POSELESS]
    if not usable:
        raise InputError("the log holds no scan that the front end placed (channel LIO_SCAN_STATS)")
    return make_trajectory([(m.utime, m.position, m.quaternion) for m in usable])


def smoothed_trajectory(content: RunContent, eskf: Trajectory) -> Trajectory:
    """The back end's pose at the stamps of `eskf`, each session under its own corrections."""
    session_of = {m.utime: m.session for m in reversed(content.scan_stats)}
    sessions = np.array([session_of[utime] for utime in eskf.utime.tolist()])
    position, quaternion = eskf.poses.position.copy(), eskf.poses.quaternion.copy()
    for session in np.unique(sessions):
        both = [key for key in content.odom_keyframes if key[0] == session and key in content.map_keyframes]
        if not both:
            continue
        odom = make_trajectory([content.odom_keyframes[key] for key in both])
        corrected = make_trajectory([(content.odom_keyframes[key][0], *content.map_keyframes[key]) for key in both])
        chosen = sessions == session
        part = smoothed(Trajectory(eskf.utime[chosen], eskf.poses[chosen]), odom.utime, odom.poses, corrected.poses)
        position[chosen], quaternion[chosen] = part.poses.position, part.poses.quaternion
    return Trajectory(eskf.utime, Poses(position, quaternion))


def write_results(log: Path, folder: Path) -> dict[str, Any]:
    """Writes eskf.tum, smoothed.tum, ground_truth.tum (if recorded) and both tables; returns a summary."""
    content = read_run(log)
    folder.mkdir(parents=True, exist_ok=True)
    _write_table(folder / "scan_stats.csv", content.scan_stats, _SCAN_ARRAYS)
    _write_table(folder / "loops.csv", content.loops, _LOOP_ARRAYS)
    eskf = eskf_trajectory(content)
    write_tum(folder / "eskf.tum", eskf)
    write_tum(folder / "smoothed.tum", smoothed_trajectory(content, eskf))
    if content.truth:
        write_tum(folder / "ground_truth.tum", make_trajectory(content.truth).at(eskf.utime))
    return summary(content)


def summary(content: RunContent) -> dict[str, Any]:
    """Counts of a run: scans and why they were rejected, loops, voxels, messages lost per receiver."""
    stats, status = content.scan_stats, content.map_status
    times = [m.time_spent_ms for m in stats if m.reason != m.BEHIND]  # those that were left out took none
    reasons = Counter(constant_name(m, m.reason).lower() for m in stats if not m.applied)
    return {
        "duration_s": (stats[-1].utime - stats[0].utime) * 1e-6 if stats else 0.0,
        "scans": len(stats),
        "applied": sum(m.applied for m in stats),
        "rejected": dict(sorted(reasons.items())),
        "sessions": len({m.session for m in stats}),
        "time_per_scan_ms": {"median": float(np.median(times)), "p99": float(np.percentile(times, 99))}
        if times
        else None,
        "keyframes": len(content.odom_keyframes),
        "keyframes_in_graph": len(content.map_keyframes),
        "loops": {
            "accepted": sum(m.accepted for m in content.loops),
            "by_reason": dict(Counter(constant_name(m, m.reason).lower() for m in content.loops)),
        },
        "voxels": None
        if status is None
        else {"local": status.voxels_local, "mid": status.voxels_mid, "coarse": status.voxels_coarse},
        "map_rebuilds": None if status is None else status.rebuilds,
        "receivers": _receivers(content.health.values()),
        "lost": sum(sum(m.lost) for m in content.health.values()),
        "health": {name: m.state_text for name, m in sorted(content.health.items())},
        "log_damage": {"skipped_bytes": content.damage.skipped_bytes, "undecodable": content.damage.undecodable},
    }


def _receivers(health: Iterable[Any]) -> dict[str, dict[str, dict[str, int]]]:
    return {
        message.process: {
            channel: {
                "received": message.received[i],
                "lost": message.lost[i],
                "rejected": message.rejected[i],
                "queue_drops": message.queue_drops[i],
            }
            for i, channel in enumerate(message.channels)
        }
        for message in sorted(health, key=lambda m: m.process)
    }


def constant_name(message: Any, value: int) -> str:
    """The name of an enumeration constant of a message type: of its reasons, where it has stages as well."""
    names = (n for n in dir(type(message)) if n.isupper() and not n.startswith(("_", "STAGE_")))
    constants = {getattr(type(message), n): n for n in names}
    return constants.get(value, f"CODE_{value}")


def _write_table(path: Path, messages: list[Any], arrays: tuple[str, ...]) -> None:
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        for number, message in enumerate(messages):
            values: dict[str, Any] = {}
            for name in message.__slots__:
                value = getattr(message, name)
                if name in arrays:
                    values.update({f"{name}_{index}": item for index, item in enumerate(value)})
                else:
                    values[name] = value
            if number == 0:
                writer.writerow(values)
            writer.writerow(values.values())
