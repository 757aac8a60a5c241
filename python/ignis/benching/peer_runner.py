# SPDX-License-Identifier: Apache-2.0
"""Runs one peer over one drive. Executed by the peers' own Python, so it imports nothing of ours.

Input (npz): xyz (N, 3) float32 [m] and time_us (N,) of all points in forward-left-up axes, first (S + 1,) index of
each scan's first point; imu_us (M,), gyro (M, 3) [rad/s], accel (M, 3) [m/s^2]. Output: a TUM file of the pose at each
scan's end in forward-left-up axes, and JSON with processor seconds, milliseconds per scan and peak memory. Reading and
writing are not counted.
"""

import argparse
import itertools
import json
import resource
import time
from pathlib import Path

import numpy as np

MAX_RANGE_M = 15.0
MIN_RANGE_M = 0.3


class RkoLio:
    """RKO-LIO with its parameters fitted to the L1's range and density."""

    merge = 1

    def __init__(self, drive):
        from rko_lio.config import LIOConfig
        from rko_lio.lio import LIO

        self.drive = drive
        self.next_imu = 0
        self.lio = LIO(
            LIOConfig(
                voxel_size=0.3,
                max_range=MAX_RANGE_M,
                min_range=MIN_RANGE_M,
                initialization_phase=True,
                double_downsample=False,
                max_num_threads=1,
            )
        )

    def add(self, xyz, time_us):
        end = time_us.max()
        while self.next_imu < len(self.drive["imu_us"]) and self.drive["imu_us"][self.next_imu] <= end:
            i = self.next_imu
            self.lio.add_imu_measurement(
                self.drive["accel"][i], self.drive["gyro"][i], int(self.drive["imu_us"][i]) * 1000
            )
            self.next_imu += 1
        self.lio.register_scan(xyz, time_us * 1000)
        return self.lio.pose()


class KissIcp:
    """KISS-ICP on pairs of scans: one scan of an L1 is too little for it."""

    merge = 2

    def __init__(self, drive):
        from kiss_icp.config import KISSConfig
        from kiss_icp.kiss_icp import KissICP

        config = KISSConfig()
        config.data.max_range, config.data.min_range = MAX_RANGE_M, MIN_RANGE_M
        config.mapping.voxel_size = 0.25
        config.registration.max_num_threads = 1
        self.odometry = KissICP(config)

    def add(self, xyz, time_us):
        self.odometry.register_frame(xyz, _shares(time_us))
        return self.odometry.last_pose


class KissSlam:
    """KISS-SLAM on pairs of scans, with the voxel sizes of its odometry scaled to the range."""

    merge = 2

    def __init__(self, drive):
        from kiss_slam.config import KissSLAMConfig
        from kiss_slam.slam import KissSLAM

        config = KissSLAMConfig()
        config.odometry.preprocessing.max_range = MAX_RANGE_M
        config.odometry.preprocessing.min_range = MIN_RANGE_M
        config.odometry.mapping.voxel_size = 0.25
        config.odometry.registration.max_num_threads = 1
        config.local_mapper.splitting_distance = 20.0
        self.slam = KissSLAM(config)

    def add(self, xyz, time_us):
        self.slam.process_scan(xyz, _shares(time_us))
        return None

    def poses(self):
        """Of every scan, after the loops."""
        self.slam.generate_new_node()
        return self.slam.poses


class GenzIcp:
    """GenZ-ICP on pairs of scans."""

    merge = 2

    def __init__(self, drive):
        from genz_icp.config import GenZConfig
        from genz_icp.genz_icp import GenZICP

        config = GenZConfig()
        config.data.max_range, config.data.min_range, config.data.deskew = MAX_RANGE_M, MIN_RANGE_M, True
        config.registration.max_num_threads = 1
        self.odometry = GenZICP(config)

    def add(self, xyz, time_us):
        self.odometry.register_frame(xyz, _shares(time_us))
        return self.odometry.last_pose


PEERS = {"rko-lio": RkoLio, "kiss-icp": KissIcp, "kiss-slam": KissSlam, "genz-icp": GenzIcp}


def _shares(time_us):
    """Time of each point as a share of the scan, 0 to 1."""
    return (time_us - time_us.min()) / max(int(np.ptp(time_us)), 1)


def _quaternion(r):
    """(x, y, z, w) of a rotation matrix: the eigenvector of Bar-Itzhack's matrix (JGCD 2000) to the largest value."""
    k = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2], r[2, 1] - r[1, 2]],
            [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
            [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    return np.linalg.eigh(k)[1][:, 3]


def _write_tum(path, times_us, poses):
    with path.open("w") as file:
        for utime, pose in zip(times_us, poses, strict=True):
            row = [utime * 1e-6, *pose[:3, 3], *_quaternion(pose[:3, :3])]
            file.write(" ".join(f"{value:.9f}" for value in row) + "\n")


def run(name, drive):
    """Stamps and poses of all scans, and what they cost."""
    peer = PEERS[name](drive)
    first = drive["first"][:: peer.merge]
    stamps, poses, milliseconds = [], [], []
    cpu = 0.0
    for begin, end in itertools.pairwise(first):
        xyz = drive["xyz"][begin:end].astype(np.float64)
        time_us = drive["time_us"][begin:end]
        if len(xyz) == 0:
            continue
        wall_began, cpu_began = time.perf_counter(), time.process_time()
        pose = peer.add(xyz, time_us)
        milliseconds.append((time.perf_counter() - wall_began) * 1e3)
        cpu += time.process_time() - cpu_began
        stamps.append(int(time_us.max()))
        poses.append(None if pose is None else np.array(pose))
    if hasattr(peer, "poses"):
        poses = peer.poses()[: len(stamps)]
        stamps = stamps[: len(poses)]
    cost = {
        "cpu_s": cpu,
        "scan_median_ms": float(np.median(milliseconds)) / peer.merge,
        "scan_p99_ms": float(np.percentile(milliseconds, 99)) / peer.merge,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        "merged_scans": peer.merge,
    }
    return stamps, poses, cost


def main():
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("peer", choices=sorted(PEERS))
    parser.add_argument("drive", type=Path)
    parser.add_argument("out", type=Path, help="folder for trajectory.tum and cost.json")
    arguments = parser.parse_args()
    with np.load(arguments.drive) as file:
        drive = {key: file[key] for key in file.files}
    stamps, poses, cost = run(arguments.peer, drive)
    arguments.out.mkdir(parents=True, exist_ok=True)
    _write_tum(arguments.out / "trajectory.tum", stamps, poses)
    (arguments.out / "cost.json").write_text(json.dumps(cost, indent=2) + "\n")


if __name__ == "__main__":
    main()
