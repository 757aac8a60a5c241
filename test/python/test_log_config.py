# SPDX-License-Identifier: Apache-2.0
"""The configuration inside a log is found wherever it stands, and only when it is whole."""

from pathlib import Path

from ignis.log_config import CONFIG_CHANNEL, differences, encoded, recorded_config
from ignis.logs import LogWriter


def test_the_first_whole_configuration_counts(tmp_path: Path) -> None:
    log = tmp_path / "a.lcmlog"
    with LogWriter(log) as writer:
        writer.write(0, "L1_IMU", b"x" * 500 + CONFIG_CHANNEL.encode())  # the name inside of data is no record
        writer.write(1, CONFIG_CHANNEL, b'{"broken": ')
        writer.write(2, CONFIG_CHANNEL, encoded({"a": {"b": 1}}))
        writer.write(3, CONFIG_CHANNEL, encoded({"a": {"b": 2}}))
    assert recorded_config(log) == {"a": {"b": 1}}


def test_a_log_without_one_and_an_empty_file_have_none(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "a.lcmlog") as writer:
        writer.write(0, "L1_IMU", b"x" * 50)
    assert recorded_config(tmp_path / "a.lcmlog") is None
    (tmp_path / "empty").touch()
    assert recorded_config(tmp_path / "empty") is None


def test_a_record_that_the_end_of_the_file_cuts_is_none(tmp_path: Path) -> None:
    log = tmp_path / "a.lcmlog"
    with LogWriter(log) as writer:
        writer.write(0, CONFIG_CHANNEL, encoded({"a": 1}))
    log.write_bytes(log.read_bytes()[:-1])
    assert recorded_config(log) is None


def test_differences_name_the_paths_of_keys() -> None:
    a = {"frontend": {"x": 1, "y": [1, 2]}, "map": {"z": 0}}
    b = {"frontend": {"x": 1, "y": [1, 3]}, "map": {"z": 0, "new": 5}}
    assert differences(a, b) == ["frontend.y", "map.new"]
    assert differences(a, a) == []
