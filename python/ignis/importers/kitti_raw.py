# SPDX-License-Identifier: Apache-2.0
"""KITTI raw drives: Velodyne HDL-64E scans and OXTS inertial data.

The body frame sits at the inertial unit. Scans carry no per-point time; the HDL-64E turns clockwise seen from above and
begins at the rear, hence t = t_start + (pi - atan2(y, x)) / (2 pi) * (t_end - t_start).
"""

import calendar
import lzma
import tarfile
import time
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ignis.errors import InputError
from ignis.importers.recorder import Recorder
from ignis.mounts import R_OURS_FROM_ENU, R_OURS_FROM_FLU, Extrinsics, Mount, yaw_pitch_roll_from_rotation
from ignis.poses import Trajectory, quaternion_from_matrix, read_tum, rotation_matrix
from ignis.progress import Progress

_ACCEL_COLUMNS = slice(11, 14)  # specific force, forward left up [m/s^2]
_GYRO_COLUMNS = slice(17, 20)  # forward left up [rad/s]
_GROUND_TRUTH_FILE = "gt_imu_vel.tum"
# [m, deg] a configured LiDAR mount farther from the drive's own calibration than this is worth a warning.
_MOUNT_TOLERANCE_M, _MOUNT_TOLERANCE_DEG = 0.05, 0.5
# [us] inertial data beyond the last scan serve nobody.
_TAIL_US = 200_000


def find_drive(folder: Path) -> Path | None:
    """The drive (a folder with velodyne_points/ and oxts/) at or below `folder`, or None when there is none."""
    drives = [
        candidate.parent
        for pattern in ("oxts", "*/oxts", "*/*/oxts")
        for candidate in sorted(folder.glob(pattern))
        if (candidate.parent / "velodyne_points").is_dir()
    ]
    if len(drives) > 1:
        raise InputError(f"{folder} holds several drives; give one of: {', '.join(str(drive) for drive in drives)}")
    return drives[0] if drives else None


def import_drive(drive: Path, recorder: Recorder, extrinsics: Extrinsics) -> list[str]:
    """Hands one drive to the recorder; returns remarks for the user."""
    starts = read_stamps(drive / "velodyne_points" / "timestamps_start.txt")
    ends = read_stamps(drive / "velodyne_points" / "timestamps_end.txt")
    imu_stamps = read_stamps(drive / "oxts" / "timestamps.txt")
    truth = _find_ground_truth(drive)
    remarks = _mount_remarks(drive, extrinsics)
    progress = Progress(f"importing {drive.name}")
    last_end, imu_done, truth_done, scans = 0, 0, 0, 0
    for index, fraction, data in _scan_files(drive):
        if index >= min(len(starts), len(ends)):
            raise InputError(f"scan {index} has no stamp in {drive / 'velodyne_points' / 'timestamps_start.txt'}")
        point_utime, points, reflectance = decode_scan(data, starts[index], ends[index], index)
        recorder.add_scan(point_utime, points, reflectance * 255.0)
        last_end, scans = max(last_end, int(ends[index])), scans + 1
        # Inertial data and truth follow the scans, so that the recorder's reordering window holds few scans.
        imu_done = _add_imu(drive, imu_stamps, imu_done, last_end + _TAIL_US, recorder)
        truth_done = _add_truth(truth, truth_done, last_end + _TAIL_US, recorder)
        progress.update(fraction, f"{scans} scans")
    progress.close()
    if scans == 0:
        raise InputError(f"{drive / 'velodyne_points'} holds no scan (neither data/*.bin nor *.tar.*)")
    remarks.append("per-point times follow from the azimuth (HDL-64E: clockwise, from the rear)")
    remarks.append(f"ground truth from {_GROUND_TRUTH_FILE}" if truth else f"no ground truth ({_GROUND_TRUTH_FILE})")
    return remarks


def read_stamps(path: Path) -> np.ndarray:
    """Text stamps, read as UTC, to microseconds."""
    try:
        lines = path.read_text(encoding="ascii").split("\n")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the stamps {path}: {error}") from None
    stamps = []
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            seconds_text, _, fraction = line.strip().partition(".")
            seconds = calendar.timegm(time.strptime(seconds_text, "%Y-%m-%d %H:%M:%S"))
            stamps.append(seconds * 1_000_000 + round(float(f"0.{fraction or 0}") * 1e6))
        except ValueError:
            raise InputError(f"{path}:{number}: expected a stamp such as 2011-09-26 13:10:51.158069617") from None
    return np.array(stamps, dtype=np.int64)


