# SPDX-License-Identifier: Apache-2.0
"""Files that appear whole or not at all."""

import errno
import os
from pathlib import Path

import pytest

from ignis.files import replacing, write_text


def test_two_writers_of_one_file_each_finish_their_own(tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    with replacing(path) as first:
        first.write_text("begun by the first, ")
        with replacing(path) as second:
            second.write_text("whole by the second")
        assert path.read_text() == "whole by the second"
        with first.open("a") as file:
            file.write("ended by the first")
    assert path.read_text() == "begun by the first, ended by the first"
    assert list(tmp_path.iterdir()) == [path]


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    write_text(path, "old")
    with pytest.raises(RuntimeError), replacing(path) as temporary:
        temporary.write_text("half of the n")
        raise RuntimeError
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_is_on_the_disk_before_it_has_its_name_and_so_is_the_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "table.csv"
    synced: list[tuple[bool, bool]] = []
    monkeypatch.setattr(
        os, "fsync", lambda fd: synced.append((os.fstat(fd).st_ino == os.stat(tmp_path).st_ino, path.exists()))
    )
    write_text(path, "new")
    assert synced == [(False, False), (True, True)], "(whether it is the folder, whether the file has its name)"


def test_a_disk_that_takes_no_more_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "table.csv"
    write_text(path, "old")

    def fail(_: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="Input/output error"):
        write_text(path, "new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
