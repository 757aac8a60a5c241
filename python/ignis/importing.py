# SPDX-License-Identifier: Apache-2.0
"""`./ignis import`: turns a recording into an LCM log with L1_IMU and L1_SCAN in the body frame."""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

from ignis.errors import InputError, run_command
from ignis.files import replacing
from ignis.importers import kitti_raw, l1_capture, ouster, rosbag
from ignis.importers.recorder import IMU_CHANNEL, SCAN_CHANNEL, TRUTH_CHANNEL, Recorder
from ignis.mounts import read_extrinsics

_KINDS = "a KITTI raw drive, a ROS 1 or ROS 2 bag, an MCAP file, an Ouster packet capture or an L1 capture"
LCM_LOG_SYNC = b"\xed\xa1\xda\x01"


@dataclass(frozen=True)
class ImportChoice:
    """What only the user can know about a recording."""

    cloud: str | None = None  # topic of the point clouds
    imu: str | None = None  # topic of the inertial data
    metadata: Path | None = None  # of an Ouster sensor
    no_deskew: bool = False  # clouds may lack per-point times
    changes: tuple[str, ...] = ()  # of the configuration, section.key=value


def add_choices(parser: argparse.ArgumentParser) -> None:
    """The options that make up an ImportChoice."""
    parser.add_argument("--cloud", metavar="TOPIC", help="topic of the point clouds, if the bag has several")
    parser.add_argument("--imu", metavar="TOPIC", help="topic of the inertial data, if the bag has several")
    parser.add_argument("--metadata", type=Path, metavar="JSON", help="metadata of an Ouster packet capture")
    parser.add_argument("--no-deskew", action="store_true", help="take clouds without per-point times as they are")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="wins over the configuration; repeatable"
    )


def choice_of(parsed: argparse.Namespace) -> ImportChoice:
    """The choices out of parsed arguments."""
    return ImportChoice(parsed.cloud, parsed.imu, parsed.metadata, parsed.no_deskew, tuple(parsed.set))


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="./ignis import", description=__doc__)
    parser.add_argument("input", type=Path, help=_KINDS)
    parser.add_argument("-o", "--output", type=Path, required=True, help="LCM log to write")
    parser.add_argument("--config", type=Path, required=True, help="configuration with the extrinsics of the vehicle")
    add_choices(parser)
    return parser.parse_args(arguments)


def detect(path: Path) -> str:
    """The kind of a recording: kitti, bag, ouster, capture or lcm. Refuses everything else."""
    if not path.exists():
        raise InputError(f"{path} does not exist")
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
    if head.startswith(LCM_LOG_SYNC):
        return "lcm"
    if ouster.is_packet_capture(head):
        return "ouster"
    if l1_capture.is_capture(head):
        return "capture"
    raise InputError(f"{path} is of no known kind; give {_KINDS}")


def import_recording(source: Path, output: Path, config: Path, choice: ImportChoice) -> None:
    """Writes the log under its final name once it is complete."""
    kind = detect(source)
    if kind == "lcm":
        raise InputError(f"{source} is already an LCM log; give it to ./ignis replay")
    if kind != "bag" and (choice.cloud or choice.imu):
        raise InputError("--cloud and --imu choose topics of a bag; this input has none")
    extrinsics = read_extrinsics(config, choice.changes)
    with replacing(output) as temporary:
        if kind == "capture":
            remarks = l1_capture.import_capture(source, config, temporary, choice.changes)
        else:
            with Recorder(temporary, extrinsics) as recorder:
                if (drive := kitti_raw.find_drive(source) if kind == "kitti" else None) is not None:
                    remarks = kitti_raw.import_drive(drive, recorder, extrinsics)
                elif kind == "ouster":
                    metadata = ouster.find_metadata(source, choice.metadata)
                    remarks = ouster.import_packets(source, metadata, recorder, extrinsics)
                else:
                    remarks = rosbag.import_bag(source, recorder, choice.cloud, choice.imu, choice.no_deskew)
                recorder.finish()
            remarks += _summary(recorder, source)
    for remark in remarks:
        print(f"  {remark}")
    print(f"wrote {output} ({output.stat().st_size / 1e6:.1f} MB)", flush=True)


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
    return run_command(lambda: import_recording(parsed.input, parsed.output, parsed.config, choice_of(parsed)))


if __name__ == "__main__":
    sys.exit(main())
