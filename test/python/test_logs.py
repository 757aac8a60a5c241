# SPDX-License-Identifier: Apache-2.0
"""Logs: LCM's own reader and ours agree, damage costs only the records that it touches."""

from pathlib import Path

import lcm
import pytest
from ignis_lcm.ignis import imu_t, scan_t

from ignis.errors import InputError
from ignis.logs import LogDamage, LogWriter, PartAssembler, joined_arrays, read_events, read_log


def imu(sequence: int) -> imu_t:
    message = imu_t()
    message.utime, message.sequence = 1_000 * sequence, sequence
    message.gyro, message.accel = [0.1, 0.2, 0.3], [0.0, 9.81, 0.0]
    return message


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "a.lcmlog"
    with LogWriter(path) as writer:
        for sequence in range(5):
            writer.write(1_000 * sequence, "L1_IMU", imu(sequence).encode())
    return path


def test_lcm_reads_what_we_write_and_we_read_what_lcm_writes(log: Path, tmp_path: Path) -> None:
    events = list(lcm.EventLog(str(log), "r"))
    assert [(e.eventnum, e.timestamp, e.channel) for e in events] == [(i, 1_000 * i, "L1_IMU") for i in range(5)]
    assert imu_t.decode(events[3].data).sequence == 3
    other = lcm.EventLog(str(tmp_path / "b.lcmlog"), "w", overwrite=True)
    other.write_event(7, "L1_IMU", imu(9).encode())
    other.close()
    (event,) = read_log(tmp_path / "b.lcmlog")
    assert (event.utime, event.channel, event.message.sequence) == (7, "L1_IMU", 9)


def test_a_log_cut_at_any_byte_keeps_every_whole_record(log: Path, tmp_path: Path) -> None:
    data = log.read_bytes()
    record = len(data) // 5
    cut = tmp_path / "cut.lcmlog"
    for size in range(4, len(data)):
        cut.write_bytes(data[:size])
        damage = LogDamage()
        assert len(list(read_events(cut, damage))) == size // record
        assert damage.skipped_bytes == size % record


# The sync word, then the data length: beyond the file, too short, and reaching into the next record.
@pytest.mark.parametrize(("where", "flipped"), [(0, 0x41), (24, 0x7F), (24, 0x80), (27, 0x41), (27, 0x80)])
def test_damage_costs_only_the_record_that_it_touches(log: Path, where: int, flipped: int) -> None:
    data = bytearray(log.read_bytes())
    record = len(data) // 5
    data[2 * record + where] ^= flipped
    log.write_bytes(data)
    damage = LogDamage()
    assert [event.message.sequence for event in read_log(log, damage=damage)] == [0, 1, 3, 4]
    assert damage


def test_unknown_types_are_counted_and_skipped(log: Path) -> None:
    with LogWriter(log) as writer:
        writer.write(0, "OTHER", b"12345678 not ours")
        writer.write(1, "L1_IMU", imu(1).encode())
    damage = LogDamage()
    assert [e.message.sequence for e in read_log(log, damage=damage)] == [1]
    assert damage.undecodable == 1


@pytest.mark.parametrize(("content", "said"), [(b"", "is empty"), (b"hello" * 100, "is not an LCM log")])
def test_other_files_are_refused(tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "x.lcmlog"
    path.write_bytes(content)
    with pytest.raises(InputError, match=said):
        list(read_events(path))


def part(sequence: int, number: int, count: int, x: list[float]) -> scan_t:
    message = scan_t()
    message.utime, message.sequence, message.part, message.part_count = 10 * sequence, sequence, number, count
    message.num_points, message.x = len(x), x
    message.y, message.z, message.intensity, message.dt_us = x, x, x, [int(v) for v in x]
    return message


def test_parts_come_together_in_order_and_gaps_are_counted() -> None:
    assembler = PartAssembler()
    assert assembler.add(part(0, 1, 2, [3.0])) is None
    parts = assembler.add(part(0, 0, 2, [1.0, 2.0]))
    assert parts is not None
    assert joined_arrays(parts)["x"].tolist() == [1.0, 2.0, 3.0]
    assert assembler.add(part(1, 0, 2, [1.0])) is None  # its second part never comes
    assert assembler.add(part(2, 0, 1, [1.0])) is not None
    assert assembler.incomplete == 1
