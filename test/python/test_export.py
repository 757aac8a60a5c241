# SPDX-License-Identifier: Apache-2.0
"""What leaves: MCAP read back with its own library against the schemas, a bag that comes in again, plain files."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.unknown_fields import UnknownFieldSet
from mcap.reader import make_reader

from ignis import importing, read_log
from ignis.export import main
from ignis.exporters.axes import poses_to_ros, vectors_to_ros
from ignis.mounts import R_OURS_FROM_FLU, rotation_from_yaw_pitch_roll
from ignis.poses import Poses, quaternion_from_matrix, read_tum, rotation_matrix
from recorded_run import POINTS, START_US, TURNED, write_live_log

SCHEMAS = {
    "/l1/scan": PointCloud,
    "/lio/cloud": PointCloud,
    "/lio/pose": PoseInFrame,
    "/ground_truth/pose": PoseInFrame,
    "/tf": FrameTransforms,
    "/graph": SceneUpdate,
    "/log": Log,
}


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_live_log(tmp_path / "live.lcmlog")


@pytest.fixture
def messages(log: Path, tmp_path: Path) -> dict[str, list[Any]]:
    """Decoded by the schema of each topic; the file must be whole and indexed."""
    assert main([str(log), "--to", "mcap"]) == 0
    found: dict[str, list[Any]] = {}
    with (tmp_path / "live.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        for schema, channel, message in reader.iter_messages():
            assert schema is not None and schema.encoding == "protobuf" and channel.message_encoding == "protobuf"
            kind = SCHEMAS[channel.topic]
            assert schema.name == kind.DESCRIPTOR.full_name
            parsed = kind()
            assert parsed.ParseFromString(message.data) == len(message.data)
            assert len(UnknownFieldSet(parsed)) == 0
            found.setdefault(channel.topic, []).append((parsed, message))
        assert summary.statistics.message_count == sum(len(each) for each in found.values())
    return found


def test_every_kind_of_content_is_there_under_its_schema(messages: dict[str, list[Any]]) -> None:
    assert set(messages) == set(SCHEMAS)
    assert len(messages["/lio/cloud"]) == len(messages["/lio/pose"]) == 10


def test_schemas_in_the_file_describe_themselves(log: Path, tmp_path: Path, messages: dict[str, list[Any]]) -> None:
    with (tmp_path / "live.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    for schema in summary.schemas.values():
        described = FileDescriptorSet.FromString(schema.data)
        names = {f"{each.package}.{message.name}" for each in described.file for message in each.message_type}
        assert schema.name in names


def test_points_and_poses_are_in_axes_of_ros(messages: dict[str, list[Any]]) -> None:
    cloud, record = messages["/lio/cloud"][4]
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "intensity"]
    rows = np.frombuffer(cloud.data, dtype="<f4").reshape(-1, cloud.point_stride // 4)
    np.testing.assert_array_equal(rows[:, :3], POINTS @ R_OURS_FROM_FLU.astype(np.float32))
    assert (cloud.frame_id, cloud.pose.position.x, cloud.pose.position.y) == ("odom", 2.0, -0.4)
    assert (record.publish_time, record.log_time) == ((START_US + 200_000) * 1000, (START_US + 200_700) * 1000)
    pose, _ = messages["/lio/pose"][4]
    turned = rotation_matrix(
        np.array([pose.pose.orientation.w, pose.pose.orientation.x, pose.pose.orientation.y, pose.pose.orientation.z])
    )
    expected = R_OURS_FROM_FLU.T @ rotation_matrix(np.array(TURNED)) @ R_OURS_FROM_FLU
    np.testing.assert_allclose(turned, expected, atol=1e-12)
    assert np.arctan2(turned[1, 0], turned[0, 0]) == pytest.approx(0.4)  # to the left about +Z


def test_a_loop_is_drawn_and_taken_away_again(messages: dict[str, list[Any]]) -> None:
    drawn = [{e.id: [(p.x, p.y, p.z) for p in e.lines[0].points] for e in u.entities} for u, _ in messages["/graph"]]
    assert [len(each["loops"]) for each in drawn] == [0, 2, 0]
    assert drawn[1]["loops"] == [(3.0, -1.0, 2.0), (0.0, 0.0, 0.0)]
    assert drawn[-1]["keyframes"] == [(0.0, 0.0, 0.0), (3.0, -1.0, 2.0)]


def test_reasons_are_told_once_with_their_level(messages: dict[str, list[Any]]) -> None:
    said = [(log.level, log.name, log.message) for log, _ in messages["/log"]]
    assert (Log.WARNING, "lio_frontend", "scan not applied: no IMU") in said
    assert (Log.WARNING, "lio_frontend", "one direction is not observed") in said
    assert sum(text == "scans are applied" for _, _, text in said) == 2


def test_a_bag_that_left_comes_in_again_bit_for_bit(log: Path, tmp_path: Path, level_config: Path) -> None:
    assert main([str(log), "--to", "ros2"]) == 0
    again = tmp_path / "again.lcmlog"
    bag = tmp_path / "live_ros2"
    choice = ["--cloud", "/l1/scan"]
    assert importing.main([str(bag), "-o", str(again), "--config", str(level_config), *choice]) == 0
    before, after = read_log(log), read_log(again)
    for name in ("gyro", "accel"):
        np.testing.assert_array_equal(after["L1_IMU"][name], before["L1_IMU"][name])
    np.testing.assert_array_equal(after["L1_IMU"].utime, before["L1_IMU"].utime)
    np.testing.assert_array_equal(after["L1_SCAN"].utime, before["L1_SCAN"].utime)
    for name in ("x", "y", "z", "intensity", "dt_us"):
        for a, b in zip(after["L1_SCAN"].ragged[name], before["L1_SCAN"].ragged[name], strict=True):
            np.testing.assert_array_equal(a, b)


def test_turning_axes_keeps_every_digit_and_every_rotation() -> None:
    rng = np.random.default_rng(2)
    points = rng.normal(size=(50, 3)).astype(np.float32)
    np.testing.assert_array_equal(vectors_to_ros(points) @ R_OURS_FROM_FLU.T.astype(np.float32), points)
    rotation = rotation_from_yaw_pitch_roll(0.3, -0.2, 0.1)
    there = poses_to_ros(Poses(np.ones((1, 3)), quaternion_from_matrix(rotation)[None]))
    back = R_OURS_FROM_FLU @ rotation_matrix(there.quaternion[0]) @ R_OURS_FROM_FLU.T
    np.testing.assert_allclose(back, rotation, atol=1e-12)


def test_tum_and_csv_of_a_log(log: Path, tmp_path: Path) -> None:
    assert main([str(log), "--to", "tum"]) == 0
    eskf = read_tum(tmp_path / "live_tum" / "eskf.tum")
    assert len(eskf) == 10
    assert eskf.poses.position[4].tolist() == [0.4, 0.0, -2.0]
    assert main([str(log), "--to", "tum", "--axes", "forward_left_up", "-o", str(tmp_path / "ros")]) == 0
    assert read_tum(tmp_path / "ros" / "eskf.tum").poses.position[4].tolist() == [2.0, -0.4, 0.0]
    assert main([str(log), "--to", "csv"]) == 0
    rows = list(csv.DictReader((tmp_path / "live_csv" / "L1_IMU.csv").open()))
    assert (len(rows), rows[3]["accel_1"], rows[3]["utime"]) == (50, "9.81", str(START_US + 30_000))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["none.lcmlog", "--to", "mcap"], "does not exist"),
        (["notes.txt", "--to", "mcap"], "of no known kind"),
        (["live.lcmlog", "--to", "mcap", "--axes", "forward_left_up"], "--axes belongs to --to tum"),
        (["bare.lcmlog", "--to", "g2o"], "holds no configuration"),
    ],
)
def test_what_cannot_be_exported_is_said_in_one_sentence(
    arguments: list[str], said: str, log: Path, tmp_path: Path, capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "notes.txt").write_text("hello\n" * 100)
    (tmp_path / "bare.lcmlog").write_bytes(log.read_bytes().replace(b"IGNIS_CONFIG", b"OTHER_THINGS"))
    before = set(tmp_path.iterdir())
    assert main(arguments) == 2
    assert said in capsys.readouterr().err
    assert set(tmp_path.iterdir()) == before
