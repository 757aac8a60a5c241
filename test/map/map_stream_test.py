# SPDX-License-Identifier: Apache-2.0
"""A synthetic drive over the real bus into map_builder, seen through the WebSocket."""

import math
import time

import numpy as np
import pytest
from ignis_lcm import ignis as types

from map_drive import SCAN_PERIOD, SPEED, URL, WALL_X, Drive, Viewer, drive_for, hall_scan


@pytest.fixture
def running(private_network, start_server):
    server = start_server("--port", "0", url=URL)
    yield server
    assert server.stop() == 0


def test_a_drive_shows_walls_where_they_are_on_all_three_levels(running):
    viewer, drive = Viewer(running), Drive()
    viewer.socket.send(b'{"view": 60}')
    drive_for(drive, 24)
    viewer.wait_for(lambda hud: hud["map"]["clouds_inserted"] == drive.step)
    time.sleep(0.5)
    pose, levels = viewer.view()
    odometry, smoothed, edges = viewer.state.odometry, viewer.state.smoothed, viewer.state.edges
    assert np.allclose(pose[:3], drive.position() - [0, 0, -SPEED * SCAN_PERIOD], atol=1e-3)
    for points, _ in levels:
        assert len(points) > 100
        on_a_surface = (np.abs(np.abs(points[:, 0]) - WALL_X) < 0.5) | (np.abs(points[:, 1] + 0.5) < 0.5)
        assert on_a_surface.all()
    distance = [np.hypot(*(points[:, [0, 2]] - pose[[0, 2]]).T) for points, _ in levels]
    assert distance[0].max() < 10.7
    assert 10 < distance[1].max() < 30.7
    assert 30 < distance[2].max() < 60.7
    assert len(odometry) == len(smoothed) > 100
    assert len(edges) == 0
    assert viewer.hud["state"]["yaw_deg"] == pytest.approx(math.degrees(0.25))
    assert viewer.hud["state"]["forward_mps"] == SPEED
    assert viewer.hud["scan"]["applied"] is True
    assert viewer.hud["map"]["messages_lost"] == 0
    assert viewer.hud["map"]["health"] == "OK"


def test_a_loop_rebuilds_the_map_at_the_corrected_poses_and_the_stream_goes_on(running):
    viewer, drive = Viewer(running), Drive(drift=0.005)
    drive_for(drive, 12)
    viewer.wait_for(lambda hud: hud["map"]["clouds_inserted"] == drive.step)
    _, drifted = viewer.view()
    drive.publish_loop()
    drive.publish_correction(1)
    drive_for(drive, 2)
    viewer.wait_for(lambda hud: hud["map"]["revision"] == 1 and hud["map"]["clouds_inserted"] == drive.step)
    time.sleep(0.5)
    _, levels = viewer.view()
    odometry, smoothed, edges = viewer.state.odometry, viewer.state.smoothed, viewer.state.edges
    assert viewer.hud["map"]["revision"] == 1
    assert len(edges) == 1
    assert np.abs(odometry[:, 0]).max() > 0.9
    # What is left: drift within a keyframe's stretch, and that of the 2 s since the correction.
    assert np.abs(smoothed[:, 0]).max() < 0.35
    walls = levels[1][0][np.abs(levels[1][0][:, 1] - 0.7) < 0.6]
    before = drifted[1][0][np.abs(drifted[1][0][:, 1] - 0.7) < 0.6]
    spread = [np.abs(np.abs(points[:, 0]) - WALL_X).max() for points in (before, walls)]
    assert spread[0] > 0.6 > 0.4 > spread[1]
    assert (levels[1][1] == 0).mean() > 0.5, "most of what is shown belongs to closed keyframes"
    assert max(np.diff(viewer.times)) < 1.0, "the stream stopped"


def test_a_new_session_starts_an_empty_map(running):
    viewer, drive = Viewer(running), Drive()
    drive_for(drive, 2)
    viewer.wait_for(lambda hud: hud["map"]["clouds_inserted"] == drive.step)
    before = sum(viewer.hud["map"]["voxels"])
    cloud = types.cloud_t()
    cloud.sequence, cloud.part_count, cloud.session, cloud.quaternion = drive.step, 1, 1, [1.0, 0.0, 0.0, 0.0]
    cloud.num_points = 1
    cloud.x, cloud.y, cloud.z, cloud.intensity = [1.0], [0.0], [0.0], [9.0]
    drive.bus.publish("LIO_CLOUD", cloud.encode())
    viewer.wait_for(lambda hud: hud["map"]["voxels"] == [1, 1, 1])
    assert before > 1000


def test_a_pose_that_is_not_finite_changes_nothing_and_is_reported(running):
    viewer, drive = Viewer(running), Drive()
    drive_for(drive, 1)
    viewer.wait_for(lambda hud: hud["map"]["clouds_inserted"] == drive.step)
    voxels = viewer.hud["map"]["voxels"]
    for position in ([math.nan, 0, 0], [1e7, 0, 0]):
        drive.publish_cloud(position, hall_scan(np.zeros(3), drive.generator))
    viewer.wait_for(lambda hud: hud["map"]["health"].startswith("DEGRADED: 2 clouds"))
    assert viewer.hud["map"]["voxels"] == voxels
