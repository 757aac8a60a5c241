# SPDX-License-Identifier: Apache-2.0
"""Messages and datagrams that nobody should send, seeded, for every channel that one of our processes listens to."""

from __future__ import annotations

import math
import random
import socket
import struct
from collections.abc import Iterator
from typing import Any

import ignis_lcm.ignis as types

GROUP = "239.255.76.67"
WHOLE, FRAGMENT = 0x4C433032, 0x4C433033  # "LC02" and "LC03"
LARGEST, SMALLEST = 2**31 - 1, -(2**31)
FAR_FUTURE = 2**58  # [us] a stamp that is possible, 9000 years from now

# Everything that the four processes subscribe to.
CHANNELS: dict[str, Any] = {
    "L1_IMU": types.imu_t,
    "L1_SCAN": types.scan_t,
    "KEYFRAME_REQUEST": types.keyframe_request_t,
    "CLOUD_REQUEST": types.keyframe_request_t,
    "LIO_COMMAND": types.lio_command_t,
    "LIO_KEYFRAME": types.keyframe_t,
    "LIO_STATE": types.state_t,
    "LIO_CLOUD": types.cloud_t,
    "LIO_CLOUD_AGAIN": types.cloud_t,
    "LIO_SCAN_STATS": types.scan_stats_t,
    "GRAPH_COMMAND": types.graph_command_t,
    "SMOOTHED_KEYFRAMES": types.smoothed_keyframes_t,
    "LOOP_RESULT": types.loop_result_t,
    "HEALTH": types.health_t,
}


def sample(kind: Any) -> Any:
    """A message of this type with something in each of its arrays."""
    message = kind()
    if kind in (types.scan_t, types.cloud_t):
        message.part_count, message.num_points = 1, 2
        message.x = message.y = message.z = message.intensity = [1.0, 2.0]
        if kind is types.scan_t:
            message.dt_us = [0, 10]
    elif kind is types.keyframe_t:
        message.part_count, message.num_imu, message.num_points, message.resolution = 1, 1, 2, 0.001
        message.imu_dt_us = [0]
        for name in ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"):
            setattr(message, name, [0.5])
        message.x = message.y = message.z = [1, 2]
        message.intensity = b"\x01\x02"
    elif kind is types.keyframe_request_t:
        message.num_ids, message.ids = 3, [0, 1, 2]
    elif kind is types.smoothed_keyframes_t:
        message.part_count, message.num_keyframes, message.ids = 1, 1, [0]
        for name in ("px", "py", "pz", "qw", "qx", "qy", "qz"):
            setattr(message, name, [0.0])
    elif kind is types.health_t:
        message.num_receivers, message.channels = 1, ["X"]
        message.received = message.lost = message.rejected = message.queue_drops = [1]
    if hasattr(message, "quaternion"):
        message.quaternion = [1.0, 0.0, 0.0, 0.0]
    return message


def malformed(channel: str, generator: random.Random) -> Iterator[bytes]:
    """Bodies that no decoder may see: another type, cut, lengthened, or counts that the size contradicts."""
    kind = CHANNELS[channel]
    body = sample(kind).encode()
    fingerprint = body[:8]
    yield b""
    yield body[:3]
    yield fingerprint
    yield fingerprint + generator.randbytes(60_000)
    yield generator.randbytes(500)
    for _ in range(4):
        yield body[: generator.randrange(8, len(body))]
    yield body + b"\0"
    yield sample(types.pose_t).encode()
    other = generator.choice([each for each in CHANNELS.values() if each is not kind])
    yield sample(other).encode()
    if kind in (types.keyframe_t, types.health_t, types.smoothed_keyframes_t):
        # The last count before the arrays: at any place where a small number stands, a huge one instead.
        for at in range(8, len(body) - 3, 4):
            if 0 < struct.unpack_from(">i", body, at)[0] < 10:
                yield body[:at] + struct.pack(">i", generator.choice([-1, SMALLEST, LARGEST, 2**29])) + body[at + 4 :]


