# SPDX-License-Identifier: Apache-2.0
"""Ouster packet captures: the real recording through the vendor's SDK, and what goes wrong without it."""

import os
from pathlib import Path

import numpy as np
import pytest

from checkout import ROOT
from ignis import read_log
from ignis.errors import InputError
from ignis.importers.ouster import find_metadata, is_packet_capture
from ignis.importing import main

PCAP_HEAD = b"\xd4\xc3\xb2\xa1" + bytes(60)


@pytest.fixture(scope="session")
def capture() -> Path:
    """The real recording, where it lies."""
    folder = Path(os.environ.get("IGNIS_DATA", ROOT.parent / "shared" / "data")) / "ouster_os1_128_3scans"
    if not folder.is_dir():
        pytest.skip("not run, data absent: ouster_os1_128_3scans")
    (found,) = folder.glob("*.pcap")
    return found


def test_packets_come_in_with_the_sensors_own_times_and_units(capture: Path, tmp_path: Path, capsys) -> None:
    config = ROOT / "config" / "ouster.json"
    assert main([str(capture), "-o", str(tmp_path / "x.lcmlog"), "--config", str(config)]) == 0
    said = capsys.readouterr().out
    assert "OS-1-128, 128 beams, 1024 columns" in said and "WARNING" not in said
    log = read_log(tmp_path / "x.lcmlog")
    scans, imu = log["L1_SCAN"], log["L1_IMU"]
    # What the README of the recording says was measured.
    assert scans.count == 3 and imu.count == 30
    assert all(107_000 < count < 108_000 for count in scans["num_points"])
    np.testing.assert_allclose(scans["duration_us"], 99_900, atol=100)
    np.testing.assert_allclose(np.diff(imu.utime), 10_000, atol=50)
    # Mean (0.41, 0.03, 1.00) g in forward, left, up: ours are right, up, backward.
    np.testing.assert_allclose(imu["accel"].mean(axis=0) / 9.80665, [-0.03, 1.00, -0.41], atol=0.02)
    # One clock: 0.3 s of scans and 0.3 s of samples begin and end together.
    assert abs(imu.utime[0] - scans.utime[0]) < 30_000 and abs(imu.utime[-1] - scans.utime[-1] - 99_900) < 30_000
    ranges = np.linalg.norm([scans.ragged[axis][0] for axis in "xyz"], axis=0)
    assert ranges.min() > 0.3 and ranges.max() < 260.0


def test_a_mount_that_the_metadata_contradict_is_told(
    capture: Path, tmp_path: Path, level_config: Path, capsys
) -> None:
    level_config.write_text('{"extrinsics": {"lidar": {}, "imu": {"translation_m": [0.5, 0, 0]}}}')
    assert main([str(capture), "-o", str(tmp_path / "x.lcmlog"), "--config", str(level_config)]) == 0
    assert "WARNING: by the metadata the inertial unit sits at [0.0118, 0.0076, -0.0063] m" in capsys.readouterr().out


def test_metadata_of_another_kind_are_refused(capture: Path, tmp_path: Path, level_config: Path, capsys) -> None:
    (tmp_path / "meta.json").write_text("{}")
    arguments = [str(capture), "-o", str(tmp_path / "x.lcmlog"), "--config", str(level_config)]
    assert main([*arguments, "--metadata", str(tmp_path / "meta.json")]) == 2
    assert "the Ouster SDK cannot read" in capsys.readouterr().err
    assert not (tmp_path / "x.lcmlog").exists()


def test_metadata_are_looked_for_beside_the_capture(tmp_path: Path) -> None:
    pcap = tmp_path / "drive.pcap"
    pcap.write_bytes(PCAP_HEAD)
    with pytest.raises(InputError, match="give it with --metadata"):
        find_metadata(pcap, None)
    (tmp_path / "sensor.json").write_text("{}")
    assert find_metadata(pcap, None) == tmp_path / "sensor.json"
    (tmp_path / "drive.json").write_text("{}")
    assert find_metadata(pcap, None) == tmp_path / "drive.json"
    with pytest.raises(InputError, match="does not exist"):
        find_metadata(pcap, tmp_path / "none.json")


def test_packet_captures_are_known_by_their_first_bytes() -> None:
    assert is_packet_capture(PCAP_HEAD) and is_packet_capture(b"\x0a\x0d\x0d\x0a" + bytes(20))
    assert not is_packet_capture(b"\xfd" * 40)