def decode_scan(data: bytes, start: int, end: int, index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Instants [us], positions in LiDAR axes [m] and reflectance 0..1 of one .bin file."""
    if len(data) == 0 or len(data) % 16 != 0:
        raise InputError(f"scan {index:010d}.bin has {len(data)} bytes, not a multiple of 16; is the download whole?")
    rows = np.frombuffer(data, dtype="<f4").reshape(-1, 4).astype(float)
    turn = (np.pi - np.arctan2(rows[:, 1], rows[:, 0])) / (2.0 * np.pi)
    point_utime = start + np.rint(turn * (end - start)).astype(np.int64)
    return point_utime, rows[:, :3], rows[:, 3]


def lidar_mount(calibration: Path) -> Mount:
    """The LiDAR's mount on a body frame at the inertial unit, from calib_imu_to_velo.txt (x_velo = R x_imu + T)."""
    try:
        lines = calibration.read_text(encoding="ascii").splitlines()
        values = {name: numbers.split() for name, _, numbers in (line.partition(":") for line in lines)}
        r_velo_imu = np.array(values["R"], dtype=float).reshape(3, 3)
        t_velo_imu = np.array(values["T"], dtype=float).reshape(3)
    except (OSError, KeyError, ValueError):
        raise InputError(f"{calibration} has no lines `R:` and `T:` with nine and three numbers") from None
    r_turn = R_OURS_FROM_FLU @ r_velo_imu.T @ R_OURS_FROM_FLU.T
    translation = R_OURS_FROM_FLU @ (-r_velo_imu.T @ t_velo_imu)
    yaw, pitch, roll = np.degrees(yaw_pitch_roll_from_rotation(r_turn))
    x, y, z = (float(value) for value in translation)
    return Mount("forward_left_up", float(yaw), float(pitch), float(roll), (x, y, z))


def _mount_remarks(drive: Path, extrinsics: Extrinsics) -> list[str]:
    calibration = drive.parent / "calib_imu_to_velo.txt"
    if not calibration.is_file():
        return []
    expected = lidar_mount(calibration)
    difference = expected.rotation().T @ extrinsics.lidar.rotation()
    angle = np.degrees(np.arccos(np.clip((np.trace(difference) - 1.0) / 2.0, -1.0, 1.0)))
    distance = np.linalg.norm(expected.translation() - extrinsics.lidar.translation())
    if angle < _MOUNT_TOLERANCE_DEG and distance < _MOUNT_TOLERANCE_M:
        return []
    return [
        f"WARNING: extrinsics.lidar is {angle:.1f} deg and {distance:.2f} m away from {calibration.name}, which says "
        f"yaw_deg {expected.yaw_deg:.4f}, pitch_deg {expected.pitch_deg:.4f}, roll_deg {expected.roll_deg:.4f}, "
        f"translation_m {[round(v, 4) for v in expected.translation_m]}"
    ]


def _scan_files(drive: Path) -> Iterator[tuple[int, float, bytes]]:
    """Index, fraction done and content of each scan, from data/*.bin or else straight from an archive."""
    folder = drive / "velodyne_points"
    files = sorted((folder / "data").glob("*.bin"))
    for number, file in enumerate(files, start=1):
        yield _scan_index(file), number / len(files), file.read_bytes()
    if files:
        return
    for archive in sorted(folder.glob("*.tar*")):
        size = archive.stat().st_size
        try:
            with archive.open("rb") as raw, tarfile.open(fileobj=raw, mode="r|*") as tar:
                for member in tar:
                    content = tar.extractfile(member) if member.name.endswith(".bin") else None
                    if content is not None:
                        yield _scan_index(Path(member.name)), raw.tell() / size, content.read()
        except (tarfile.TarError, lzma.LZMAError, zlib.error, EOFError) as error:
            raise InputError(f"the archive {archive} is damaged ({error}); fetch it again") from None


def _scan_index(file: Path) -> int:
    if not file.stem.isdecimal():
        raise InputError(f"{file} is no scan: its name should be a number, as in 0000000042.bin")
    return int(file.stem)


def _add_imu(drive: Path, stamps: np.ndarray, done: int, until: int, recorder: Recorder) -> int:
    while done < len(stamps) and stamps[done] <= until:
        path = drive / "oxts" / "data" / f"{done:010d}.txt"
        try:
            row = np.array([float(word) for word in path.read_text(encoding="ascii").split()])
        except (OSError, ValueError) as error:
            raise InputError(f"cannot read the inertial sample {path}: {error}") from None
        if row.size < _GYRO_COLUMNS.stop:
            raise InputError(f"{path} has {row.size} columns, at least {_GYRO_COLUMNS.stop} expected")
        recorder.add_imu(int(stamps[done]), row[_GYRO_COLUMNS], row[_ACCEL_COLUMNS])
        done += 1
    return done


def _find_ground_truth(drive: Path) -> Trajectory | None:
    for folder in (drive, drive.parent, drive.parent.parent):
        if (folder / _GROUND_TRUTH_FILE).is_file():
            return read_tum(folder / _GROUND_TRUTH_FILE)
    return None


def _add_truth(truth: Trajectory | None, done: int, until: int, recorder: Recorder) -> int:
    """The file holds inertial-unit poses (forward, left, up) in an east-north-up world."""
    if truth is None:
        return done
    position = truth.poses.position @ R_OURS_FROM_ENU.T
    velocity = np.gradient(position, truth.utime * 1e-6, axis=0)
    while done < len(truth) and truth.utime[done] <= until:
        rotation = R_OURS_FROM_ENU @ rotation_matrix(truth.poses.quaternion[done]) @ R_OURS_FROM_FLU.T
        quaternion = quaternion_from_matrix(rotation)
        recorder.add_truth(int(truth.utime[done]), position[done], quaternion, velocity[done])
        done += 1
    return done
