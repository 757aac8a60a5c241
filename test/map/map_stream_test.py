# SPDX-License-Identifier: Apache-2.0
"""A synthetic drive over the real bus into map_builder, seen through the WebSocket."""

import json
import math
import threading
import time

import lcm
import numpy as np
import pytest
from ignis_lcm import ignis as types
from stream_client import ViewState

URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152"
SCAN_PERIOD = 0.05
SPEED = 2.0
WALL_X = 3.0


def hall_scan(position, generator, points=1500):
    """Two walls at x = +-WALL_X and a floor at y = -0.5, as seen from the position, in body axes (no rotation)."""
    along = generator.uniform(-8, 8, points)
    height = generator.uniform(-0.5, 2.0, points)
    across = generator.uniform(-WALL_X, WALL_X, points)
    kind = np.arange(points) % 3
    x = np.where(kind == 0, WALL_X, np.where(kind == 1, -WALL_X, across)) - position[0]
    y = np.where(kind == 2, -0.5, height) - position[1]
    return np.stack([x, y, along], axis=1)


class Drive:
    """Publishes what the front end and the back end would: a straight drive along -Z, a keyframe every 2 m."""

    def __init__(self, drift=0.0):
        self.bus = lcm.LCM(URL)
        self.generator = np.random.default_rng(7)
        self.step = 0
        self.drift = drift
        self.keyframes = []

    def position(self):
        return np.array([self.drift * self.step, 0.0, -SPEED * SCAN_PERIOD * self.step])

    def advance(self):
        position, scan = self.position(), hall_scan(np.zeros(3), self.generator)
        self.publish_cloud(position, scan)
        self.publish_state(position)
        self.publish_stats()
        if self.step % round(2.0 / (SPEED * SCAN_PERIOD)) == 0:
            self.publish_keyframe(position, scan[::10])
        self.step += 1

    def stamp(self):
        return int(1_000_000 * SCAN_PERIOD * self.step)

    def publish_cloud(self, position, scan):
        cloud = types.cloud_t()
        cloud.utime, cloud.sequence, cloud.part_count, cloud.applied = self.stamp(), self.step, 1, 1
        cloud.position, cloud.quaternion = list(position), [1.0, 0.0, 0.0, 0.0]
        cloud.num_points = len(scan)
        cloud.x, cloud.y, cloud.z = (list(map(float, scan[:, axis])) for axis in range(3))
        cloud.intensity = [float(100 + 10 * k) for k in range(3)] * (len(scan) // 3)
        self.bus.publish("LIO_CLOUD", cloud.encode())

    def publish_state(self, position):
        state = types.state_t()
        state.utime, state.sequence, state.frame = self.stamp(), self.step, "odom"
        state.position, state.quaternion = list(position), [1.0, 0.0, 0.0, 0.0]
        state.yaw, state.velocity_forward = 0.25, SPEED
        self.bus.publish("LIO_STATE", state.encode())

    def publish_stats(self):
        stats = types.scan_stats_t()
        stats.utime, stats.sequence, stats.scan_sequence = self.stamp(), self.step, self.step
        stats.applied, stats.points, stats.matched = 1, 1500, 1200
        stats.reason_text = "applied"
        self.bus.publish("LIO_SCAN_STATS", stats.encode())

    def publish_keyframe(self, position, scan):
        keyframe = types.keyframe_t()
        keyframe.id = keyframe.sequence = len(self.keyframes)
        keyframe.utime = keyframe.previous_utime = self.stamp()
        keyframe.part_count, keyframe.imu_complete, keyframe.resolution = 1, 1, 0.001
        keyframe.position, keyframe.quaternion = list(position), [1.0, 0.0, 0.0, 0.0]
        keyframe.num_points = len(scan)
        keyframe.x, keyframe.y, keyframe.z = (list(map(int, np.round(1000 * scan[:, axis]))) for axis in range(3))
        keyframe.intensity = bytes([50] * len(scan))
        self.keyframes.append(position)
        self.bus.publish("LIO_KEYFRAME", keyframe.encode())

    def publish_loop(self):
        loop = types.loop_result_t()
        loop.keyframes, loop.candidates, loop.passed, loop.accepted = len(self.keyframes), 1, 1, 1
        loop.from_id, loop.to_id, loop.correction_m = len(self.keyframes) - 1, 0, 0.3
        loop.stage, loop.reason_text = types.loop_result_t.STAGE_ON_TRIAL, "accepted"
        loop.relative_quaternion = [1.0, 0.0, 0.0, 0.0]
        self.bus.publish("LOOP_RESULT", loop.encode())

    def publish_correction(self, revision):
        """Puts every keyframe back on the line x = 0."""
        graph = types.smoothed_keyframes_t()
        graph.utime, graph.sequence, graph.revision = self.stamp(), revision, revision
        graph.part_count, graph.full = 1, 1
        graph.graph_keyframes = graph.num_keyframes = len(self.keyframes)
        graph.newest_id = len(self.keyframes) - 1
        graph.map_odom_position = [-self.keyframes[-1][0], 0.0, 0.0]
        graph.map_odom_quaternion = [1.0, 0.0, 0.0, 0.0]
        graph.ids = list(range(len(self.keyframes)))
        graph.px = [0.0] * len(self.keyframes)
        graph.py = [0.0] * len(self.keyframes)
        graph.pz = [float(position[2]) for position in self.keyframes]
        graph.qw = [1.0] * len(self.keyframes)
        graph.qx = graph.qy = graph.qz = [0.0] * len(self.keyframes)
        self.bus.publish("SMOOTHED_KEYFRAMES", graph.encode())


class Viewer(threading.Thread):
    """Keeps a view by the stream in the background, checks each announcement, and collects the texts."""

    def __init__(self, server):
        super().__init__(daemon=True)
        status, self.socket = server.upgrade()
        assert status == 101
        self.state, self.lock = ViewState(), threading.Lock()
        self.times, self.sizes, self.hud, self.failure = [], [], None, None
        self.texts = {}
        self.start()

    def run(self):
        announced = None
        try:
            while self.failure is None:
                opcode, payload = self.socket.receive()
                if opcode == 2 and announced["type"] == "frame":
                    with self.lock:
                        self.state.apply(announced, payload)
                    self.times.append(time.monotonic())
                    self.sizes.append((announced["kind"], len(payload)))
                elif opcode == 2:
                    self.texts[announced["type"]].append(payload)
                elif opcode == 1:
                    announced = json.loads(payload)
                    self.texts.setdefault(announced["type"], []).append(announced)
                    self.hud = announced if announced["type"] == "hud" else self.hud
        except OSError:
            pass
        except Exception as error:  # the test's thread must hear of it
            self.failure = error

    def view(self):
        """Pose, and per level the voxels' centres with their live flags."""
        assert self.failure is None, repr(self.failure)
        with self.lock:
            return np.array(self.state.pose), [self.state.centres(level) for level in range(3)]

    def wait_for(self, condition, seconds=10):
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            if self.hud and condition(self.hud):
                return
            time.sleep(0.02)
        pytest.fail(f"never came true; the last status was {self.hud}")


def drive_for(drive, seconds):
    for _ in range(round(seconds / SCAN_PERIOD)):
        drive.advance()
        time.sleep(SCAN_PERIOD / 2)


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
    for points, flags in levels:
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
