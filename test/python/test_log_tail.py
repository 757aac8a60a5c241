# SPDX-License-Identifier: Apache-2.0
"""A growing log is counted as it grows, whatever the borders of the pieces."""

import random
from pathlib import Path

import pytest
from ignis_lcm.ignis import health_t, imu_t

from ignis.log_tail import LogTail
from ignis.logs import LogWriter


def write(path: Path, sequences: list[int], channel: str = "L1_IMU", kind: type = imu_t) -> bytes:
    with LogWriter(path) as writer:
        for index, sequence in enumerate(sequences):
            message = kind()
            message.utime, message.sequence = index, sequence
            writer.write(10_000 * index, channel, message.encode())
    return path.read_bytes()


def test_pieces_of_any_size_give_the_same_counts(tmp_path: Path) -> None:
    data = write(tmp_path / "whole", [*range(40), *range(43, 60)])
    rng = random.Random(1)
    growing = tmp_path / "growing"
    growing.touch()
    tail = LogTail(growing)
    with growing.open("ab", buffering=0) as file:
        at = 0
        while at < len(data):
            step = rng.randint(1, 300)
            file.write(data[at : at + step])
            at += step
            tail.update()
    count = tail.channels["L1_IMU"]
    assert (count.messages, count.missed, count.newest) == (57, 3, 59)
    assert count.rate_hz() == pytest.approx(100.0)


def test_repeats_late_arrivals_and_a_new_sender_are_no_loss(tmp_path: Path) -> None:
    write(tmp_path / "a", [5000, 5001, 5001, 5000, 5002, 0, 1])
    tail = LogTail(tmp_path / "a")
    tail.update()
    assert tail.missed == 0 and tail.messages == 7


def test_channels_with_several_senders_are_not_judged_by_their_numbers(tmp_path: Path) -> None:
    write(tmp_path / "a", [0, 50, 3, 90], channel="HEALTH", kind=health_t)
    tail = LogTail(tmp_path / "a")
    tail.update()
    assert tail.missed == 0


def test_damage_costs_the_damaged_record_alone(tmp_path: Path) -> None:
    data = bytearray(write(tmp_path / "a", list(range(10))))
    record = len(data) // 10
    data[3 * record] ^= 0xFF
    (tmp_path / "a").write_bytes(data)
    tail = LogTail(tmp_path / "a")
    tail.update()
    assert tail.channels["L1_IMU"].messages == 9 and tail.missed == 1


def test_the_next_file_of_a_recording_goes_on_counting(tmp_path: Path) -> None:
    write(tmp_path / "a.00", [0, 1, 2])
    write(tmp_path / "a.01", [4, 5])
    tail = LogTail(tmp_path / "a.00")
    tail.update()
    tail.follow(tmp_path / "a.01")
    tail.update()
    assert (tail.messages, tail.missed) == (5, 1)


def test_a_file_that_is_not_there_yet_is_waited_for(tmp_path: Path) -> None:
    tail = LogTail(tmp_path / "a")
    tail.update()
    write(tmp_path / "a", [0])
    tail.update()
    assert tail.messages == 1
