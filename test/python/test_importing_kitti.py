# SPDX-License-Identifier: Apache-2.0
"""KITTI: a slice of the real drive, and its refusals on made-up folders."""

import tarfile
from pathlib import Path

import numpy as np
import pytest

from checkout import ROOT
from ignis.errors import InputError
from ignis.importers.kitti_raw import decode_scan, find_drive, read_stamps
from ignis.importing import main
from ignis.logs import PartAssembler, joined_arrays, read_log
from ignis.poses import read_tum

SCANS = 3


@pytest.fixture(scope="module")
def drive(kitti: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first scans of the recording as a folder of .bin files; everything else links to where it lies."""
    source = find_drive(kitti)
    assert source is not None
    folder = tmp_path_factory.mktemp("kitti") / "2011_09_26" / source.name
    (folder / "velodyne_points" / "data").mkdir(parents=True)
    (folder / "oxts").symlink_to(source / "oxts")
    (folder.parent / "calib_imu_to_velo.txt").symlink_to(source.parent / "calib_imu_to_velo.txt")
    (folder.parent / "gt_imu_vel.tum").symlink_to(kitti / "gt_imu_vel.tum")
    for stamps in (source / "velodyne_points").glob("*.txt"):
        (folder / "velodyne_points" / stamps.name).symlink_to(stamps)
    archive = next((source / "velodyne_points").glob("*.tar.xz"))
    with tarfile.open(archive, "r|*") as tar:
        for member in tar:
            if not member.name.endswith(".bin"):
                continue
            target = folder / "velodyne_points" / "data" / Path(member.name).name
            target.write_bytes(tar.extractfile(member).read())
            if int(target.stem) == SCANS - 1:
                break
    return folder


@pytest.fixture(scope="module")
def imported(drive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("out") / "kitti.lcmlog"
    assert main([str(drive), "-o", str(output), "--config", str(ROOT / "config" / "kitti.json")]) == 0
    return output


def test_scans_have_all_points_and_the_turns_times(drive: Path, imported: Path) -> None:
    assembler = PartAssembler()
    scans = [parts for e in read_log(imported, ("L1_SCAN",)) if (parts := assembler.add(e.message))]
    assert [parts[0].sequence for parts in scans] == list(range(SCANS))
    starts = read_stamps(drive / "velodyne_points" / "timestamps_start.txt")
    ends = read_stamps(drive / "velodyne_points" / "timestamps_end.txt")
    for index, parts in enumerate(scans):
        size = (drive / "velodyne_points" / "data" / f"{index:010d}.bin").stat().st_size
        assert sum(part.num_points for part in parts) == size // 16
        assert abs(parts[0].utime - starts[index]) < 1_000
        assert abs(parts[0].utime + parts[0].duration_us - ends[index]) < 1_000


def test_points_ahead_of_the_car_are_seen_in_the_middle_of_the_turn(imported: Path) -> None:
    parts = [e.message for e in read_log(imported, ("L1_SCAN",)) if e.message.sequence == 0]
    scan = joined_arrays(parts)
    ahead = (scan["z"] < -10.0) & (np.abs(scan["x"]) < 1.0)
    left = (scan["x"] < -5.0) & (np.abs(scan["z"] + 0.8) < 1.0)
    assert np.median(scan["dt_us"][ahead]) == pytest.approx(51_700, abs=1_500)
    assert np.median(scan["dt_us"][left]) == pytest.approx(25_900, abs=1_500)  # clockwise from the rear: left first
    # The road lies about 0.93 m below the inertial unit.
    near = (np.hypot(scan["x"], scan["z"]) < 8.0) & (np.hypot(scan["x"], scan["z"]) > 5.0)
    assert np.percentile(scan["y"][near], 25) == pytest.approx(-0.93, abs=0.15)


def test_inertial_samples_point_up_and_follow_the_truth(imported: Path, kitti: Path) -> None:
    samples = [e.message for e in read_log(imported, ("L1_IMU",))]
    assert np.mean([s.accel for s in samples], axis=0)[1] == pytest.approx(9.8, abs=0.2)
    truth = [e.message for e in read_log(imported, ("GROUND_TRUTH",))]
    enu = read_tum(kitti / "gt_imu_vel.tum")
    assert [t.utime for t in truth] == enu.utime[: len(truth)].tolist()
    east, north, up = enu.poses.position[2]
    assert truth[2].position == pytest.approx([east, up, -north])
    # The car drives forward: the velocity in body axes lies along -Z.
    w, x, y, z = truth[2].quaternion
    forward_world = -np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    speed = np.linalg.norm(truth[2].velocity)
    assert 10.0 < speed < 12.5
    assert forward_world @ np.array(truth[2].velocity) / speed > 0.99


def test_an_archive_gives_the_same_log_as_a_folder(drive: Path, imported: Path, tmp_path: Path) -> None:
    packed = tmp_path / "drive"
    (packed / "velodyne_points").mkdir(parents=True)
    (packed / "oxts").symlink_to(drive / "oxts")
    (packed / "gt_imu_vel.tum").symlink_to((drive.parent / "gt_imu_vel.tum").resolve())
    for stamps in (drive / "velodyne_points").glob("*.txt"):
        (packed / "velodyne_points" / stamps.name).symlink_to(stamps.resolve())
    with tarfile.open(packed / "velodyne_points" / "data.tar.gz", "w:gz", compresslevel=1) as tar:
        for file in sorted((drive / "velodyne_points" / "data").iterdir()):
            tar.add(file, f"data/{file.name}")
    output = tmp_path / "packed.lcmlog"
    assert main([str(packed), "-o", str(output), "--config", str(ROOT / "config" / "kitti.json")]) == 0
    assert output.read_bytes() == imported.read_bytes()


def test_a_foreign_mount_is_pointed_out(drive: Path, level_config: Path, tmp_path: Path, capsys) -> None:
    assert main([str(drive), "-o", str(tmp_path / "a.lcmlog"), "--config", str(level_config)]) == 0
    assert "WARNING: extrinsics.lidar is 0.9 deg and 1.18 m away" in capsys.readouterr().out


def test_columns_are_those_of_the_forward_left_up_unit(tmp_path: Path, level_config: Path) -> None:
    drive = tmp_path / "drive"
    (drive / "velodyne_points" / "data").mkdir(parents=True)
    (drive / "oxts" / "data").mkdir(parents=True)
    for name, second in (("velodyne_points/timestamps_start", 1), ("velodyne_points/timestamps_end", 2)):
        (drive / f"{name}.txt").write_text(f"2011-09-26 13:10:0{second}.0\n")
    (drive / "oxts" / "timestamps.txt").write_text("2011-09-26 13:10:01.5\n")
    (drive / "oxts" / "data" / "0000000000.txt").write_text(" ".join(str(column) for column in range(30)))
    point = np.array([[9, 2, 3, 0.5]], dtype="<f4")
    (drive / "velodyne_points" / "data" / "0000000000.bin").write_bytes(point.tobytes())
    assert main([str(drive), "-o", str(tmp_path / "x.lcmlog"), "--config", str(level_config)]) == 0
    found = {e.channel: e.message for e in read_log(tmp_path / "x.lcmlog")}
    assert found["L1_IMU"].accel == (-12.0, 13.0, -11.0)
    assert found["L1_IMU"].gyro == (-18.0, 19.0, -17.0)
    scan = found["L1_SCAN"]
    assert (scan.x, scan.y, scan.z, scan.intensity) == ((-2.0,), (3.0,), (-9.0,), (127.5,))


def test_per_point_times_run_clockwise_from_the_rear() -> None:
    points = np.array([[-1, 1e-9, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0.5], [0, -1, 0, 0]], dtype="<f4")
    utime, positions, reflectance = decode_scan(points.tobytes(), 1_000_000, 1_100_000, 0)
    assert utime.tolist() == [1_000_000, 1_025_000, 1_050_000, 1_075_000]
    assert positions[2].tolist() == [1, 0, 0] and reflectance[2] == 0.5


def test_stamps_keep_microseconds_and_are_utc(tmp_path: Path) -> None:
    (tmp_path / "t.txt").write_text("2011-09-26 13:10:51.175862102\n1970-01-01 00:00:01\n")
    assert read_stamps(tmp_path / "t.txt").tolist() == [1317042651175862, 1000000]
    (tmp_path / "t.txt").write_text("yesterday\n")
    with pytest.raises(InputError, match=r"t\.txt:1: expected a stamp"):
        read_stamps(tmp_path / "t.txt")
