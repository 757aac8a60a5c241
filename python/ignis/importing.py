# SPDX-License-Identifier: Apache-2.0
"""`./ignis import`: turns a recording into an LCM log with L1_IMU and L1_SCAN in the body frame."""

import argparse
import sys
from pathlib import Path

from ignis.errors import InputError, run_command
from ignis.files import replacing
from ignis.importers import kitti_raw, l1_capture, rosbag
from ignis.importers.recorder import IMU_CHANNEL, SCAN_CHANNEL, TRUTH_CHANNEL, Recorder
from ignis.mounts import read_extrinsics

_KINDS = "a KITTI raw drive, a ROS 1 or ROS 2 bag, an MCAP file or an L1 capture"
_LCM_LOG_SYNC = b"\xed\xa1\xda\x01"


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./ignis import", description=__doc__)
    parser.add_argument("input", type=Path, help=_KINDS)
    parser.add_argument("-o", "--output", type=Path, required=True, help="LCM log to write")
    parser.add_argument("--config", type=Path, required=True, help="configuration with the extrinsics of the vehicle")
    parser.add_argument("--cloud", metavar="TOPIC", help="topic of the point clouds, if the bag has several")
    parser.add_argument("--imu", metavar="TOPIC", help="topic of the inertial data, if the bag has several")
    return parser.parse_args(arguments)


def detect(path: Path) -> str:
    """The kind of a recording: kitti, bag or capture. Refuses everything else."""
    if not path.exists():
        raise InputError(f"{path} does not exist; give {_KINDS}")
    if path.is_dir():
        if rosbag.is_bag(path):
            return "bag"
        if kitti_raw.find_drive(path) is not None:
            return "kitti"
        raise InputError(f"{path} holds neither a ROS 2 bag (metadata.yaml) nor a KITTI drive (oxts, velodyne_points)")
    with path.open("rb") as file:
        head = file.read(1 << 16)
    if not head:
        raise InputError(f"{path} is empty")
    if rosbag.is_bag(path):
        return "bag"
    if head.startswith(_LCM_LOG_SYNC):
        raise InputError(f"{path} is already an LCM log; give it to ./ignis replay")
    if l1_capture.is_capture(head):
        return "capture"
    raise InputError(f"{path} is of no known kind; give {_KINDS}")


def import_recording(arguments: argparse.Namespace) -> None:
    """Writes the log under its final name once it is complete."""
    kind = detect(arguments.input)
    if kind != "bag" and (arguments.cloud or arguments.imu):
        raise InputError("--cloud and --imu choose topics of a bag; this input has none")
    extrinsics = read_extrinsics(arguments.config)
    with replacing(arguments.output) as temporary:
        if kind == "capture":
            remarks = l1_capture.import_capture(arguments.input, arguments.config, temporary)
        else:
            with Recorder(temporary, extrinsics) as recorder:
                if kind == "kitti":
                    remarks = kitti_raw.import_drive(kitti_raw.find_drive(arguments.input), recorder, extrinsics)
                else:
                    remarks = rosbag.import_bag(arguments.input, recorder, arguments.cloud, arguments.imu)
                recorder.finish()
            remarks += _summary(recorder, arguments.input)
    for remark in remarks:
        print(f"  {remark}")
    print(f"wrote {arguments.output} ({arguments.output.stat().st_size / 1e6:.1f} MB)")


def _summary(recorder: Recorder, source: Path) -> list[str]:
    counts = recorder.counts
    if counts[SCAN_CHANNEL] == 0 or counts[IMU_CHANNEL] == 0:
        reasons = "".join(f"; dropped {count} {reason}" for reason, count in recorder.dropped.items())
        raise InputError(
            f"{source} gave {counts[SCAN_CHANNEL]} scans and {counts[IMU_CHANNEL]} inertial samples; "
            f"both are needed{reasons}"
        )
    span = (recorder.scan_utimes[-1] - recorder.scan_utimes[0]) * 1e-6
    lines = [
        f"{counts[SCAN_CHANNEL]} scans over {span:.1f} s, {counts[IMU_CHANNEL]} inertial samples, "
        f"{counts[TRUTH_CHANNEL]} ground truth poses"
    ]
    return lines + [f"dropped {count} {reason}" for reason, count in sorted(recorder.dropped.items())]


def main(arguments: list[str] | None = None) -> int:
    """Entry point."""
    parsed = _parse(sys.argv[1:] if arguments is None else arguments)
    return run_command(lambda: import_recording(parsed))


if __name__ == "__main__":
    sys.exit(main())