def unbelievable(channel: str, generator: random.Random) -> Iterator[bytes]:
    """Well-formed messages whose content must be refused: not finite, or stamped thousands of years from now."""
    bad = generator.choice([math.nan, math.inf, -math.inf])
    message = sample(CHANNELS[channel])
    if channel == "L1_IMU":
        for field in ("gyro", "accel"):
            getattr(message, field)[generator.randrange(3)] = generator.choice([bad, 1e30])
            yield message.encode()
        whole = sample(types.imu_t)
        whole.utime, whole.accel = FAR_FUTURE + generator.randrange(2**57), [0.0, 9.8, 0.0]
        yield whole.encode()
        whole.utime = generator.choice([2**63 - 1, -(2**63)])
        yield whole.encode()
    elif channel == "L1_SCAN":
        message.utime = FAR_FUTURE + generator.randrange(2**57)
        message.x = [bad, 1e30]
        yield message.encode()
    elif channel == "LIO_STATE":
        message.position = [bad, 0.0, 0.0]
        message.session = generator.randrange(2)
        yield message.encode()
        whole = sample(types.state_t)
        whole.utime = FAR_FUTURE + generator.randrange(2**57)
        yield whole.encode()
    elif channel == "LIO_KEYFRAME":
        # It seems to belong to this drive, to an earlier one, or to one that nobody has begun.
        message.position = [bad, 0.0, 0.0]
        message.id = message.sequence = generator.choice([0, 1, 2, LARGEST])
        message.session = generator.choice([0, 1, LARGEST])
        yield message.encode()
        message.part_count, message.part = LARGEST % 65536 // 2, generator.randrange(9)
        yield message.encode()
    elif channel == "LIO_CLOUD":
        message.position, message.session = [bad, 0.0, 0.0], generator.choice([0, LARGEST])
        yield message.encode()
    elif channel == "SMOOTHED_KEYFRAMES":
        message.map_odom_quaternion, message.session = [bad, 0.0, 0.0, 0.0], generator.choice([0, LARGEST])
        yield message.encode()
    elif channel == "LIO_COMMAND":
        # Another session, a stamp long past, no command.
        message.session, message.utime = generator.choice([-1, 1, LARGEST]), FAR_FUTURE
        yield message.encode()
        message.session, message.utime = 0, 0
        yield message.encode()
        message.command, message.utime = 77, FAR_FUTURE
        yield message.encode()
    elif channel == "GRAPH_COMMAND":
        message.command, message.session = 77, -1
        message.from_id, message.to_id = generator.choice([SMALLEST, LARGEST]), SMALLEST
        yield message.encode()


def altered_words(channel: str, generator: random.Random, count: int) -> Iterator[bytes]:
    """Right type and length, any word of the body replaced: some are refused, others are believed; none may kill."""
    body = sample(CHANNELS[channel]).encode()
    for _ in range(count):
        at = 8 + 4 * generator.randrange((len(body) - 8) // 4)
        word = generator.choice([-1, 0, 1, SMALLEST, LARGEST, 0x7F800000, 0x7FC00000, generator.randrange(2**31)])
        yield body[:at] + struct.pack(">i", word) + body[at + 4 :]


def datagrams(generator: random.Random) -> list[bytes]:
    """Datagrams that LCM itself never sends."""
    first = struct.pack(">IIIIHH", FRAGMENT, 1, 1024, 0, 0, 3) + b"L1_IMU\0" + b"x" * 64
    # Offset and size add up to a small number in 32 bits.
    wrapping = struct.pack(">IIIIHH", FRAGMENT, 1, 1024, 0xFFFFFFF0, 1, 2) + b"x" * 32
    return [
        b"",
        b"L",
        struct.pack(">II", WHOLE, 1),
        struct.pack(">II", WHOLE, 1) + b"L1_IMU",  # no terminator: the channel runs on into old memory
        struct.pack(">II", WHOLE, 1) + b"A" * 500 + b"\0",
        struct.pack(">II", WHOLE, 1) + b"\0",
        struct.pack(">IIIIHH", FRAGMENT, 1, 2**28, 0, 0, 2) + b"L1_IMU\0",  # 256 MB announced
        struct.pack(">IIIIHH", FRAGMENT, 2, 0, 0, 0, 0) + b"L1_IMU\0",
        struct.pack(">IIII", FRAGMENT, 3, 100, 2**32 - 60),  # shorter than its own header
        first,
        wrapping,
        struct.pack(">IIIIHH", FRAGMENT, 4, 1024, 0x80000000, 1, 2) + generator.randbytes(1000),
        generator.randbytes(1400),
        generator.randbytes(60_000),
    ]


def send_datagrams(data: list[bytes], port: int = 7667) -> None:
    """To the bus, past LCM."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as raw:
        raw.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        for each in data:
            raw.sendto(each, (GROUP, port))
