# SPDX-License-Identifier: Apache-2.0
"""A synthetic drive over the real bus, and a viewer that follows it through the WebSocket."""

import json
import threading
import time

import numpy as np
import pytest
from ignis_lcm import ignis as types

from ignis.bus import open_bus
from stream_client import ViewState

URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152"
SCAN_PERIOD = 0.05
SPEED = 2.0
WALL_X = 3.0
LARGEST = 2**31 - 1


def forged_message(channel):
    """Well-formed, and of a session that nobody drives."""
    kinds = {"LIO_CLOUD": types.cloud_t, "LOOP_RESULT": types.loop_result_t}
    message = kinds.get(channel, types.smoothed_keyframes_t)()
    message.session = LARGEST
    sound = {"part_count": 1, "quaternion": [1.0, 0.0, 0.0, 0.0], "map_odom_quaternion": [1.0, 0.0, 0.0, 0.0]}
    for name in sound.keys() & set(message.__slots__):
        setattr(message, name, sound[name])
    return channel, message.encode()


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

    def __init__(self, drift=0.0, session=0):
        self.bus = open_bus(URL)
        self.session = session
        self.generator = np.random.default_rng(7)
        self.step = 0
        self.drift = drift
        self.keyframes = []
        self.last_keyframe_stamp = 0
        self.sent = {}  # by the scan's number: what was made of it, keyframe first
        self.asked_for = []
        self.bus.subscribe("CLOUD_REQUEST", self._send_clouds_again)

    def answer(self, seconds):
        """Does what is asked of a front end for a while."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.bus.handle_timeout(max(1, round(1000 * left)))

    def _send_clouds_again(self, _channel, data):
        for number in types.keyframe_request_t.decode(data).ids:
            self.asked_for.append(number)
            for channel, message in self.sent.get(number, ()):
                self.bus.publish(channel, message)

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
        cloud.session = self.session
        cloud.position, cloud.quaternion = list(position), [1.0, 0.0, 0.0, 0.0]
        cloud.num_points = len(scan)
        cloud.x, cloud.y, cloud.z = (list(map(float, scan[:, axis])) for axis in range(3))
        cloud.intensity = [float(100 + 10 * (i % 3)) for i in range(len(scan))]
        self.bus.publish("LIO_CLOUD", cloud.encode())
        self.sent[self.step] = [("LIO_CLOUD_AGAIN", cloud.encode())]

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
        keyframe.utime, keyframe.session = self.stamp(), self.session
        keyframe.previous_utime = self.last_keyframe_stamp if self.keyframes else keyframe.utime
        self.last_keyframe_stamp = keyframe.utime
        keyframe.part_count, keyframe.imu_complete, keyframe.resolution = 1, 1, 0.001
        keyframe.position, keyframe.quaternion = list(position), [1.0, 0.0, 0.0, 0.0]
        keyframe.num_points = len(scan)
        keyframe.x, keyframe.y, keyframe.z = (list(map(int, np.round(1000 * scan[:, axis]))) for axis in range(3))
        keyframe.intensity = bytes([50] * len(scan))
        self.keyframes.append(position)
        self.bus.publish("LIO_KEYFRAME", keyframe.encode())
        self.sent.setdefault(self.step, []).insert(0, ("LIO_KEYFRAME", keyframe.encode()))

    def start_cold(self, session=0):
        """The front end begins another drive: keyframes count from 0 again."""
        self.session, self.keyframes = session, []

    def publish_loop(self):
        loop = types.loop_result_t()
        loop.session = self.session
        loop.keyframes, loop.candidates, loop.passed, loop.accepted = len(self.keyframes), 1, 1, 1
        loop.from_id, loop.to_id, loop.correction_m = len(self.keyframes) - 1, 0, 0.3
        loop.stage, loop.reason_text = types.loop_result_t.STAGE_ON_TRIAL, "accepted"
        loop.relative_quaternion = [1.0, 0.0, 0.0, 0.0]
        self.bus.publish("LOOP_RESULT", loop.encode())

    def publish_correction(self, revision):
        """Puts every keyframe back on the line x = 0."""
        graph = types.smoothed_keyframes_t()
        graph.utime, graph.sequence, graph.revision = self.stamp(), revision, revision
        graph.part_count, graph.full, graph.session = 1, 1, self.session
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
