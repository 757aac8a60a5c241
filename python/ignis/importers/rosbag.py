# SPDX-License-Identifier: Apache-2.0
"""ROS 1 bags, ROS 2 bags and MCAP files, through `rosbags`."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from ignis.errors import InputError
from ignis.importers.point_clouds import RawCloud, from_livox, from_point_cloud2, stamp_ns
from ignis.importers.point_times import WITHOUT, PointTimes, decide
from ignis.importers.recorder import Recorder
from ignis.progress import Progress

_IMU_TYPE = "sensor_msgs/msg/Imu"
_CLOUD_TYPE = "sensor_msgs/msg/PointCloud2"
_LIVOX_SUFFIX = "/CustomMsg"
_STANDARD_GRAVITY = 9.80665
# Bags of ROS 2 before Iron carry no definitions of their types; both generations of Livox drivers use these.
_LIVOX_PACKAGES = ("livox_ros_driver", "livox_ros_driver2", "livox_interfaces")
_LIVOX_POINT = "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line\n"
_LIVOX_CLOUD = (
    "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
    "{package}/CustomPoint[] points\n"
)
# How many messages of each kind the decisions about units rest on.
_PROBE_CLOUDS, _PROBE_IMU = 10, 200


def is_bag(path: Path) -> bool:
    """True for a ROS 2 bag folder and for .bag, .mcap and .db3 files, by content or name."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file() or any(path.glob("*.mcap")) or any(path.glob("*.db3"))
    return path.suffix in (".bag", ".mcap", ".db3")


def import_bag(
    path: Path, recorder: Recorder, cloud_topic: str | None, imu_topic: str | None, no_deskew: bool = False
) -> list[str]:
    """Hands one bag to the recorder; returns remarks for the user."""
    with _opened(path) as reader:
        cloud = _choose_topic(reader, cloud_topic, "cloud", _is_cloud_type, path)
        imu = _choose_topic(reader, imu_topic, "imu", lambda name: name == _IMU_TYPE, path)
        point_times, intensity_scale, intensity_text = _probe_clouds(reader, cloud, no_deskew)
        accel_scale, accel_text = _probe_imu(reader, imu)
        progress = Progress(f"importing {path.name}")
        span = max(reader.duration, 1)
        for topic, log_ns, message in _messages(reader, (cloud, imu)):
            if topic == imu:
                recorder.add_imu(*_imu_sample(message, accel_scale))
            else:
                raw = _raw_cloud(message, cloud, no_deskew)
                timed = np.isfinite(raw.times)
                instants = point_times.utime(raw.times[timed], raw.header_ns)
                recorder.add_scan(instants, raw.points[timed], raw.intensity[timed] * intensity_scale)
            progress.update((log_ns - reader.start_time) / span, f"{recorder.counts['L1_SCAN']} scans")
        progress.close()
    return [f"clouds from {cloud}, inertial data from {imu}", point_times.describe(), intensity_text, accel_text]


def _typestore() -> Typestore:
    store = get_typestore(Stores.ROS2_HUMBLE)
    for package in _LIVOX_PACKAGES:
        store.register(get_types_from_msg(_LIVOX_POINT, f"{package}/msg/CustomPoint"))
        store.register(get_types_from_msg(_LIVOX_CLOUD.format(package=package), f"{package}/msg/CustomMsg"))
    return store


@contextmanager
def _opened(path: Path) -> Iterator[AnyReader]:
    """Opens a bag; whatever the library finds wrong with it becomes one sentence."""
    if path.is_file() and path.suffix == ".db3" and (path.parent / "metadata.yaml").is_file():
        path = path.parent
    try:
        reader = AnyReader([path], default_typestore=_typestore())
        reader.open()
    except (KeyboardInterrupt, InputError):
        raise
    except Exception as error:  # The library lets many kinds of error out when a file is damaged.
        raise InputError(f"cannot read the bag {path}: {error}; is it whole (rosbag reindex, ros2 bag info)?") from None
    try:
        yield reader
    finally:
        reader.close()


def _is_cloud_type(name: str) -> bool:
    return name == _CLOUD_TYPE or name.endswith(_LIVOX_SUFFIX)


