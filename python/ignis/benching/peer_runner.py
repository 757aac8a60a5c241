# SPDX-License-Identifier: Apache-2.0
"""Runs one peer over one drive. Executed by the peers' own Python, so it imports nothing of ours.

Input (npz): xyz (N, 3) float32 [m] and time_us (N,) of all points in forward-left-up axes, first (S + 1,) index of
each scan's first point; imu_us (M,), gyro (M, 3) [rad/s], accel (M, 3) [m/s^2]. Both sensors are already in the body
frame, so the extrinsics that a peer is told are the identity. Output: a TUM file of the pose at each scan's end in
forward-left-up axes, and JSON with processor seconds, milliseconds per scan and peak memory. Reading and writing are
not counted.

Most drives begin with a rest, and the peers are told so. RKO-LIO takes its biases from the inertial samples between
its first two scans: 50 ms of an L1 leave 0.014 rad/s of noise on the gyro bias, so its second scan is the end of the
rest. One scan of an L1 is 1,000 points on a pattern that turns from scan to scan; against a map of one such scan all
of them turn along with the pattern while the sensor stands still. Their first scan is therefore the whole rest. Where
there is no rest (--rest 0) they get the scans as they come, and RKO-LIO no phase of initialisation.
"""

import argparse
import dataclasses
import itertools
import json
import resource
import time
from pathlib import Path

import numpy as np

REST_S = 3.0


@dataclasses.dataclass(frozen=True)
class Sensor:
    """What the settings depend on."""

    min_range_m: float
    max_range_m: float
    sparse: bool  # too few points in one scan: scans are merged
    rest_s: float = REST_S  # the vehicle stands so long at first


SENSORS = {
    "l1": Sensor(min_range_m=0.2, max_range_m=15.0, sparse=True),
    "spinning": Sensor(min_range_m=1.0, max_range_m=80.0, sparse=False),
}


