# SPDX-License-Identifier: Apache-2.0
"""Ouster packet captures with their metadata, through the vendor's SDK in an environment of its own.

Points are in the sensor frame (the base of the housing), so `extrinsics.lidar` is the mount of that frame; stamps of
points and inertial samples come from one clock, the sensor's.
"""

import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import IO, Any

import numpy as np

from ignis.environments import default_cache, environment_python
from ignis.errors import InputError
from ignis.importers.recorder import Recorder
from ignis.mounts import Extrinsics
from ignis.progress import Progress

_READER = Path(__file__).with_name("ouster_reader.py")
_PCAP_MAGICS = (b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x4d\x3c\xb2\xa1", b"\xa1\xb2\x3c\x4d", b"\x0a\x0d\x0d\x0a")
# [m] the inertial unit sits this close to where the configuration has it, or the user hears of it.
_MOUNT_TOLERANCE_M = 0.05
# [rad/s] 2000 deg/s, the widest range of the sensors.
_GYRO_LIMIT = 34.91


def is_packet_capture(head: bytes) -> bool:
    """True for pcap and pcapng files."""
    return head[:4] in _PCAP_MAGICS


def find_metadata(capture: Path, given: Path | None) -> Path:
    """The metadata file: as given, or beside the capture under its name or alone."""
    if given is not None:
        if not given.is_file():
            raise InputError(f"the metadata {given} does not exist")
        return given
    same_name = capture.with_suffix(".json")
    if same_name.is_file():
        return same_name
    others = sorted(capture.parent.glob("*.json"))
    if len(others) == 1:
        return others[0]
    found = ", ".join(path.name for path in others) or "none"
    raise InputError(f"{capture} needs the sensor's metadata (JSON); give it with --metadata (beside it: {found})")


def import_packets(capture: Path, metadata: Path, recorder: Recorder, extrinsics: Extrinsics) -> list[str]:
    """Hands a capture to the recorder; returns remarks for the user."""
    requirements = Path(os.environ.get("IGNIS_CHECKOUT", ".")) / "packaging" / "ouster-requirements.txt"
    python = environment_python("ouster", requirements, default_cache())
    # The SDK must see neither our packages, whose versions it excludes, nor (-P) the modules beside the reader.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    with tempfile.TemporaryFile() as complaints:
        reader = subprocess.Popen(
            [python, "-P", _READER, capture, metadata], stdout=subprocess.PIPE, stderr=complaints, env=environment
        )
        assert reader.stdout is not None
        try:
            remarks = _take_all(reader.stdout, recorder, extrinsics, capture)
        except BaseException:
            reader.kill()
            reader.wait()
            raise
        if reader.wait() != 0:
            complaints.seek(0)
            said = complaints.read().decode(errors="replace").strip()
            last = said.splitlines()[-1] if said else "no message"
            raise InputError(f"the Ouster SDK cannot read {capture} with {metadata.name}: {last}")
    return remarks


def _take_all(stream: IO[bytes], recorder: Recorder, extrinsics: Extrinsics, capture: Path) -> list[str]:
    line = stream.readline()
    if not line:
        return []  # The reader ended before its first word; its exit code says why.
    about = json.loads(line)
    T_sensor_imu = np.array(about["imu_to_sensor"])
    progress = Progress(f"importing {capture.name}")
    scans = 0
    while kind := stream.read(1):
        if kind == b"I":
            _add_inertial(_array(stream), _array(stream), _array(stream), T_sensor_imu[:3, :3], recorder)
        else:
            recorder.add_scan(_array(stream), _array(stream), _array(stream))
            scans += 1
            progress.update(0.0, f"{scans} scans")
    progress.close()
    remarks = [
        f"{about['product']}, {about['beams']} beams, {about['columns']} columns; a point has its column's stamp",
        "accelerations in m/s^2 and rates in rad/s, as the SDK gives them; stamps of the sensor's clock",
    ]
    return remarks + _mount_remarks(T_sensor_imu[:3, 3] * 1e-3, extrinsics)


class _Pipe:
    """A stream that NumPy does not take for a file: from files it reads by position, which a pipe has not."""

    def __init__(self, stream: IO[bytes]) -> None:
        self.read = stream.read


def _array(stream: IO[bytes]) -> np.ndarray:
    array: np.ndarray = np.lib.format.read_array(_Pipe(stream), allow_pickle=False)
    return array


def _add_inertial(
    instants: np.ndarray, accel: np.ndarray, gyro: np.ndarray, R_sensor_imu: np.ndarray, recorder: Recorder
) -> None:
    for utime, a, w in zip(instants.tolist(), accel, gyro, strict=True):
        if np.abs(w).max(initial=0.0) > _GYRO_LIMIT:
            recorder.dropped["inertial samples beyond the sensor's range"] += 1
            continue
        recorder.add_imu(utime, R_sensor_imu @ w, R_sensor_imu @ a)


def _mount_remarks(imu_in_sensor_m: np.ndarray, extrinsics: Extrinsics) -> list[str]:
    """The metadata know where the inertial unit sits in the sensor; the configuration should agree."""
    offset = extrinsics.lidar.rotation() @ imu_in_sensor_m
    configured = extrinsics.imu.translation() - extrinsics.lidar.translation()
    if np.linalg.norm(offset - configured) <= _MOUNT_TOLERANCE_M:
        return []
    expected: Any = np.round(extrinsics.lidar.translation() + offset, 4).tolist()
    return [
        f"WARNING: by the metadata the inertial unit sits at {expected} m in the body frame, the configuration has "
        f"extrinsics.imu.translation_m at {np.round(extrinsics.imu.translation(), 4).tolist()}"
    ]
