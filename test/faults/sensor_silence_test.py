# SPDX-License-Identifier: Apache-2.0
"""Rows F2, F4 and F6: what the front end says of sensor data that come no more, or that it does not take."""

import math
from pathlib import Path

import ignis_lcm.ignis as types

from fault_drive import FaultRun
from ignis.logs import LogWriter, read_events

END_S = 9.0
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