class RkoLio:
    """RKO-LIO. On L1 data a small voxel with its own double down-sampling keeps the map denser than the scan."""

    def __init__(self, drive, sensor):
        from rko_lio.config import LIOConfig
        from rko_lio.lio import LIO

        self.merge = 1
        self.drive = drive
        self.next_imu = 0
        self.lio = LIO(
            LIOConfig(
                voxel_size=0.15 if sensor.sparse else 0.5,
                max_range=sensor.max_range_m,
                min_range=sensor.min_range_m,
                initialization_phase=sensor.rest_s > 0.0,
                double_downsample=True,
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
    """KISS-ICP. Two scans of an L1 in one."""

    def __init__(self, drive, sensor):
        from kiss_icp.config import KISSConfig
        from kiss_icp.kiss_icp import KissICP

        self.merge = 2 if sensor.sparse else 1
        config = KISSConfig()
        config.data.max_range, config.data.min_range = sensor.max_range_m, sensor.min_range_m
        config.mapping.voxel_size = 0.25 if sensor.sparse else 0.5
        config.registration.max_num_threads = 1
        self.odometry = KissICP(config)

    def add(self, xyz, time_us):
        self.odometry.register_frame(xyz, _shares(time_us))
        return self.odometry.last_pose


class KissSlam:
    """KISS-SLAM, its odometry set as that of KISS-ICP."""

    def __init__(self, drive, sensor):
        from kiss_slam.config import KissSLAMConfig
        from kiss_slam.slam import KissSLAM

        self.merge = 2 if sensor.sparse else 1
        config = KissSLAMConfig()
        config.odometry.preprocessing.max_range = sensor.max_range_m
        config.odometry.preprocessing.min_range = sensor.min_range_m
        config.odometry.mapping.voxel_size = 0.25 if sensor.sparse else 0.5
        config.odometry.registration.max_num_threads = 1
        config.local_mapper.splitting_distance = 20.0 if sensor.sparse else 100.0
        self.slam = KissSLAM(config)

    def add(self, xyz, time_us):
        self.slam.process_scan(xyz, _shares(time_us))
        return None

    def poses(self):
        """Of every scan, after the loops."""
        self.slam.generate_new_node()
        return self.slam.poses


class GenzIcp:
    """GenZ-ICP. Two scans of an L1 in one."""

    def __init__(self, drive, sensor):
        from genz_icp.config import GenZConfig
        from genz_icp.genz_icp import GenZICP

        self.merge = 2 if sensor.sparse else 1
        config = GenZConfig()
        config.data.max_range, config.data.min_range, config.data.deskew = sensor.max_range_m, sensor.min_range_m, True
        config.registration.max_num_threads = 1
        self.odometry = GenZICP(config)

    def add(self, xyz, time_us):
        self.odometry.register_frame(xyz, _shares(time_us))
        return self.odometry.last_pose


class SmallGicp:
    """small_gicp's own scan-to-model odometry (its KITTI example): VGICP against a voxel map, constant velocity, no
    deskewing, so that its pose is that of the middle of a scan. Two scans of an L1 in one."""

    at_middle = True

    def __init__(self, drive, sensor):
        import small_gicp

        self.merge = 2 if sensor.sparse else 1
        self.small_gicp = small_gicp
        self.downsampling_m, self.voxel_m = (0.1, 0.5) if sensor.sparse else (0.25, 1.0)
        self.T_world_scan, self.T_last_scan = np.identity(4), np.identity(4)
        self.map = None

    def add(self, xyz, time_us):
        scan, _ = self.small_gicp.preprocess_points(xyz, self.downsampling_m, num_threads=1)
        if self.map is None:
            self.map = self.small_gicp.GaussianVoxelMap(self.voxel_m)
            self.map.insert(scan)
            return self.T_world_scan
        guess = self.T_world_scan @ self.T_last_scan
        pose = self.small_gicp.align(self.map, scan, guess, num_threads=1).T_target_source
        self.T_last_scan = np.linalg.inv(self.T_world_scan) @ pose
        self.T_world_scan = pose
        self.map.insert(scan, pose)
        return pose


PEERS = {"rko-lio": RkoLio, "kiss-icp": KissIcp, "kiss-slam": KissSlam, "genz-icp": GenzIcp, "small-gicp": SmallGicp}


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


def frames(first, time_us, merge, sensor):
    """(begin, end) indices of the points of each frame that a peer gets: the first scan, the rest of the standing
    phase (all of it where scans are sparse, its last scan where they are not), then `merge` scans at a time."""
    if sensor.rest_s == 0.0:
        return list(itertools.pairwise(first[::merge]))
    begins = time_us[first[:-1]]
    rest = max(int(np.searchsorted(begins, begins[0] + sensor.rest_s * 1e6)), 2)
    standing = [(first[0], first[1]), (first[1] if sensor.sparse else first[rest - 1], first[rest])]
    return standing + list(itertools.pairwise(first[rest::merge]))


def run(name, drive, sensor):
    """Stamps and poses of all frames, and what they cost. Milliseconds are per scan of the sensor."""
    peer = PEERS[name](drive, sensor)
    stamps, poses, milliseconds = [], [], []
    cpu = 0.0
    for begin, end in frames(drive["first"], drive["time_us"], peer.merge, sensor):
        if begin == end:
            continue
        xyz = drive["xyz"][begin:end].astype(np.float64)
        time_us = drive["time_us"][begin:end]
        wall_began, cpu_began = time.perf_counter(), time.process_time()
        pose = peer.add(xyz, time_us)
        milliseconds.append((time.perf_counter() - wall_began) * 1e3)
        cpu += time.process_time() - cpu_began
        at_middle = getattr(peer, "at_middle", False)
        stamps.append(int(np.median(time_us) if at_middle else time_us.max()))
        poses.append(None if pose is None else np.array(pose))
    if hasattr(peer, "poses"):
        poses = peer.poses()[: len(stamps)]
        stamps = stamps[: len(poses)]
    cost = {
        "cpu_s": cpu,
        "scan_p50_ms": float(np.median(milliseconds)) / peer.merge,
        "scan_p99_ms": float(np.percentile(milliseconds, 99)) / peer.merge,
        "merged_scans": peer.merge,
    }
    return stamps, poses, cost


def main():
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("peer", choices=sorted(PEERS))
    parser.add_argument("sensor", choices=sorted(SENSORS))
    parser.add_argument("drive", type=Path)
    parser.add_argument("out", type=Path, help="folder for trajectory.tum and cost.json")
    parser.add_argument("--rest", type=float, default=REST_S, help="the vehicle stands for so many seconds at first")
    arguments = parser.parse_args()
    with np.load(arguments.drive) as file:
        drive = {key: file[key] for key in file.files}
    input_mb = sum(array.nbytes for array in drive.values()) / 2**20
    stamps, poses, cost = run(
        arguments.peer, drive, dataclasses.replace(SENSORS[arguments.sensor], rest_s=arguments.rest)
    )
    # The whole drive lies in memory here, which is no fault of the peer.
    cost["peak_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0 - input_mb
    arguments.out.mkdir(parents=True, exist_ok=True)
    _write_tum(arguments.out / "trajectory.tum", stamps, poses)
    (arguments.out / "cost.json").write_text(json.dumps(cost, indent=2) + "\n")


if __name__ == "__main__":
    main()
