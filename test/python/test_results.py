# SPDX-License-Identifier: Apache-2.0
"""The smoothing rule against arithmetic by hand, and a recorded run against what was put into it."""

import csv
from pathlib import Path

import numpy as np
import pytest
from ignis_lcm.ignis import (
    health_t,
    keyframe_t,
    loop_result_t,
    map_status_t,
    pose_t,
    scan_stats_t,
    smoothed_keyframes_t,
)

from ignis.errors import InputError
from ignis.logs import LogWriter
from ignis.poses import Poses, Trajectory, between, read_tum
from ignis.results import smoothed, write_results

UNTURNED = [1.0, 0.0, 0.0, 0.0]


def random_walk(count: int, seed: int) -> Poses:
    rng = np.random.default_rng(seed)
    q = np.cumsum(rng.normal(0, 0.1, size=(count, 4)), axis=0) + [3.0, 0, 0, 0]
    return Poses(np.cumsum(rng.normal(0, 0.5, (count, 3)), axis=0), q / np.linalg.norm(q, axis=1, keepdims=True))


def test_a_scan_at_a_keyframe_gets_exactly_the_corrected_pose() -> None:
    odom, corrected = random_walk(10, 1), random_walk(10, 2)
    utime = np.arange(10) * 1_000_000
    result = smoothed(Trajectory(utime, odom), utime, odom, corrected)
    np.testing.assert_allclose(result.poses.matrices(), corrected.matrices(), atol=1e-12)


def test_one_rigid_correction_moves_every_scan_rigidly() -> None:
    odom = random_walk(20, 3)
    shift = random_walk(1, 4)[np.zeros(20, dtype=int)]
    utime = np.arange(20) * 1_000
    picked = slice(5, 15, 3)
    result = smoothed(Trajectory(utime, odom), utime[picked], odom[picked], (shift @ odom)[picked])
    np.testing.assert_allclose(result.poses.matrices(), (shift @ odom).matrices(), atol=1e-12)


def test_between_keyframes_the_correction_grows_with_time_and_outside_it_holds() -> None:
    odom = Poses(np.array([[float(i), 0, 0] for i in range(6)]), np.tile(UNTURNED, (6, 1)))
    utime = np.array([0, 10, 20, 30, 40, 50])
    corrected = Poses(odom.position[[1, 4]] + [[0, 0, 0.3], [0, 0, 0.9]], np.tile(UNTURNED, (2, 1)))
    result = smoothed(Trajectory(utime, odom), utime[[1, 4]], odom[[1, 4]], corrected)
    np.testing.assert_allclose(result.poses.position[:, 2], [0.3, 0.3, 0.5, 0.7, 0.9, 0.9])
    np.testing.assert_allclose(result.poses.position[:, 0], np.arange(6))


def stats(index: int, session: int = 1, **values: object) -> scan_stats_t:
    message = scan_stats_t()
    message.utime, message.sequence, message.session = 1_000_000 + 50_000 * index, index, session
    message.applied, message.reason = 1, scan_stats_t.APPLIED
    message.position, message.quaternion = [float(index), 0.0, 0.0], UNTURNED
    message.time_spent_ms = 2.0 + index
    for name, value in values.items():
        setattr(message, name, value)
    return message


def keyframe(number: int, scan: int, session: int = 1) -> keyframe_t:
    message = keyframe_t()
    message.id, message.session, message.utime = number, session, 1_000_000 + 50_000 * scan
    message.position, message.quaternion = [float(scan), 0.0, 0.0], UNTURNED
    message.part_count = 1
    return message


def corrections(ids: list[int], z: list[float], x: list[float], session: int = 1) -> smoothed_keyframes_t:
    message = smoothed_keyframes_t()
    message.session, message.num_keyframes, message.ids = session, len(ids), ids
    message.px, message.py, message.pz = x, [0.0] * len(ids), z
    message.qw = [1.0] * len(ids)
    message.qx = message.qy = message.qz = [0.0] * len(ids)
    return message