def _choose_topic(reader: AnyReader, wanted: str | None, option: str, fits: Any, path: Path) -> str:
    found = {c.topic: c.msgcount for c in reader.connections if fits(c.msgtype) and c.msgcount > 0}
    kind = "point cloud" if option == "cloud" else "inertial data (sensor_msgs/Imu)"
    if reader.message_count == 0:
        raise InputError(f"the bag {path} is empty")
    if wanted is not None:
        if wanted in found:
            return wanted
        raise InputError(f"{path} has no {kind} on {wanted}; it has {_listed(found)}")
    if not found:
        others = {c.topic: c.msgcount for c in reader.connections}
        raise InputError(f"{path} has no {kind}; its topics are {_listed(others)}")
    if len(found) > 1:
        raise InputError(f"{path} has several topics with {kind}; choose with --{option}: {_listed(found)}")
    return next(iter(found))


def _listed(topics: dict[str, int]) -> str:
    return ", ".join(f"{name} ({count} messages)" for name, count in sorted(topics.items())) or "none"


def _messages(reader: AnyReader, topics: tuple[str, ...]) -> Iterator[tuple[str, int, Any]]:
    connections = [c for c in reader.connections if c.topic in topics]
    try:
        for connection, log_ns, raw in reader.messages(connections=connections):
            yield connection.topic, log_ns, reader.deserialize(raw, connection.msgtype)
    except Exception as error:  # Only the library runs in here, and damaged bytes make it raise nearly anything.
        raise InputError(f"the bag is damaged: {error or type(error).__name__}") from None


def _raw_cloud(message: Any, topic: str, no_deskew: bool) -> RawCloud:
    try:
        if hasattr(message, "point_num"):
            return from_livox(message, no_deskew)
        return from_point_cloud2(message, topic, no_deskew)
    except (ValueError, LookupError, OverflowError) as error:
        raise InputError(f"a cloud of {topic} contradicts its own layout: {error}") from None


def _probe_clouds(reader: AnyReader, topic: str, no_deskew: bool) -> tuple[PointTimes, float, str]:
    clouds: list[RawCloud] = []
    for _, _, message in _messages(reader, (topic,)):
        cloud = _raw_cloud(message, topic, no_deskew)
        if len(cloud.points):
            clouds.append(cloud)
        if len(clouds) == _PROBE_CLOUDS:
            break
    if not clouds:
        raise InputError(f"all clouds of {topic} are empty")
    times = [(cloud.header_ns, cloud.times[np.isfinite(cloud.times)]) for cloud in clouds]
    point_times = WITHOUT if no_deskew else decide(clouds[0].time_name, times, topic)
    brightest = max(float(np.max(cloud.intensity, initial=0.0, where=np.isfinite(cloud.intensity))) for cloud in clouds)
    if 0.0 < brightest <= 1.0:
        return point_times, 255.0, "intensities are 0..1: multiplied by 255"
    if brightest > 255.0:
        return point_times, 1.0, f"intensities reach {brightest:.0f}: cut at 255"
    return point_times, 1.0, "intensities are 0..255"


def _probe_imu(reader: AnyReader, topic: str) -> tuple[float, str]:
    norms = []
    for _, _, message in _messages(reader, (topic,)):
        a = message.linear_acceleration
        norms.append(float(np.linalg.norm([a.x, a.y, a.z])))
        if len(norms) == _PROBE_IMU:
            break
    if not norms:
        raise InputError(f"no message of {topic} can be read; is the bag whole?")
    typical = float(np.median(norms))
    if 0.7 < typical < 1.4:
        return _STANDARD_GRAVITY, f"accelerations are in g (median {typical:.2f}): multiplied by {_STANDARD_GRAVITY}"
    return 1.0, f"accelerations are in m/s^2 (median {typical:.2f})"


def _imu_sample(message: Any, accel_scale: float) -> tuple[int, np.ndarray, np.ndarray]:
    w, a = message.angular_velocity, message.linear_acceleration
    utime = stamp_ns(message.header.stamp) // 1000
    return utime, np.array([w.x, w.y, w.z]), np.array([a.x, a.y, a.z]) * accel_scale
