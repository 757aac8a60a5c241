# SPDX-License-Identifier: Apache-2.0
"""Rows B1, F2, F4 and F6: what the front end says of sensor data that are lost, end, or that it does not take."""

import math
import random
from pathlib import Path

import ignis_lcm.ignis as types

from fault_drive import WHOLE_S, FaultRun, lossy
from ignis.logs import LogWriter, read_events

END_S = 9.0
SEED = 6
COPIES = 3  # of each sample: a network that doubles messages hides no losses
TOLD_WITHIN_S = 4.0  # of the drive, which is played at twice its speed
OK, DEGRADED, LOST = types.health_t.OK, types.health_t.DEGRADED, types.health_t.LOST


def without_late(channel: str, log: Path, out: Path) -> Path:
    """The drive with one of its streams in the first seconds only."""
    events = list(read_events(log))
    with LogWriter(out) as writer:
        for event in events:
            if event.channel != channel or event.utime < events[0].utime + 1e6 * END_S:
                writer.write(*event)
    return out


def test_fault_f6_data_that_come_no_more_are_told(drive_log: Path, private_network: None, tmp_path: Path) -> None:
    with FaultRun(tmp_path, names=("lio_frontend",)) as run:
        run.play(without_late("L1_SCAN", drive_log, tmp_path / "short.lcmlog"))
        told = [(health.state, health.state_text) for health in run.seen.health["lio_frontend"]]
    ok = max(i for i, (state, _) in enumerate(told) if state == OK)
    after = told[ok + 1 :]
    assert any(state == DEGRADED and text.startswith("no scan for") for state, text in after), told
    assert any(state == LOST and text.startswith("no scan for") for state, text in after), told
    state, text = told[-1]
    assert state == LOST and text.startswith("no sensor data for"), "the player ended seconds ago"


def test_fault_f2_an_imu_that_is_gone_is_told_while_scans_go_on(
    drive_log: Path, private_network: None, tmp_path: Path
) -> None:
    with FaultRun(tmp_path, names=("lio_frontend",)) as run:
        run.play(without_late("L1_IMU", drive_log, tmp_path / "short.lcmlog"))
        told = [health.state_text for health in run.seen.health["lio_frontend"]]
    alone = [text for text in told if "going on with scans alone" in text]
    assert len(alone) >= 2 and "stands still" not in alone[1], told


def test_fault_f4_a_refused_sample_is_told_with_its_reason(
    drive_log: Path, private_network: None, tmp_path: Path
) -> None:
    sample = next(types.imu_t.decode(event.data) for event in read_events(drive_log) if event.channel == "L1_IMU")
    sample.gyro = (math.nan, 0.0, 0.0)
    with FaultRun(tmp_path, names=("lio_frontend",)) as run:
        run.send("L1_IMU", sample.encode())
        run.listen(1.5)
        newest = run.seen.health["lio_frontend"][-1]
        assert "L1_IMU: refused 1 messages" in newest.state_text and "not finite" in newest.state_text, (
            newest.state_text
        )
        assert run.seen.rejected("lio_frontend", "L1_IMU") == 1


def test_fault_b1_a_third_of_the_sensor_messages_lost_is_told_while_it_lasts_and_every_gap_is_counted(
    drive_log: Path, private_network: None, tmp_path: Path
) -> None:
    events = list(read_events(drive_log))
    kept = lossy(events, 0.30, random.Random(SEED))
    log = tmp_path / "lossy.lcmlog"
    with LogWriter(log) as writer:
        for event in kept:
            for _ in range(COPIES if event.channel == "L1_IMU" else 1):
                writer.write(*event)
    with FaultRun(tmp_path, names=("lio_frontend",)) as run:
        run.play(log)
        told = run.seen.health["lio_frontend"]
    lossy_from, end = events[0].utime + 1e6 * (WHOLE_S + TOLD_WITHIN_S), kept[-1].utime
    meanwhile = [health for health in told if lossy_from < health.utime < end - 1e6]
    assert len(meanwhile) >= 3
    for health in meanwhile:
        assert health.state in (DEGRADED, LOST) and "L1_IMU: " in health.state_text, (SEED, health.state_text)
    counted = dict(zip(told[-1].channels, told[-1].lost, strict=True))
    for channel, message in (("L1_IMU", types.imu_t), ("L1_SCAN", types.scan_t)):
        numbers = [
            {message.decode(event.data).sequence for event in part if event.channel == channel}
            for part in (events, kept)
        ]
        missing = sum(number < max(numbers[1]) for number in numbers[0] - numbers[1])
        print(f"seed {SEED}: {channel}: {missing} of {len(numbers[0])} lost, counted {counted[channel]}")
        assert missing > 30 and counted[channel] == missing