def record_run(path: Path) -> None:
    rejected = {"applied": 0, "reason": scan_stats_t.TOO_FEW_MATCHES}
    events: list[tuple[str, object]] = [
        ("LIO_SCAN_STATS", stats(0, applied=0, reason=scan_stats_t.NOT_INITIALISED)),
        *[("LIO_SCAN_STATS", stats(i)) for i in range(1, 9)],
        ("LIO_SCAN_STATS", stats(8, session=2, position=[99.0, 0.0, 0.0], **rejected)),  # doubled: the first counts
        ("LIO_SCAN_STATS", stats(9, **rejected)),
        ("LIO_SCAN_STATS", stats(10, session=2)),
        ("LIO_SCAN_STATS", stats(11, session=2, applied=0, reason=scan_stats_t.SESSION_ENDED)),
        ("LIO_SCAN_STATS", stats(12, session=2, applied=0, reason=scan_stats_t.BEHIND)),
        ("LIO_KEYFRAME", keyframe(0, 1)),
        ("LIO_KEYFRAME", keyframe(1, 5)),
        ("SMOOTHED_KEYFRAMES", corrections([0, 1], [0.0, 9.0], [1.0, 5.0])),
        ("SMOOTHED_KEYFRAMES", corrections([1], [0.4], [5.0])),  # the newest word counts
    ]
    truth, health, status, loop = pose_t(), health_t(), map_status_t(), loop_result_t()
    for index in (0, 20):
        truth = pose_t()
        truth.utime, truth.position, truth.quaternion = 1_000_000 + 50_000 * index, [float(index), 1.0, 0.0], UNTURNED
        events.append(("GROUND_TRUTH", truth))
    for lost in ([1, 0], [2, 3]):
        health = health_t()
        health.process, health.num_receivers, health.channels = "graph_backend", 2, ["LIO_KEYFRAME", "LIO_STATE"]
        health.received, health.lost, health.rejected, health.queue_drops = [9, 8], lost, [0, 0], [0, 0]
        health.state_text = "OK"
        events.append(("HEALTH", health))
    status.voxels_local, status.voxels_mid, status.voxels_coarse = 3, 2, 1
    loop.accepted, loop.reason, loop.from_id, loop.to_id = 1, loop_result_t.ACCEPTED, 1, 0
    loop.relative_quaternion = UNTURNED
    events += [("MAP_STATUS", status), ("LOOP_RESULT", loop)]
    with LogWriter(path) as writer:
        for number, (channel, message) in enumerate(events):
            writer.write(number, channel, message.encode())


def test_a_recorded_run_becomes_a_results_folder(tmp_path: Path) -> None:
    record_run(tmp_path / "run.lcmlog")
    said = write_results(tmp_path / "run.lcmlog", tmp_path / "out")
    eskf, corrected = read_tum(tmp_path / "out" / "eskf.tum"), read_tum(tmp_path / "out" / "smoothed.tum")
    truth = read_tum(tmp_path / "out" / "ground_truth.tum")
    assert eskf.poses.position[:, 0].tolist() == list(range(1, 11))  # the scan before initialisation has no pose
    # Keyframe at scan 1: no shift; at scan 5: 0.4 m back; afterwards it holds; session 2 has no keyframes: untouched.
    expected = [0.0, 0.1, 0.2, 0.3, 0.4, 0.4, 0.4, 0.4, 0.4, 0.0]
    np.testing.assert_allclose(corrected.poses.position[:, 2], expected, atol=1e-9)
    np.testing.assert_allclose(truth.poses.position, [[i, 1.0, 0.0] for i in range(1, 11)], atol=1e-9)
    assert (said["scans"], said["applied"], said["sessions"]) == (14, 9, 2)
    assert said["rejected"] == {"behind": 1, "not_initialised": 1, "session_ended": 1, "too_few_matches": 2}
    assert said["lost"] == 5
    assert said["receivers"]["graph_backend"]["LIO_STATE"]["lost"] == 3
    assert said["voxels"] == {"local": 3, "mid": 2, "coarse": 1}
    assert said["loops"] == {"accepted": 1, "by_reason": {"accepted": 1}}
    assert said["time_per_scan_ms"]["median"] == 8.0


def test_tables_have_one_row_per_message_and_one_column_per_number(tmp_path: Path) -> None:
    record_run(tmp_path / "run.lcmlog")
    write_results(tmp_path / "run.lcmlog", tmp_path / "out")
    rows = list(csv.DictReader((tmp_path / "out" / "scan_stats.csv").open()))
    assert len(rows) == 14
    assert (rows[3]["utime"], rows[3]["position_0"], rows[10]["reason"]) == ("1150000", "3.0", "3")
    (loop,) = csv.DictReader((tmp_path / "out" / "loops.csv").open())
    assert (loop["from_id"], loop["relative_quaternion_0"]) == ("1", "1.0")


def test_a_log_without_scans_is_refused(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "run.lcmlog") as writer:
        writer.write(0, "GROUND_TRUTH", pose_t().encode())
    with pytest.raises(InputError, match="LIO_SCAN_STATS"):
        write_results(tmp_path / "run.lcmlog", tmp_path / "out")


def test_one_keyframe_corrects_everything_alike() -> None:
    single = random_walk(1, 7)
    assert len(between(single, np.array([5]), np.array([0, 5, 9]))) == 3
