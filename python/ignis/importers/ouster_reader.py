# SPDX-License-Identifier: Apache-2.0
"""Runs in the environment of the Ouster SDK: a packet capture in, arrays out on the output stream.

Knows nothing of our package. A line of JSON tells about the sensor; then follow records, a letter and arrays each:
I: instants [us], accelerations [m/s^2], angular rates [rad/s], in the axes of the inertial unit.
S: instants of the points [us], points in the sensor frame [m], reflectivity 0..255; one complete scan.
Usage: ouster_reader.py CAPTURE METADATA
"""

import json
import sys

import numpy as np
from ouster.sdk import core, pcap

# Bits of the column status: 1 means that the column arrived.
_COLUMN_VALID = 0x01


def send(kind, *arrays):
    """One record."""
    sys.stdout.buffer.write(kind)
    for array in arrays:
        np.save(sys.stdout.buffer, np.ascontiguousarray(array), allow_pickle=False)


def inertial(packet):
    """Newer firmware packs many samples into a packet, older has one."""
    accel, gyro = np.atleast_2d(packet.accel()), np.atleast_2d(packet.gyro())
    stamps = np.atleast_1d(packet.gyro_ts()).astype(np.int64) // 1000
    return stamps, accel.astype(float), gyro.astype(float)


def points(scan, positions, brightness):
    """Valid returns of the columns that arrived, each under its column's stamp."""
    hit = (scan.field("RANGE") > 0) & ((scan.status & _COLUMN_VALID) != 0)[None, :]
    instants = np.broadcast_to(scan.timestamp.astype(np.int64) // 1000, hit.shape)
    return instants[hit], positions(scan)[hit], brightness(scan)[hit].astype(float)


def reflectivity(scan):
    """0..255 in every profile that has it; black in the others."""
    if "REFLECTIVITY" not in scan.fields:
        return np.zeros((scan.h, scan.w))
    return np.clip(scan.field("REFLECTIVITY"), 0, 255)


def main(capture, metadata):
    """Reads the capture once, in the order of its packets."""
    with open(metadata, encoding="utf-8") as file:
        info = core.SensorInfo(file.read())
    about = {
        "product": info.prod_line,
        "imu_to_sensor": info.imu_to_sensor_transform.tolist(),
        "columns": info.w,
        "beams": info.h,
    }
    sys.stdout.buffer.write((json.dumps(about) + "\n").encode())
    positions = core.XYZLut(info, use_extrinsics=False)
    batcher, scan = core.ScanBatcher(info), core.LidarScan(info)
    for _, packet in pcap.PcapPacketSource(capture, sensor_info=[info]):
        if isinstance(packet, core.ImuPacket):
            send(b"I", *inertial(packet))
        elif isinstance(packet, core.LidarPacket) and batcher(packet, scan):
            send(b"S", *points(scan, positions, reflectivity))
            scan = core.LidarScan(info)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
